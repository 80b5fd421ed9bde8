"""Everything that describes one damper: what a calibration holds, as numbers the models take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mrctl.model.filters import Filter
from mrctl.model.static import StaticTables


@dataclass(frozen=True, slots=True)
class Span:
    """A closed range of validity."""

    low: float
    high: float

    def contains(self, x: float) -> bool:
        """Whether x lies in the range."""
        return self.low <= x <= self.high


@dataclass(frozen=True, slots=True)
class EffectSetting:
    """An effect beyond the separable model: its name and its parameters in SI units."""

    name: str
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Damper:
    """F = H(z)[ f(i) g(v) h(i, T) ], its inverse filter, its limits and where all of it holds."""

    static: StaticTables
    forward_filter: Filter
    inverse_filter: Filter
    refine_cutoff_hz: float | None  # band of the inverse filter's refinement; None leaves the filter as it is
    current_max_a: float
    current_slew_a_s: float
    velocity_valid_m_s: Span
    temperature_valid_c: Span
    current_valid_a: Span
    effects: tuple[EffectSetting, ...] = field(default=())
