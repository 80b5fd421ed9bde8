"""Replay ten million frames: does the memory grow?

    python tests/replay/memory.py --frames 10000000

Makes a log of that length in a temporary folder (60 bytes a frame), replays it in a process of its own and
watches its resident memory. Exit status 1 if it grew by more than GROWTH_MB after the first tenth.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path += [str(ROOT), str(ROOT.parent)]  # behind the package that is to be looked at

from replay.recording import CONFIG, Car, line  # noqa: E402  # once the path is set

from mrctl.config import load_config  # noqa: E402  # as above
from mrctl.replay.run import replay  # noqa: E402  # as above

GROWTH_MB = 8.0
EPOCH_NS = 1_700_000_000_000_000_000


def make(path: Path, frames: int) -> None:
    """Sensor frames of a minute of driving, again and again with stamps that go on."""
    car = Car(load_config(CONFIG))
    period_ns = round(1e9 / car.rate_hz)
    minute = [(n, *frame) for n in range(round(60 * car.rate_hz)) for frame in car.frames(n)]
    ticks = round(60 * car.rate_hz)
    with path.open("w", encoding="ascii") as file:
        for written in range(0, frames, len(minute)):
            begin = EPOCH_NS + written // len(minute) * ticks * period_ns
            part = minute[: frames - written]
            file.writelines(line(begin + n * period_ns, can_id, data) + "\n" for n, can_id, data in part)


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096 / 1e6


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=10_000_000)
    args = parser.parse_args()
    seen: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "long.log")
        make(log, args.frames)
        size_mb = log.stat().st_size / 1e6
        began = time.process_time()
        figures = replay(
            log,
            load_config(CONFIG),
            out=Path(folder, "out.log"),
            progress=lambda share: seen.append((share, resident_mb())),
        ).figures
        took_s = time.process_time() - began
    after_a_tenth = next(mb for share, mb in seen if share >= 0.1)
    most, last = max(mb for _, mb in seen), seen[-1][1]
    print(
        f"{figures['frames']:,} frames, {size_mb:,.0f} MB, {figures['ticks']:,} ticks, {took_s:,.0f} s of CPU"
    )
    print(f"resident: {after_a_tenth:.1f} MB after a tenth, {last:.1f} MB at the end, {most:.1f} MB at most")
    return 1 if most - after_a_tenth > GROWTH_MB else 0


if __name__ == "__main__":
    sys.exit(main())
