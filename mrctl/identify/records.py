"""Measured runs as the fit wants them, with coarser looks at them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.measurements.leaps import as_it_moved
from mrctl.measurements.moving_means import smoothed
from mrctl.measurements.refine import refined, refinement, straight
from mrctl.measurements.run import Run

Array = NDArray[np.float64]

SIGNALS = (
    "velocity_m_s",
    "current_a",
    "temperature_c",
    "force_n",
    "displacement_m",
    "acceleration_m_s2",
)
LIGHT_J_K = 40.0  # the fluid of a small damper, or that in the gap of a large one
HOTTEST_K = 60.0
SHORTEST = 16  # samples; less says nothing about a third-order filter
REST_SHARE = 0.03  # of a record's top speed: slower is at rest or turns
TURN_S, TURN_SHARE = 0.02, 0.4  # where it turns, velocity or force change about as much as ever in that time
SOON_S, STILL_SHARE = 0.25, 0.05  # or about as much as soon, and not much less than ever
SLACK_SHARE, HELD_SHARE = 0.1, 0.5  # of the force's largest soon: what holds nothing yet, or still as before
TURNED_SHARE = 0.2  # of a record's top speed: no faster just after a turn
SLOW_M_S = 1e-3  # from sample to sample: far less than a damper's knee is wide
SLOWEST_HZ = 50.0


@dataclass(frozen=True, eq=False)
class Record:
    """One run's arrays, n samples each, on an even clock."""

    run: int  # which run of the campaign it is
    rate_hz: float
    velocity_m_s: Array
    current_a: Array
    temperature_c: Array
    force_n: Array
    displacement_m: Array
    acceleration_m_s2: Array
    finer: int = 1  # samples here for one that was measured
    averaged_s: float = 0.0  # the force is a moving mean over it
    passed: tuple[Array, Array] | None = None  # frequencies in Hz, and what was left of the motion there
    before_a: float = 0.0  # the current from which its first one was reached
    warmer_k: float = 0.0  # than other runs, the fluid is against the case as it begins

    def __len__(self) -> int:
        return self.force_n.size

    def as_stored(self, force_n: Array, factor: int = 1) -> Array:
        """A force (..., n // factor) averaged as the record's was."""
        return smoothed(force_n, self.averaged_s * self.rate_hz / factor)

    def refined(self, factor: int) -> Record:
        """Splines through the samples, at a multiple of their rate; current and temperature go straight."""
        if factor <= 1:
            return self
        return replace(
            self,
            rate_hz=self.rate_hz * factor,
            velocity_m_s=refined(self.velocity_m_s, factor),
            current_a=straight(self.current_a, factor),
            temperature_c=straight(self.temperature_c, factor),
            force_n=refined(self.force_n, factor),
            displacement_m=refined(self.displacement_m, factor),
            acceleration_m_s2=refined(self.acceleration_m_s2, factor),
            finer=self.finer * factor,
        )

    @cached_property
    def starts_at_rest(self) -> bool:
        """Whether the motion begins with the record: slowly, with a force that does not change yet either."""
        v, span = self.velocity_m_s, max(1, int(TURN_S * self.rate_hz))
        if v.size <= span:
            return False

        def turns(x: Array) -> bool:
            changes = np.abs(x[span:] - x[:-span])
            soon = changes[: max(1, int(SOON_S * self.rate_hz))]
            most = float(changes.max())
            like_soon = changes[0] > max(TURN_SHARE * float(soon.max()), STILL_SHARE * most)
            return bool(like_soon or changes[0] > TURN_SHARE * most)

        return self._begins_below(REST_SHARE) and not turns(v) and not turns(self.force_n)

    @property
    def driven_m_s(self) -> Array:
        """The velocity that moves a model: where noise or a turn hides from where it came, the force tells.

        While the force is next to none a slow motion begins from rest, as it does where noise points to both
        sides. Just after a turn what yields still holds as before it, on the force's side.
        """
        v, swing = self.velocity_m_s, self.force_n[:: self.finer]  # what was measured
        if min(float(v.max()), -float(v.min())) > TURNED_SHARE * float(np.abs(v).max()):
            swing = swing - 0.5 * (swing.max() + swing.min())  # about a gas spring's preload
        held = float(swing[0])
        most = float(np.abs(swing[: int(SOON_S * self.rate_hz / self.finer) + 1]).max())
        soon = v[: int(TURN_S * self.rate_hz) + 1]
        first = float(v[0])
        if abs(held) > HELD_SHARE * most and self._begins_below(TURNED_SHARE):
            first = math.copysign(first, held)
        elif self._begins_below(REST_SHARE) and (
            abs(held) <= SLACK_SHARE * most or (self.starts_at_rest and soon.min() < 0.0 < soon.max())
        ):
            first = 0.0
        return v if first == v[0] else np.concatenate([[first], v[1:]])

    def _begins_below(self, share: float) -> bool:
        return abs(float(self.velocity_m_s[0])) < share * float(np.abs(self.velocity_m_s).max())

    @cached_property
    def slow(self) -> int:
        """How many samples may become one: the motion hardly changes in them, and the current does not."""
        steady = float(np.ptp(self.current_a)) == 0.0
        most = self.rate_hz / SLOWEST_HZ if steady and self.finer == 1 else 1.0
        for factor in (1 << k for k in range(int(np.log2(max(most, 1.0))), 0, -1)):
            n = len(self) // factor * factor
            means = self.velocity_m_s[:n].reshape(-1, factor).mean(axis=1)
            if means.size > SHORTEST and float(np.max(np.abs(np.diff(means)))) < SLOW_M_S:
                return factor
        return 1

    def part(self, first: int, last: int) -> Record:
        """A stretch of the record."""
        return replace(self, **{name: getattr(self, name)[first:last] for name in SIGNALS})

    def decimated(self, factor: int) -> Record:
        """Means over `factor` samples: a coarser look at the same run."""
        if factor <= 1:
            return self
        n = (len(self) // factor) * factor

        def mean(x: Array) -> Array:
            return np.asarray(x[:n].reshape(-1, factor).mean(axis=1), dtype=np.float64)

        return replace(
            self,
            rate_hz=self.rate_hz / factor,
            velocity_m_s=mean(self.velocity_m_s),
            current_a=mean(self.current_a),
            temperature_c=mean(self.temperature_c),
            force_n=mean(self.force_n),
            displacement_m=mean(self.displacement_m),
            acceleration_m_s2=mean(self.acceleration_m_s2),
            finer=1,
        )


def records_of(runs: Iterable[Run]) -> list[Record]:
    """The runs that can be fitted: long enough, with force and current; in their order."""
    return [
        # What a clock's rounding makes of one rate is one rate.
        replace(_record(number, run), rate_hz=round(run.sample_rate_hz, 6))
        for number, run in enumerate(map(as_it_moved, runs))
        if len(run) >= SHORTEST and run.has_force and run.has_current
    ]


def refined_record(run: Run, least_hz: float) -> Record:
    """A whole run at a multiple of its rate, `least_hz` at least; without a force where the run has none."""
    whole = _record(0, as_it_moved(run))
    forced = replace(whole, force_n=np.nan_to_num(whole.force_n))
    return forced.refined(refinement(run.sample_rate_hz, least_hz))


def _record(number: int, run: Run) -> Record:
    return Record(
        number,
        run.sample_rate_hz,
        run.velocity_m_s,
        run.current_a,
        run.temperature_c,
        run.force_n,
        run.displacement_m,
        run.acceleration_m_s2,
        averaged_s=run.averaged_s,
    )


def possible_rise_k(records: Iterable[Record]) -> float:
    """How much warmer than the case a run's own losses could make a small damper's fluid."""
    heat_j = [float(np.sum(np.maximum(r.force_n * r.velocity_m_s, 0.0))) / r.rate_hz for r in records]
    return min(max(heat_j, default=0.0) / LIGHT_J_K, HOTTEST_K)
