"""The forces of batches of records under tables and effects, and their slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base, effects_fit, slopes
from mrctl.identify.batch import Batch
from mrctl.identify.effects_fit import Dampers, Effects
from mrctl.identify.layout import Layout
from mrctl.identify.parallel import in_parallel
from mrctl.simulate import Trace

Array = NDArray[np.float64]


class BatchForces:
    """Simulates the batches of a layout with effects.

    Not for two threads at once: it keeps the last simulation of each batch, so that the next one repeats
    only what changed.
    """

    def __init__(self, layout: Layout, effects: Effects, batches: Sequence[Batch]) -> None:
        self.layout, self.effects, self.batches = layout, effects, batches
        self._traces: list[Trace | None] = [None] * len(batches)
        self._kept = effects_fit.Kept()

    def at(self, theta: Array) -> list[Array]:
        """Force in N of each batch, every sample."""
        if not self.effects.size:
            tables = self.layout.unpack(theta[: self.layout.size])

            def plain(k: int) -> Array:
                batch = self.batches[k]
                return batch.as_stored(base.force(batch.inputs, tables))

            return in_parallel(plain, range(len(self.batches)))
        traces = self.traced(theta)
        return [b.as_stored(t.force_n) for b, t in zip(self.batches, traces, strict=True)]

    def traced(self, theta: Array) -> list[Trace]:
        """What happens in each batch on the way to its force."""
        settings = self.effects.settings(theta[self.layout.size :])
        dampers = self.dampers(theta)

        def one(k: int) -> Trace:
            self._traces[k] = trace = dampers.traced(self.batches[k].run, settings, self._traces[k])
            return trace

        return in_parallel(one, range(len(self.batches)))

    def dampers(self, theta: Array) -> Dampers:
        """The bare dampers at theta, for `linear`: those of all batches share what is dear."""
        return Dampers(self.layout, self.layout.unpack(theta[: self.layout.size]), self._kept)

    def linear(
        self, theta: Array, number: int, dampers: Dampers, moves: NDArray[np.bool_] | None = None
    ) -> tuple[Array, base.Rows]:
        """A batch's residual (blocks) and the force's slopes (m, blocks); moves: as `linearise` has it."""
        batch = self.batches[number]
        if self.effects.size:
            trace, rows = slopes.linearise(
                batch.run,
                dampers,
                self.effects,
                theta[self.layout.size :],
                batch.factor,
                self._traces[number],
                picked=batch.picked,
                moves=moves,
            )
            self._traces[number] = trace
            force = trace.force_n
        else:
            force, rows = base.linearise(
                batch.inputs, self.layout, dampers.tables, batch.factor, picked=batch.picked
            )
        rest = batch.weighed(batch.force_n - batch.as_stored(force))
        return rest, replace(rows, values=batch.as_stored(rows.values, batch.factor))
