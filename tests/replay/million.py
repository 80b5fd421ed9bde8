"""A million ticks of the live loop, recorded and replayed: does any byte differ?

    python tests/replay/million.py --ticks 1000000

The live loop runs on a clock of its own, so that it takes minutes, not hours. Exit status 1 if any does.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path += [str(ROOT), str(ROOT.parent)]  # behind the package that is to be looked at

from replay.recording import CONFIG, candump, live, sent_lines  # noqa: E402  # once the path is set

from mrctl.config import load_config  # noqa: E402  # as above
from mrctl.replay.run import replay  # noqa: E402  # as above
from mrctl.runtime.compiled import COMPILED  # noqa: E402  # as above


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rows, _, _ = live(args.ticks, faults=True, seed=args.seed)
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder, "bus.log"), Path(folder, "again.log")
        lines = candump(rows)
        log.write_text("\n".join(lines) + "\n", encoding="ascii")
        figures = replay(log, load_config(CONFIG), out=out).figures
        again = out.read_text(encoding="ascii").splitlines()
    expected = sent_lines(lines)
    differing = sum(a != b for a, b in zip(expected, again, strict=False)) + abs(len(expected) - len(again))
    version = ".".join(map(str, sys.version_info[:3]))
    build = "compiled" if COMPILED else "interpreted"
    print(f"Python {version}, {build}: {figures['ticks']:,} ticks, {len(expected):,} frames sent")
    print(f"rejected: {figures['rejected']}")
    print("no byte differs" if not differing else f"{differing:,} frames differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
