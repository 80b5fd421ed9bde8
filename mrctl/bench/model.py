"""What a sample of forward and inverse model costs, against numpy and scipy as a user would write it.

The peers do the formula and nothing else: tables by `np.interp`, filters by `lfilter`, the field current read
off the table of f backwards. mrctl's inverse does more (limits, the second pass through both filters, the way
through zero velocity) and is not spared it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from mrctl.calibration import load_calibration
from mrctl.model.damper import Damper
from mrctl.model.pipeline import ForwardPipeline, InversePipeline
from mrctl.share_path import share_file
from mrctl.simulate import simulate

Array = NDArray[np.float64]

RATE_HZ = 1000.0
SAMPLES = 20_000
ONE_BY_ONE = 2_000  # of them, where a side goes sample by sample
WHOLE_RUN = "forward, a whole run"
EACH_SAMPLE = "forward, sample by sample"
INVERSE = "inverse, sample by sample"


@dataclass(frozen=True, slots=True)
class ModelCost:
    """Seconds a sample (the fastest of the rounds) of mrctl and peer, by task; how far forces differ."""

    seconds: dict[str, tuple[float, float]]
    difference_n: float
    largest_n: float


def measure(rounds: int = 3, advance: Callable[[], None] = lambda: None) -> ModelCost:
    """Time both sides of each task in turn; `advance` is called after each round."""
    damper = load_calibration(share_file("config/calibration.yaml")).damper
    v, i, warm = _drive(damper)
    peer = _Peer(damper)
    own, other = simulate(damper, 1.0 / RATE_HZ, v, i, warm, settled=False), peer.forward(v, i, warm)
    few = slice(0, ONE_BY_ONE)
    rows = list(zip(v[few].tolist(), i[few].tolist(), warm[few].tolist(), strict=True))
    wishes = list(zip(own[few].tolist(), v[few].tolist(), warm[few].tolist(), strict=True))
    forward, inverse = ForwardPipeline(damper, 1.0 / RATE_HZ), InversePipeline(damper, 1.0 / RATE_HZ)
    tasks: dict[str, tuple[Callable[[], object], Callable[[], object], int]] = {
        WHOLE_RUN: (
            partial(simulate, damper, 1.0 / RATE_HZ, v, i, warm, settled=False),
            partial(peer.forward, v, i, warm),
            SAMPLES,
        ),
        EACH_SAMPLE: (
            lambda: [forward.step(*row) for row in rows],
            lambda: [peer.forward_step(*row) for row in rows],
            ONE_BY_ONE,
        ),
        INVERSE: (
            lambda: [inverse.step(*row) for row in wishes],
            lambda: [peer.inverse_step(*row) for row in wishes],
            ONE_BY_ONE,
        ),
    }
    best = dict.fromkeys(tasks, (np.inf, np.inf))
    for _ in range(rounds):
        for name, (mine, theirs, count) in tasks.items():
            first, second = best[name]
            best[name] = min(first, _seconds(mine) / count), min(second, _seconds(theirs) / count)
        advance()
    return ModelCost(best, float(np.max(np.abs(own - other))), float(np.max(np.abs(own))))


def _drive(damper: Damper) -> tuple[Array, Array, Array]:
    """A sine with its harmonics, a current that comes and goes, a warming case: (n) each."""
    t = np.arange(SAMPLES) / RATE_HZ
    v = 0.3 * np.sin(2.0 * np.pi * 1.7 * t) + 0.1 * np.sin(2.0 * np.pi * 9.0 * t)
    i = damper.current_max_a * (0.5 - 0.5 * np.cos(2.0 * np.pi * 0.4 * t))
    return v, i, np.linspace(25.0, 80.0, SAMPLES)


class _Peer:
    """The model in numpy and scipy."""

    def __init__(self, damper: Damper) -> None:
        self._t = damper.static
        h, inverse = damper.forward_filter.resampled(RATE_HZ), damper.inverse_filter.resampled(RATE_HZ)
        self._b, self._a = np.array(h.b), np.array(h.a)
        self._ib, self._ia = np.array(inverse.b), np.array(inverse.a)
        self._state, self._inverse_state = np.zeros(self._b.size - 1), np.zeros(self._ib.size - 1)

    def forward(self, v: Array, i: Array, warm: Array) -> Array:
        """Force in N (n)."""
        return np.asarray(lfilter(self._b, self._a, self._static(v, i, warm)), dtype=np.float64)

    def forward_step(self, v: float, i: float, warm: float) -> float:
        """One sample of it."""
        out, self._state = lfilter(self._b, self._a, [self._static(v, i, warm)], zi=self._state)
        return float(out[0])

    def inverse_step(self, wish_n: float, v: float, warm: float) -> float:
        """One sample of current in A: h as it is where the damper is on."""
        t = self._t
        out, self._inverse_state = lfilter(self._ib, self._ia, [wish_n], zi=self._inverse_state)
        g = np.interp(v, t.velocity_m_s, t.shape)
        h = np.interp(warm, t.temperature_c, t.h_on)
        level = out[0] / (g * h) if abs(g) > 1e-3 else 0.0
        return float(np.interp(level, t.force_n, t.current_a))

    def _static(self, v: Array | float, i: Array | float, warm: Array | float) -> Array:
        t = self._t
        on = np.clip((i - t.off_below_a) / max(t.on_above_a - t.off_below_a, 1e-9), 0.0, 1.0)
        h_off = np.interp(warm, t.temperature_c, t.h_off)
        h = h_off + on * (np.interp(warm, t.temperature_c, t.h_on) - h_off)
        f = np.interp(i, t.current_a, t.force_n)
        return np.asarray(f * np.interp(v, t.velocity_m_s, t.shape) * h, dtype=np.float64)


def _seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin
