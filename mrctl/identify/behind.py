"""Slopes through the stages behind the static force: what yields, H, limits, and what measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, filtering, hysteresis
from mrctl.model.effects.base import Settings, Stage
from mrctl.model.static import StaticTables
from mrctl.simulate import Trace
from mrctl.simulate.output_slopes import output_slopes
from mrctl.simulate.step_slopes import limit_slopes, yield_chain, yield_slopes

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Behind:
    """The stages behind a run's static force, for slopes averaged over `inner` of its samples."""

    settings: Settings
    here: Trace
    tables: StaticTables
    inner: int

    @property
    def dt_s(self) -> float:
        """The time from one slope to the next."""
        return self.inner * self.here.run.dt_s

    @property
    def starts(self) -> Ints:
        """Where each stretch begins, and where the last one ends."""
        return self.here.run.starts // self.inner

    def mean(self, x: Array) -> Array:
        """A signal of the trace at the slopes' rate."""
        return np.ascontiguousarray(base.averaged(x, self.inner))

    def yielded(self, rows: Array, level_rows: Array) -> Array:
        """What yields, by f g h: rows (m, n), the first of which come with f h's, level_rows (l, n)."""
        here = self.here
        signals = here.static_n, here.velocity_m_s, here.displacement_m, here.level_n
        force, v, x, level = (self.mean(signal) for signal in signals)
        chosen = self.settings[Stage.YIELD]
        chain = yield_chain(chosen, (force, v, x, level), self.tables, self.dt_s, self.starts)
        return yield_slopes(chain, rows, level_rows)

    def filtered(self, filter_: Array, rows: Array) -> None:
        """H's, of these parameters, in their own place."""
        coarse = hysteresis.discretise(filter_, 1.0 / self.dt_s)
        filtering.filter_rows(*coarse, rows, self.starts)

    def limited_and_measured(self, rows: Array, before: Array | None, rod: Array | None = None) -> Array:
        """Behind what limits the fluid's force, with what pulls at the rod, and what measures both.

        before: the slopes of what goes into H, the first of rows; None where nothing limits. rod: the slopes
        of what pulls at the rod, None where nothing moves it.
        """
        here = self.here
        if before is not None:
            motion = here.velocity_m_s, here.displacement_m
            all_signals = here.sum_n, *motion, here.temperature_c, here.yielded_n, here.level_n
            force, v, x, warm, yielded, level = (self.mean(signal) for signal in all_signals)
            signals = force, v, x, warm, yielded, level
            chosen = self.settings[Stage.LIMIT]
            rows = limit_slopes(chosen, signals, self.tables, self.dt_s, self.starts, rows, before)
        if rod is not None:
            rows = rows + rod
        output = self.settings[Stage.OUTPUT]
        if not output:
            return rows
        return output_slopes(output, self.mean(here.whole_n), self.dt_s, self.starts, rows)
