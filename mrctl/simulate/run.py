"""What a damper was put through: one run's signals as arrays, ready for the compiled steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One run at a fixed step: motion, commanded current and case temperature; each (n), contiguous."""

    dt_s: float
    velocity_m_s: Array
    current_a: Array
    temperature_c: Array
    displacement_m: Array
    acceleration_m_s2: Array
    has_displacement: bool

    @classmethod
    def of(
        cls,
        dt_s: float,
        velocity_m_s: ArrayLike,
        current_a: ArrayLike,
        temperature_c: ArrayLike,
        displacement_m: ArrayLike | None = None,
        acceleration_m_s2: ArrayLike | None = None,
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
        )

    @property
    def size(self) -> int:
        """The number of samples."""
        return self.velocity_m_s.size


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
