"""Measured runs as the fit wants them, with coarser looks at them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.measurements.run import Run

Array = NDArray[np.float64]

SHORTEST = 16  # samples; less says nothing about a third-order filter


@dataclass(frozen=True, slots=True)
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

    def __len__(self) -> int:
        return self.force_n.size

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
        )


def records_of(runs: Iterable[Run]) -> list[Record]:
    """The runs that can be fitted: long enough, with force and current; in their order."""
    return [
        Record(
            number,
            run.sample_rate_hz,
            run.velocity_m_s,
            run.current_a,
            run.temperature_c,
            run.force_n,
            run.displacement_m,
            run.acceleration_m_s2,
        )
        for number, run in enumerate(runs)
        if len(run) >= SHORTEST and run.has_force and run.has_current
    ]
