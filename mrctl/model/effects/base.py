"""What an effect is: a physical effect beyond f(i) g(v) h(i, T) with a linear filter, told in one file.

Per sample, with the step dt, a damper with effects is

    i1 = current effects(i)                        the current that makes the field
    T1 = temperature effects(T, v, i1)             the fluid's temperature
    v1, x1 = motion effects(v, x, i1, T1)          what the piston sees
    b  = f(i1) g(v1) h(i1, T1) * factors(v1, x1, i1, T1)
    b1 = yield effects(b, v1, x1, f h)             elasticity before the fluid yields
    F  = H[b1] + sum of additive(v1, x1, a, i1, T1)
    F  = limit effects(F, v1, x1, T1, b1, f h)     what can build up in the fluid
    F  = F + sum of rod(v1, x1, a, i1, T1)         what pulls at the rod beside the fluid
    F  = output effects(F)                         what is measured of it

A stage's effects all have a `step` with the same arguments (`ARGUMENTS`), in plain floats:

    p      the effect's parameters, in the order of `Effect.parameters`; read only
    s      its state, as `start` made it; changed in place
    dt_s   the time since the last sample

`step` is run as it is on the vehicle and compiled by numba at the desk. So: floats, `math`, indexing,
loops, and calls of plain functions and of `mrctl.model.tables` and `mrctl.model.static` only; no
keyword arguments, no strings, no exceptions, nothing that divides by zero inside the bounds.
With all parameters neutral it must hand its input on exactly.

`start(p, ..., dt_s)` takes what the step takes but the state, at the first sample, and returns the
state in which that sample has lasted for ever. It runs in Python only and may use anything. A temperature
effect's first state, if it has any, is how much warmer than its case the fluid is, in K: runs that follow
on others begin with more of it.

A current effect's `step` may take the command to run straight between samples, as measurements show it.
On the vehicle a driver holds it: `held` is then the step with it, in which `undo` reaches what it says.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

from mrctl.errors import MrctlError
from mrctl.model.filters import Coefficients


class EffectError(MrctlError, ValueError):
    """A damper's effects do not hold together: unknown, out of bounds, or without a signal they need."""

    exit_status = 2


class Stage(StrEnum):
    """Where in the damper an effect acts; the order here is the order of computation."""

    CURRENT = "current"
    TEMPERATURE = "temperature"
    MOTION = "motion"
    FACTOR = "factor"
    YIELD = "yield"
    ADDITIVE = "additive"
    LIMIT = "limit"
    ROD = "rod"
    OUTPUT = "output"


class Undo(StrEnum):
    """How the inverse model undoes an effect."""

    SUBTRACT = "subtract"  # the effect's force is taken off the wish
    DIVIDE = "divide"  # the wish is divided by the factor
    LEAD = "lead"  # the effect's `undo` says what input makes the wanted output
    OBSERVE = "observe"  # its state is followed with the commands sent; the static inverse then uses it
    NOT_UNDONE = "not undone"


_IN = "p", "s"
_FORCES = "velocity_m_s", "displacement_m", "acceleration_m_s2", "current_a", "temperature_c"
ARGUMENTS: Mapping[Stage, tuple[str, ...]] = {
    Stage.CURRENT: (*_IN, "current_a", "dt_s"),
    Stage.TEMPERATURE: (*_IN, "temperature_c", "velocity_m_s", "current_a", "tables", "dt_s"),
    Stage.MOTION: (
        *_IN, "velocity_m_s", "displacement_m", "current_a", "temperature_c", "factor", "beside_n",
        "beside_n_s_m", "tables", "lag", "dt_s",
    ),
    Stage.FACTOR: (*_IN, "velocity_m_s", "displacement_m", "current_a", "temperature_c", "dt_s"),
    Stage.YIELD: (*_IN, "force_n", "velocity_m_s", "displacement_m", "level_n", "dt_s"),
    Stage.ADDITIVE: (*_IN, *_FORCES, "dt_s"),
    Stage.LIMIT: (
        *_IN, "force_n", "velocity_m_s", "displacement_m", "temperature_c", "static_n", "level_n", "tables",
        "dt_s",
    ),
    Stage.ROD: (*_IN, *_FORCES, "dt_s"),
    Stage.OUTPUT: (*_IN, "force_n", "dt_s"),
}  # fmt: skip
"""The arguments of a stage's `step`.

`static_n` is b1, what goes into H; `level_n` is f(i1) h(i1, T1), the force where g is 1; `tables` are f, g
and h (`StaticTables`), `lag` is a plain one as long as H's at this step (`plain_lag`). `factor`, `beside_n`
and `beside_n_s_m` are what the piston feels beside f g h (`mrctl.model.beside`): what factor effects multiply
that by, and the additive and rod effects' force at a piston at rest and how it grows with the piston's
velocity. Of several motion effects the last, next to the piston, is told; the others 1, 0 and 0.
"""

UNDONE_BY: Mapping[Stage, frozenset[Undo]] = {
    Stage.CURRENT: frozenset({Undo.LEAD}),
    Stage.TEMPERATURE: frozenset({Undo.OBSERVE}),
    Stage.MOTION: frozenset({Undo.OBSERVE}),
    Stage.FACTOR: frozenset({Undo.DIVIDE}),
    Stage.YIELD: frozenset({Undo.LEAD, Undo.DIVIDE}),
    Stage.ADDITIVE: frozenset({Undo.SUBTRACT}),
    Stage.LIMIT: frozenset({Undo.LEAD}),
    Stage.ROD: frozenset({Undo.SUBTRACT}),
    Stage.OUTPUT: frozenset({Undo.LEAD}),
}
"""What `InversePipeline` can do for a stage, beside leaving an effect as it is."""

WITH_UNDO = frozenset({Stage.CURRENT, Stage.YIELD, Stage.LIMIT, Stage.OUTPUT})
"""Stages whose effects are undone by a function of their own, `undo`."""

SIGNALS = frozenset({"displacement", "acceleration"})
"""What an effect may need beyond velocity, current and temperature."""


CONDITIONS = frozenset(
    {
        "velocity", "stroke", "acceleration", "current", "current rate", "temperature", "time", "energy",
        "frequency",
    }
)  # fmt: skip
"""Over which a diagnosis asks whether a found effect has one size."""

FORCES = frozenset({"N", "kg", "J", "W"})  # units of what a larger damper has more of
ANY_SIZE = 100.0  # times the bounds that are for a usual damper


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect. Its bounds are physics: a mass is never negative.

    `neutral` together with the other neutral values makes the effect vanish exactly. `typical` is where
    a fit starts and `scale` how large a change is of interest there. A fit leaves a `held` parameter at
    its typical value unless asked. The force is `linear` in it when all else is fixed. Where a calibration
    leaves an `optional` one out, it is neutral. An `endless` one's upper bound stands for none; at a
    `partial` one's lower bound the effect is there without that part. A `far` one is seen from the effect's
    far points only: a look that begins without it leaves it out. Where a unit counts in newtons, bounds are
    those in a damper of a usual size (`size.sized`).
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    typical: float
    help: str
    scale: float = 0.0  # 0 stands for |typical|
    linear: bool = False
    held: bool = False
    optional: bool = False
    endless: bool = False
    partial: bool = False
    far: bool = False

    @property
    def step_scale(self) -> float:
        """The magnitude of a change that matters, for optimisers; never 0."""
        return self.scale or abs(self.typical) or (self.high - self.low)

    @property
    def reach(self) -> tuple[float, float]:
        """From where to where it may lie in a damper of any size: what counts in newtons goes with that."""
        if not force_power(self.unit):
            return self.low, self.high
        return (
            self.low * (ANY_SIZE if self.low < 0.0 else 1.0 / ANY_SIZE),
            self.high * (ANY_SIZE if self.high > 0.0 else 1.0 / ANY_SIZE),
        )


def force_power(unit: str) -> int:
    """How often a unit counts in newtons: 1 for N, N*s/m or kg, -1 for m/N or K/(J*s), 0 for s or 1/K."""
    over, _, under = unit.partition("/")
    powers = []
    for part in (over, under):
        factors = (factor.partition("^") for factor in re.split(r"[*/()·\s]+", part))
        powers.append(sum(int(power or 1) for name, _, power in factors if name in FORCES))
    return powers[0] - powers[1]


FORCE_LAG = Parameter(
    "lag_s",
    "s",
    0.0,
    0.0,
    0.05,
    0.0,
    "time constant with which the force follows",
    2e-3,
    optional=True,
)
"""Of a force that the chamber's compliance lets lag, as the one behind H does."""

FORCE_SWING = Parameter(
    "swing", "1", 0.0, 0.0, 1.0, 0.0, "how far it follows with a swing, from 0.25 on", 0.3, optional=True
)
"""Of a force that fluid's inertia lets swing behind that compliance."""

COMPRESSION_CHANGE = Parameter(
    "compression_change",
    "1",
    0.0,
    -0.9,
    5.0,
    0.0,
    "relative change of the force in compression",
    0.3,
    optional=True,
)
"""Of a force that is another in compression: other orifices, another rubber."""


class Ranges(NamedTuple):
    """The largest absolute values in a campaign, for effects whose start depends on the rig's reach."""

    displacement_m: float
    velocity_m_s: float
    current_a: float
    force_n: float
    compression_force_n: float = 0.0  # the largest force in compression, positive
    sample_s: float = 0.0  # the slowest record's interval


Step = Callable[..., Any]
Start = Callable[..., list[float]]
Vector = tuple[float, ...]


class GivesWay(NamedTuple):
    """The linearisation of a motion effect that hangs on the damper's force, for fits.

    `step(p, s, force_n, damping_n_s_m, stiffness_n_m, given_m, lag, dt_s)` says how the piston's velocity and
    displacement change when the damper's force at a given motion changes by `force_n`, in proportion to that
    and to the state, damping and stiffness being the slopes of f g h and what multiplies it over these,
    `given_m` by how much less than the rod the piston has moved, `s` as in the effect's step.
    `start(p, force_n, given_m)` is the state in which the first sample has lasted for ever. `inside(p, lag)`
    is the lag of the force that it hangs on, which `step` is given, from that of the effect's step.
    `bears(p, s, before_m, given_m, given_m_s, dt_s)` is the force in N that it hangs on: given_m and
    given_m_s by how much less than the rod the piston has moved and moves, before_m the one a sample ago, `s`
    as in the effect's step and 0 at first. The effect's first parameter says how far it gives way, 0 if not.
    """

    step: Step
    start: Start
    inside: Callable[[Vector, Coefficients], Coefficients]
    bears: Step


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect: what it is, its numbers, its step and its way back. See the module's text."""

    name: str
    stage: Stage
    summary: str
    equation: str
    source: str
    parameters: tuple[Parameter, ...]
    step: Step
    inverse: Undo
    inverse_note: str  # how exactly, or what it costs that it is not undone
    start: Start | None = None  # None: the effect has no state
    states: tuple[str, ...] = ()  # what the state holds, in words
    # Places of states on which nothing hangs at these parameters: a fit takes no slopes by them.
    idle: Callable[[Vector], Collection[int]] | None = None
    needs: frozenset[str] = frozenset()
    undo: Step | None = None  # step's arguments, its input replaced by the wanted output; gives the input
    guesses: Callable[[Ranges], Sequence[Vector]] | None = None  # starting points other than typical
    # Points that no small step of a base leads to, though the fit with both is better there. A warmth's are
    # tried from a straight h, where a base has bent its own.
    far: Callable[[Ranges], Sequence[Vector]] | None = None
    # Points beside a fitted one, at which it may fit better and to which no small step of it leads.
    beside: Callable[[Vector, Ranges], Sequence[Vector]] | None = None
    held: Step | None = None  # of a current effect: the step with its input held from sample to sample
    derived: Callable[[Vector], Mapping[str, tuple[float, str]]] | None = None  # name: (value, unit)
    # Whether fitted parameters still describe this effect, and not another that it can imitate.
    plausible: Callable[[Vector, Ranges], bool] | None = None
    gives_way: GivesWay | None = None  # of a motion effect; without it a fit takes differences
    # What its parameters become where f grows by a factor and g shrinks by it: for one that is told f h.
    rescaled: Callable[[Vector, float], Vector] | None = None
    felt: bool = True  # by a piston; what is in the measurement only, a motion effect does not carry
    linear: bool = False  # an output effect that is a fixed linear filter of the force: fits are faster then
    rank: int = 0  # order within the stage; equal ranks go by name
    usual: Effect | None = field(default=None, compare=False, repr=False)  # it in a damper of a usual size
    # Conditions over which nature's form may be another, and the effect still this one (CONDITIONS).
    shape_over: frozenset[str] = frozenset()
    # Effects that it may be taken for where f h is steady, since only that tells them apart.
    alike_at_one_level: frozenset[str] = frozenset()

    @property
    def neutral(self) -> Vector:
        """The parameters at which the effect vanishes."""
        return tuple(parameter.neutral for parameter in self.parameters)

    @property
    def needed(self) -> tuple[bool, ...]:
        """Which parameters move from the first: what is optional joins a fit that stands."""
        return tuple(not (p.held or p.optional) for p in self.parameters)

    @property
    def typical(self) -> Vector:
        """Parameters of the usual size."""
        return tuple(parameter.typical for parameter in self.parameters)

    def starting_points(self, ranges: Ranges) -> list[Vector]:
        """Where a fit had best start, each point within the bounds."""
        return [self.within(p) for p in ([self.typical] if self.guesses is None else self.guesses(ranges))]

    def describes(self, values: Vector, ranges: Ranges) -> bool:
        """Whether fitted parameters are still this effect's, as far as it knows what it is not."""
        return self.plausible is None or self.plausible(values, ranges)

    def within(self, values: Vector) -> Vector:
        """Values within the parameters' bounds."""
        return tuple(min(max(x, p.low), p.high) for x, p in zip(values, self.parameters, strict=True))

    def vector(self, values: Mapping[str, float]) -> Vector:
        """The parameters in order. Raises EffectError naming every one missing, unknown or out of bounds."""
        values = {p.name: p.neutral for p in self.parameters if p.optional} | dict(values)
        known = {parameter.name for parameter in self.parameters}
        wrong = [f"unknown parameter {name}" for name in values if name not in known]
        for parameter in self.parameters:
            if parameter.name not in values:
                wrong.append(f"{parameter.name} is missing")
                continue
            low, high = parameter.reach
            if not low <= values[parameter.name] <= high:
                wrong.append(
                    f"{parameter.name} = {values[parameter.name]:g} is outside "
                    f"{low:g} to {high:g} {parameter.unit}"
                )
        if wrong:
            raise EffectError(f"{self.name}: " + ", ".join(wrong))
        return tuple(float(values[parameter.name]) for parameter in self.parameters)

    def mapping(self, vector: Sequence[float]) -> dict[str, float]:
        """The parameters by name."""
        return {p.name: float(x) for p, x in zip(self.parameters, vector, strict=True)}

    def initial(self, p: Vector, *first: Any) -> list[float]:  # noqa: ANN401 - as the stage's step
        """The state at a first sample; `first` are the step's arguments after the state."""
        return [] if self.start is None else [float(x) for x in self.start(p, *first)]


Settings = Mapping[Stage, Sequence[tuple[Effect, Vector]]]
"""Effects with their parameter vectors, by stage, each stage in its order; a missing stage has none."""
