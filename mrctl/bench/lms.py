"""What the adaptive filter costs, against padasip's, on the same data in the same run, in turn."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import MrctlError
from mrctl.identify.paper.lms import lms, many_passes, pass_map, windows

Array = NDArray[np.float64]

RATE_HZ = 2000.0
FREQUENCY_HZ = 2.387
CYCLES = 6  # what the paper keeps of nine: 5027 samples
TAPS = 500
STEP_PER_N2 = 1e-9
PASSES = 3000
NOISE_N = 5.0


@dataclass(frozen=True, slots=True)
class LmsCost:
    """Seconds of one pass over one run and of PASSES of them: of each the fastest of the rounds.

    passes_s is measured; padasip_passes_s is its pass times PASSES, which nobody waits for.
    difference: the largest between the coefficients of both after one pass; largest: of the coefficients.
    """

    samples: int
    taps: int
    pass_s: float
    padasip_pass_s: float
    passes: int
    passes_s: float
    padasip_passes_s: float
    difference: float
    largest: float

    @property
    def times_faster(self) -> float:
        """Padasip's time over this one's, for one pass."""
        return self.padasip_pass_s / self.pass_s


def one_run(taps: int = TAPS) -> tuple[Array, Array]:
    """(inputs (n + taps - 1), wanted (n)) in N: a backbone force, and it with a lag and noise."""
    count = round(CYCLES * RATE_HZ / FREQUENCY_HZ)
    t = (np.arange(count + taps - 1) - taps + 1) / RATE_HZ
    inputs = 1500.0 * np.tanh(np.sin(2.0 * math.pi * FREQUENCY_HZ * t) / 0.15)
    noise = np.random.default_rng(1).normal(0.0, NOISE_N, count)
    return inputs, inputs[taps - 1 - 3 : -3] + noise


def measure_lms(rounds: int = 3, advance: Callable[[], None] = lambda: None) -> LmsCost:
    """Time both, in turn, `rounds` times; `advance` is called after each round.

    Raises MrctlError where padasip is not installed.
    """
    try:
        # Only this benchmark needs it; it has no types.
        from padasip.filters import FilterLMS  # type: ignore[import-untyped]  # noqa: PLC0415
    except ImportError:
        raise MrctlError(
            "padasip, the peer of this benchmark, is not installed: pip install padasip"
        ) from None
    inputs, wanted = one_run()
    rows = np.ascontiguousarray(windows(inputs, TAPS))
    # Compiled now, if they were not: what is compiled on its first call is no part of a pass.
    lms(inputs, wanted, STEP_PER_N2, np.zeros(TAPS))
    pass_map(inputs, wanted, STEP_PER_N2, TAPS)
    own_s, other_s, many_s = [], [], []
    own, other = np.zeros(TAPS), np.zeros(TAPS)
    gc.collect()
    gc.disable()
    try:
        for _ in range(rounds):
            own = np.zeros(TAPS)
            own_s.append(_seconds(partial(lms, inputs, wanted, STEP_PER_N2, own)))
            peer = FilterLMS(TAPS, mu=STEP_PER_N2, w="zeros")
            other_s.append(_seconds(partial(peer.run, wanted, rows)))
            other = np.asarray(peer.w, dtype=np.float64)
            many_s.append(_seconds(lambda: many_passes(pass_map(inputs, wanted, STEP_PER_N2, TAPS), PASSES)))
            advance()
    finally:
        gc.enable()
    return LmsCost(
        samples=wanted.size,
        taps=TAPS,
        pass_s=min(own_s),
        padasip_pass_s=min(other_s),
        passes=PASSES,
        passes_s=min(many_s),
        padasip_passes_s=min(other_s) * PASSES,
        difference=float(np.max(np.abs(own - other))),
        largest=float(np.max(np.abs(other))),
    )


def lms_rows(cost: LmsCost) -> tuple[list[str], list[list[str | float]]]:
    """The benchmark as a table: headers, and a row for each side."""
    headers = [
        "",
        "one pass, ms",
        f"{cost.passes} passes, s",
        "times mrctl, one pass",
        f"{cost.passes} passes",
    ]
    return headers, [
        ["mrctl", 1e3 * cost.pass_s, cost.passes_s, 1.0, 1.0],
        [
            "padasip FilterLMS",
            1e3 * cost.padasip_pass_s,
            cost.padasip_passes_s,
            cost.times_faster,
            cost.padasip_passes_s / cost.passes_s,
        ],
    ]


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
