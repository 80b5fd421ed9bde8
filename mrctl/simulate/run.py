"""What a damper was put through: the signals as arrays, ready for the compiled steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A run at a fixed step: motion, commanded current and case temperature; each (n), contiguous.

    Or several stretches end to end, each with a start of its own: `starts` (stretches + 1) says where each
    begins and where the last one ends, `before_a` (stretches) from which current the first one was reached,
    `warmer_k` (stretches) how much warmer the fluid then was than an effect says.
    """

    dt_s: float
    velocity_m_s: Array
    current_a: Array
    temperature_c: Array
    displacement_m: Array
    acceleration_m_s2: Array
    has_displacement: bool
    starts: Ints
    before_a: Array
    warmer_k: Array

    @classmethod
    def joined(cls, runs: Sequence[Run]) -> Run:
        """Runs of one step, end to end. Raises ValueError where steps differ."""
        if len({run.dt_s for run in runs}) != 1:
            raise ValueError("runs that are joined have the same time step")
        if len(runs) == 1:
            return runs[0]
        ends = np.cumsum([run.size for run in runs])
        starts = [run.starts[:-1] + end - run.size for run, end in zip(runs, ends, strict=True)]
        return cls(
            runs[0].dt_s,
            np.concatenate([run.velocity_m_s for run in runs]),
            np.concatenate([run.current_a for run in runs]),
            np.concatenate([run.temperature_c for run in runs]),
            np.concatenate([run.displacement_m for run in runs]),
            np.concatenate([run.acceleration_m_s2 for run in runs]),
            all(run.has_displacement for run in runs),
            np.concatenate([*starts, ends[-1:]]),
            np.concatenate([run.before_a for run in runs]),
            np.concatenate([run.warmer_k for run in runs]),
        )

    @classmethod
    def of(
        cls,
        dt_s: float,
        velocity_m_s: ArrayLike,
        current_a: ArrayLike,
        temperature_c: ArrayLike,
        displacement_m: ArrayLike | None = None,
        acceleration_m_s2: ArrayLike | None = None,
        before_a: float = 0.0,
        warmer_k: float = 0.0,
    ) -> Run:
        """A run from its signals, each (n); current and temperature may be single numbers.

        Without acceleration, velocity is differenced backwards, as on the vehicle. Without displacement,
        effects that need it refuse. Raises ValueError for other shapes, values not finite or dt_s <= 0.
        """
        if not dt_s > 0.0:
            raise ValueError(f"the time step must be positive, not {dt_s:g} s")
        velocity = _signal("velocity", velocity_m_s, None)
        n = velocity.size
        return cls(
            float(dt_s),
            velocity,
            _signal("current", current_a, n),
            _signal("temperature", temperature_c, n),
            np.zeros(n) if displacement_m is None else _signal("displacement", displacement_m, n),
            backward_difference(velocity, dt_s)
            if acceleration_m_s2 is None
            else _signal("acceleration", acceleration_m_s2, n),
            displacement_m is not None,
            whole(n),
            np.array([before_a]),
            np.array([warmer_k]),
        )

    @property
    def size(self) -> int:
        """The number of samples."""
        return self.velocity_m_s.size


def whole(n: int) -> Ints:
    """The starts of n samples that are one stretch."""
    return np.array([0, n], dtype=np.int64)


def backward_difference(velocity_m_s: Array, dt_s: float) -> Array:
    """The acceleration (n) in m/s2 as the vehicle can know it: 0 at the first sample."""
    return np.diff(velocity_m_s, prepend=velocity_m_s[:1]) / dt_s


def _signal(name: str, values: ArrayLike, n: int | None) -> Array:
    """A writable contiguous copy or view (n): one memory layout means one compilation."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 and n is not None:
        array = np.full(n, float(array))
    if array.ndim != 1 or (n is not None and array.size != n):
        raise ValueError(f"{name} has the shape {array.shape}, where ({'n' if n is None else n},) is needed")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} holds values that are not finite")
    return np.require(array, requirements=["C", "A", "W"])
