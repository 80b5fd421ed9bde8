"""The current maps by name: from a wished force to a coil current."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

from mrctl.control.base import Parameter
from mrctl.control.parameters import number, resolve
from mrctl.model.baselines.linear import LinearMap
from mrctl.model.baselines.liu import LiuMap
from mrctl.model.baselines.reader import LEAD_RATIO, ReaderInverse
from mrctl.model.damper import Damper
from mrctl.model.effects.registry import of_damper
from mrctl.model.inverse import InverseModel
from mrctl.model.pipeline import InversePipeline, needs
from mrctl.model.static_inverse import Reach


class CurrentMap(Protocol):
    """What turns a wished force into a current, sample by sample; it keeps the last current and its reach."""

    current_a: float
    reach: Reach

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:
        """The current command in A."""

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Take the state that a constant wish leads to, with this current flowing."""


@dataclass(frozen=True, slots=True)
class CurrentMapKind:
    """A current map: its name, one line on what it does, its source and parameters."""

    name: str
    summary: str
    source: str
    parameters: tuple[Parameter, ...]
    make: Callable[[Damper, float, Mapping[str, float]], CurrentMap]


def _inverse(damper: Damper, dt_s: float, parameters: Mapping[str, float]) -> CurrentMap:  # noqa: ARG001  # has none
    return InversePipeline(damper, dt_s) if damper.effects else InverseModel(damper, dt_s)


def signals_of_effects(damper: Damper) -> frozenset[str]:
    """What the effects of a damper must be told beyond velocity, current and temperature.

    Displacement or nothing: acceleration is differenced from the velocity where none is measured.
    """
    return frozenset({"displacement"} & needs(of_damper(damper)))


CURRENT_MAPS: dict[str, CurrentMapKind] = {
    kind.name: kind
    for kind in (
        CurrentMapKind(
            "inverse",
            "the inverse of the whole model: hysteresis, velocity, temperature, current",
            "paper Eq. 8.1",
            (),
            _inverse,
        ),
        CurrentMapKind(
            "linear",
            "current in proportion to the force, through the damper's largest force at room temperature",
            "common practice",
            (
                Parameter(
                    "force_max_n",
                    "N",
                    0.0,
                    0.0,
                    1.0e5,
                    "force that gets the largest current; 0 takes the damper's largest",
                ),
            ),
            LinearMap,
        ),
        CurrentMapKind(
            "reader",
            "separable inverse at room temperature behind a first-order lead",
            "paper Eq. 3.1 to 3.4, Eq. 3.4 corrected",
            (
                Parameter(
                    "corner_hz", "Hz", 0.0, 0.0, 1000.0, "corner of the damper's lag; 0 fits it to its filter"
                ),
                Parameter(
                    "lead_ratio", "1", LEAD_RATIO, 1.01, 1000.0, "the lead's pole over its zero, b / a"
                ),
            ),
            ReaderInverse,
        ),
        CurrentMapKind(
            "liu",
            "viscous force by temperature and a power law of the current",
            "paper Eq. 2.2 and 2.3",
            (
                Parameter("viscous_length_m", "m", 0.0, 0.0, 1.0e6, "k; 0 fits it to the damper"),
                Parameter("field_force_n", "N", 0.0, 0.0, 1.0e5, "alpha, force of 1 A; 0 fits it"),
                Parameter("exponent", "1", 0.0, 0.0, 5.0, "beta; 0 fits it"),
            ),
            LiuMap,
        ),
    )
}


def make_current_map(
    name: str, damper: Damper, dt_s: float, parameters: Mapping[str, object] | None = None
) -> CurrentMap:
    """The current map of that name for one damper at a fixed step.

    Raises ValueError (the text says the mend) for an unknown name or unusable parameters, and
    mrctl.model.filters.FilterError when a filter cannot be carried to 1/dt_s.
    """
    kind = CURRENT_MAPS.get(name)
    if kind is None:
        close = get_close_matches(name, CURRENT_MAPS, n=1)
        mend = f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(CURRENT_MAPS)}"
        raise ValueError(f"no current map {name!r}; {mend}")
    values = resolve(name, kind.parameters, parameters or {})
    return kind.make(damper, dt_s, {key: number(values, key) for key in values})
