"""What a run did before its first sample, which no file tells: the pasts that it may have had.

A force hangs on the moments before it, by the damper's lags: where a run is cut out of a motion, the first
forces are those of a past that is not in the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrctl.measurements.run import FloatArray

PAST_S = 0.2  # longer than most dampers remember


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """Motion and current that end just before a run's first sample, each (n)."""

    velocity_m_s: FloatArray
    displacement_m: FloatArray
    acceleration_m_s2: FloatArray
    current_a: FloatArray

    def __len__(self) -> int:
        return self.velocity_m_s.size


def pasts_of(
    velocity_m_s: FloatArray,
    displacement_m: FloatArray,
    acceleration_m_s2: FloatArray,
    current_a: FloatArray,
    rate_hz: float,
    *,
    finer: int = 1,
    came_from_a: Sequence[float] = (),
) -> list[Past]:
    """The pasts that a run, each (n), may have had: its first sample for ever, rest, its motion turned round.

    The first of them is empty: so a model begins by itself. Each with the current as at first, and with it
    come from others, half a past before. Turned round is point symmetric, so that velocity and its slope go
    on, in the stroke that the run has. finer: samples for one that was measured; a past has whole ones.
    """
    v, x, a = velocity_m_s, displacement_m, acceleration_m_s2
    n = min(int(PAST_S * rate_hz), v.size - 1) // finer * finer
    none, steady = np.zeros(0), np.full(n, current_a[0])
    begun = [Past(none, none, none, none)]
    if n == 0:
        return begun
    ago_s = np.arange(n, 0, -1) / rate_hz
    turned = slice(n, 0, -1)
    moving = [
        (np.zeros(n), np.full(n, x[0]), np.zeros(n)),
        (2.0 * v[0] - v[turned], np.clip(x[turned] - 2.0 * v[0] * ago_s, x.min(), x.max()), a[turned]),
    ]
    lasting = (np.full(n, v[0]), np.full(n, x[0]), np.full(n, a[0]))
    stepped = [np.where(np.arange(n) < n // 2, level, steady) for level in came_from_a]
    return [
        *begun,
        *(Past(*motion, steady) for motion in moving),
        *(Past(*motion, current) for current in stepped for motion in (lasting, *moving)),
    ]
