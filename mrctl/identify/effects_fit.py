"""Effects beside the base model in one fit: their parameters as a vector, and dampers to simulate."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import hysteresis
from mrctl.identify.layout import Layout, Tables
from mrctl.model.damper import Damper, Span
from mrctl.model.effects.base import Effect, Parameter, Settings, Stage, Vector
from mrctl.model.filters import Filter
from mrctl.model.static import StaticTables, static_tables
from mrctl.simulate import Run, Trace, trace

Array = NDArray[np.float64]

NEAR = 0.05  # in any parameter: slopes by differences serve that far


@dataclass(frozen=True)
class Effects:
    """The effects of a joint model, and where their parameters stand: scaled to steps that matter."""

    chosen: tuple[Effect, ...]

    @property
    def parameters(self) -> list[tuple[Effect, Parameter]]:
        """All parameters with their effect, in the vector's order."""
        return [(effect, p) for effect in self.chosen for p in effect.parameters]

    @property
    def size(self) -> int:
        """How many parameters there are."""
        return len(self.parameters)

    @property
    def warm(self) -> bool:
        """Whether with one of them the fluid is warmer than was measured."""
        return any(effect.stage is Stage.TEMPERATURE for effect in self.chosen)

    def less(self, names: Container[str]) -> tuple[Effects, NDArray[np.bool_]]:
        """Those of other names, and which of the vector's parameters are theirs."""
        stays = np.array([e.name not in names for e, _ in self.parameters], dtype=bool)
        return Effects(tuple(e for e in self.chosen if e.name not in names)), stays

    def pack(self, values: Mapping[str, Sequence[float]]) -> Array:
        """The scaled vector of each effect's parameters; those not named are typical."""
        return np.array(
            [
                x / p.step_scale
                for effect in self.chosen
                for x, p in zip(values.get(effect.name, effect.typical), effect.parameters, strict=True)
            ]
        )

    def unpack(self, theta: Array) -> dict[str, Vector]:
        """Each effect's parameters in SI units, within their bounds whatever rounding did."""
        values: dict[str, Vector] = {}
        scales, lowest, highest = self._scales
        known = np.minimum(np.maximum(theta * scales, lowest), highest).tolist()
        at = 0
        for effect in self.chosen:
            values[effect.name] = tuple(known[at : at + len(effect.parameters)])
            at += len(effect.parameters)
        return values

    def settings(self, theta: Array) -> Settings:
        """What the simulation takes."""
        values = self.unpack(theta)
        return {stage: [(e, values[e.name]) for e in own] for stage, own in self._by_stage.items()}

    @cached_property
    def _by_stage(self) -> dict[Stage, list[Effect]]:
        ranked = sorted(self.chosen, key=_rank)
        return {stage: [e for e in ranked if e.stage is stage] for stage in Stage}

    @cached_property
    def _scales(self) -> tuple[Array, Array, Array]:
        """The step, lowest and highest value of each parameter, SI."""
        known = [p for _, p in self.parameters]
        return (
            np.array([p.step_scale for p in known]),
            np.array([p.low for p in known]),
            np.array([p.high for p in known]),
        )

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled vector: the effects' own."""
        scales, lowest, highest = self._scales
        return lowest / scales, highest / scales

    def free(self) -> NDArray[np.bool_]:
        """Which parameters a fit moves unless told otherwise."""
        return np.array([not p.held for _, p in self.parameters], dtype=bool)


def _rank(effect: Effect) -> tuple[int, str]:
    return effect.rank, effect.name


def bare_damper(layout: Layout, t: Tables, rate_hz: float) -> Damper:
    """What the forward simulation needs: tables and the filter at a rate, no limits, no inverse."""
    g = np.where(layout.velocity_m_s == 0.0, 0.0, t.g)
    static = static_tables(
        layout.current_a.tolist(),
        t.f.tolist(),
        layout.velocity_m_s.tolist(),
        g.tolist(),
        layout.temperature_c.tolist(),
        t.h_off.tolist(),
        t.h_on.tolist(),
        t.off_below_a,
        t.on_above_a,
    )
    none = Filter.of(rate_hz, (1.0,), (1.0,))
    everywhere = Span(-np.inf, np.inf)
    forward = hysteresis.as_filter(t.filter, rate_hz)
    return Damper(static, forward, none, None, np.inf, np.inf, everywhere, everywhere, everywhere)


class Kept:
    """Slopes that are dear, kept while the point at which they were taken is near."""

    def __init__(self) -> None:
        self._of: dict[int, tuple[Run, Array, NDArray[np.intp], Array]] = {}

    def slopes(self, run: Run, at: Array, index: NDArray[np.intp], make: Callable[[], Array]) -> Array:
        """The slopes (m, n) by parameters `index` of a run at a point, made anew where none near are kept."""
        old = self._of.get(id(run))
        if old is not None and old[0] is run and np.array_equal(old[2], index) and _near(old[1], at):
            return old[3]
        made = make()
        self._of[id(run)] = run, at, index, made
        return made


def _near(one: Array, other: Array) -> bool:
    return one.shape == other.shape and float(np.max(np.abs(one - other))) < NEAR


class Dampers:
    """The bare dampers of a set of tables, one for each rate."""

    def __init__(self, layout: Layout, tables: Tables, kept: Kept | None = None) -> None:
        self.layout, self.tables = layout, tables
        self._made: dict[float, Damper] = {}
        self._kept = Kept() if kept is None else kept

    def differences(self, run: Run, at: Array, index: NDArray[np.intp], make: Callable[[], Array]) -> Array:
        """The slopes by the tables' parameters (m, n), which a point nearby may lend."""
        return self._kept.slopes(run, at, index, make)

    def static(self, run: Run) -> StaticTables:
        """The tables as the simulation takes them."""
        return self._damper(run).static

    def traced(self, run: Run, settings: Settings, like: Trace | None) -> Trace:
        """The run through tables, filter and effects."""
        return trace(run, self._damper(run), settings=settings, like=like)

    def _damper(self, run: Run) -> Damper:
        damper = self._made.get(run.dt_s)
        if damper is None:
            damper = self._made[run.dt_s] = bare_damper(self.layout, self.tables, 1.0 / run.dt_s)
        return damper
