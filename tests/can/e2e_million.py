"""Frames of random content against the package autosar-e2e, profile 2: protected alike, accepted alike.

    PYTHONPATH=.:tests python tests/can/e2e_million.py --frames 1000000

Each frame is protected by both and must come out the same; then it is given to both checks whole, with one to
three bits wrong, with every byte drawn anew, and with the data IDs of another frame. Exit status 1 at the
first difference.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter

from e2e.p02 import e2e_p02_check, e2e_p02_protect

from mrctl.can import e2e

LENGTHS = (2, 3, 5, 7, 8, 8, 8, 8, 8, 8, 12, 16, 20, 24, 32, 48, 64)


class DifferenceError(AssertionError):
    """The two do not agree."""


def compare(frames: int, seed: int) -> Counter[str]:
    """How many checks agreed, by what was done to the frame and whether it was accepted."""
    rng = random.Random(seed)
    agreed: Counter[str] = Counter()
    for number in range(frames):
        length = rng.choice(LENGTHS)
        frame = bytearray(rng.randbytes(length))
        data_ids = rng.randbytes(16)
        counter = rng.randrange(16)
        theirs = bytearray(frame)
        theirs[1] = theirs[1] & 0xF0 | counter
        e2e_p02_protect(theirs, data_ids, length=length, increment_counter=False)
        e2e.protect(frame, data_ids, counter)
        if frame != theirs:
            raise DifferenceError(f"frame {number}: {frame.hex()} protected, autosar-e2e has {theirs.hex()}")
        damaged = bytearray(frame)
        for bit in rng.sample(range(8 * length), rng.randrange(1, 4)):
            damaged[bit // 8] ^= 1 << bit % 8
        for what, data, ids in (
            ("whole", bytes(frame), data_ids),
            ("one to three bits wrong", bytes(damaged), data_ids),
            ("random", rng.randbytes(length), data_ids),
            ("of another data ID", bytes(frame), rng.randbytes(16)),
        ):
            ours = e2e.check(data, ids)
            if ours != e2e_p02_check(data, ids, length=length):
                raise DifferenceError(f"frame {number}, {what}: {data.hex()} with {ids.hex()}: {ours} here")
            if what == "whole" and not ours:
                raise DifferenceError(f"frame {number}: {data.hex()} is not accepted by either")
            agreed[f"{what}, {'accepted' if ours else 'refused'}"] += 1
    return agreed


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    started = time.monotonic()
    agreed = compare(args.frames, args.seed)
    print(f"{args.frames:,} frames protected alike; {agreed.total():,} checks alike:")
    for what, count in sorted(agreed.items()):
        print(f"  {what}: {count:,}")
    print(f"{time.monotonic() - started:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
