"""Effects at work sample by sample, with the states they carry; the pipelines chain them."""

from __future__ import annotations

from typing import Any

from mrctl.model.beside import ALONE, Beside, felt
from mrctl.model.effects.base import Effect, Settings, Stage, Vector
from mrctl.model.filters import Coefficients
from mrctl.model.static import StaticTables


class Running:
    """One effect at work: its step, parameters and state; the state is made at the first sample."""

    __slots__ = ("_effect", "_held", "_state", "p", "step", "undo")

    def __init__(self, effect: Effect, p: Vector) -> None:
        self._effect = effect
        self._state: list[float] | None = None
        self.p = p
        self.step = effect.step
        self._held = effect.held or effect.step
        self.undo = effect.undo

    def state(self, *first: Any) -> list[float]:  # noqa: ANN401 - as the stage's step
        """The state, begun with the step's arguments after the state where there is none yet."""
        if self._state is None:
            self._state = self._effect.initial(self.p, *first)
        return self._state

    def next(self, *inputs: Any) -> Any:  # noqa: ANN401 - as the stage's step
        """The step's result; the state goes on."""
        return self.step(self.p, self.state(*inputs), *inputs)

    def next_held(self, *inputs: Any) -> Any:  # noqa: ANN401 - as the stage's step
        """As `next`, the input held through the sample."""
        return self._held(self.p, self.state(*inputs), *inputs)

    def peek(self, *inputs: Any) -> Any:  # noqa: ANN401 - as the stage's step
        """The step's result; the state stays."""
        return self.step(self.p, list(self.state(*inputs)), *inputs)

    def input_for(self, wanted: float, now: float, *rest: Any) -> float:  # noqa: ANN401 - as the stage's step
        """The input that makes the wanted output; a state is begun with the input of now."""
        if self.undo is None:
            return wanted
        return float(self.undo(self.p, self.state(now, *rest), wanted, *rest))

    def restart(self) -> None:
        """Begin anew at the next sample."""
        self._state = None


class Stages:
    """All effects of one damper at work, by stage; built from effects in their order."""

    __slots__ = (
        "additive",
        "beside",
        "current",
        "everything",
        "factor",
        "limit",
        "motion",
        "output",
        "rod",
        "temperature",
        "yielding",
    )

    def __init__(self, chosen: Settings) -> None:
        by = {stage: tuple(Running(*pair) for pair in chosen.get(stage, ())) for stage in Stage}
        self.current = by[Stage.CURRENT]
        self.temperature = by[Stage.TEMPERATURE]
        self.motion = by[Stage.MOTION]
        self.beside = Beside(*felt(chosen))
        self.factor = by[Stage.FACTOR]
        self.yielding = by[Stage.YIELD]
        self.additive = by[Stage.ADDITIVE]
        self.limit = by[Stage.LIMIT]
        self.rod = by[Stage.ROD]
        self.output = by[Stage.OUTPUT]
        self.everything = tuple(one for effects in by.values() for one in effects)

    def restart(self) -> None:
        """Begin anew at the next sample."""
        for one in self.everything:
            one.restart()
        self.beside.restart()

    def fluid_and_piston(
        self,
        v: float,
        x: float,
        a: float,
        current_a: float,
        temperature_c: float,
        t: StaticTables,
        lag: Coefficients,
        dt_s: float,
    ) -> tuple[float, float, float]:
        """The fluid's temperature, the piston's velocity and its displacement."""
        for one in self.temperature:
            temperature_c = one.next(temperature_c, v, current_a, t, dt_s)
        if not self.motion:
            return temperature_c, v, x
        *outer, inner = self.motion
        for one in outer:
            v, x = one.next(v, x, current_a, temperature_c, *ALONE, t, lag, dt_s)
        if not self.beside:
            v, x = inner.next(v, x, current_a, temperature_c, *ALONE, t, lag, dt_s)
            return temperature_c, v, x
        rest = a, current_a, temperature_c, dt_s

        def piston_m_s(*carried: float) -> float:
            return float(inner.peek(v, x, current_a, temperature_c, *carried, t, lag, dt_s)[0])

        carried = self.beside.ahead(piston_m_s, v, x, *rest)
        v1, x1 = inner.next(v, x, current_a, temperature_c, *carried, t, lag, dt_s)
        self.beside.follow((v - v1, x - x1), v1, x1, *rest)
        return temperature_c, v1, x1


class Acceleration:
    """Velocity differenced backwards, where no acceleration is measured; 0 at the first sample."""

    __slots__ = ("_before", "_dt_s")

    def __init__(self, dt_s: float) -> None:
        self._dt_s = dt_s
        self._before: float | None = None

    def next(self, velocity_m_s: float, measured_m_s2: float | None) -> float:
        """The acceleration in m/s2 at this sample."""
        before, self._before = self._before, velocity_m_s
        if measured_m_s2 is not None:
            return measured_m_s2
        return 0.0 if before is None else (velocity_m_s - before) / self._dt_s
