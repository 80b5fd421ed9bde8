"""The interpreter's side of a benchmark in a compiled build: a process that runs the same files as Python.

    python -m mrctl.bench.interpreted CONFIG

It takes jobs from standard input, one a line, and answers each with its times.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.abc import MetaPathFinder
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, ModuleSpec, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any, Self

from mrctl.errors import MrctlError


class Interpreted:
    """Such a process; a context."""

    def __init__(self, config: Path) -> None:
        words = [sys.executable, "-m", "mrctl.bench.interpreted", str(config)]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # noqa: S603  # itself

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        assert self._process.stdin  # noqa: S101  # a pipe was asked for
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()

    def block(self, first: int, last: int) -> list[int]:
        """Times in ns of the ticks from `first` to before `last`."""
        return list(self._ask(first, last))

    def replay_s(self, log: Path) -> float:
        """CPU seconds of one replay."""
        return float(self._ask(str(log)))

    def _ask(self, *job: object) -> Any:  # noqa: ANN401  # as the job
        assert self._process.stdin  # noqa: S101  # pipes were asked for
        assert self._process.stdout  # noqa: S101  # as above
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise MrctlError("the benchmark's second process has ended; see above why")
        return json.loads(answer)


class _SourcesOnly(MetaPathFinder):
    """Finds mrctl's modules as source files, whatever machine code stands beside them."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """As every finder."""
        if path is None or not name.startswith("mrctl."):
            return None
        finders = (FileFinder(entry, (SourceFileLoader, SOURCE_SUFFIXES)) for entry in path)
        return next((spec for finder in finders if (spec := finder.find_spec(name))), None)


def main() -> None:
    """Answer jobs until there are no more."""
    sys.meta_path.insert(0, _SourcesOnly())
    # Only now, so that they are found as sources.
    from mrctl.bench import replay, tick  # noqa: PLC0415
    from mrctl.config import load_config  # noqa: PLC0415

    config = load_config(Path(sys.argv[1]))
    ours, source = tick.ours(config), tick.drive(config)
    for line in sys.stdin:
        job = json.loads(line)
        if len(job) == 2:  # from tick to tick
            answer: Any = tick.times_ns(*ours, [source(n) for n in range(*job)])
        else:
            answer = replay.cpu_s(lambda log=Path(job[0]): replay.ours(log, config))  # type: ignore[misc]  # bound
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
