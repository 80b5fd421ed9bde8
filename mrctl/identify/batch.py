"""Records of one rate end to end: a fit goes through many short runs as if they were few long ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import base
from mrctl.identify.layout import Layout
from mrctl.identify.records import Record
from mrctl.measurements.moving_means import smoothed
from mrctl.simulate import Run

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_BLOCKS = 10000  # weighed samples in a batch: what its slopes take stays within a few megabytes
FEWEST_BLOCKS = 1500  # that are worth a batch of their own


@dataclass(frozen=True, eq=False)
class Batch:
    """Several records, each filled up to whole blocks of `factor` samples with its last ones."""

    records: tuple[int, ...]  # their numbers
    sizes: tuple[int, ...]  # samples of each
    factor: int
    run: Run
    force_n: Array
    inputs: base.Inputs = field(repr=False)
    picked: bool = False  # only the first sample of a block was measured
    averaged: tuple[float, ...] = ()  # samples over which each record's force is a mean; none: as sampled

    @classmethod
    def of(cls, layout: Layout, numbers: Sequence[int], records: Sequence[Record], factor: int) -> Batch:
        """Records of one rate, measured at one rate."""
        run = Run.joined([_run(r, factor) for r in records])
        return cls(
            tuple(numbers),
            tuple(len(r) for r in records),
            factor,
            run,
            np.concatenate([_filled(r.force_n, factor) for r in records]),
            base.Inputs.of(
                layout, records[0].rate_hz, run.velocity_m_s, run.current_a, run.temperature_c, run.starts
            ),
            records[0].finer > 1,
            tuple(r.averaged_s * r.rate_hz for r in records) if any(r.averaged_s for r in records) else (),
        )

    def placed(self, records: Sequence[Record]) -> Batch:
        """The same, strokes and warmths being those of other versions of all the fit's records."""
        strokes = [_filled(records[k].displacement_m, self.factor) for k in self.records]
        warmer_k = np.array([records[k].warmer_k for k in self.records])
        return replace(self, run=replace(self.run, displacement_m=np.concatenate(strokes), warmer_k=warmer_k))

    @property
    def block_starts(self) -> Ints:
        """Where each record's blocks begin, and where the last one's end."""
        return self.run.starts // self.factor

    def as_stored(self, x: Array, factor: int = 1) -> Array:
        """Forces or their slopes (..., samples // factor), averaged as each record's force was."""
        if not self.averaged:
            return x
        parts = np.split(x, self.run.starts[1:-1] // factor, axis=-1)
        return np.concatenate(
            [smoothed(part, n / factor) for part, n in zip(parts, self.averaged, strict=True)], axis=-1
        )

    def weighed(self, x: Array) -> Array:
        """What is weighed of samples (..., n): one value a block."""
        return base.in_blocks(x, self.factor, picked=self.picked)

    def samples(self, x: Array) -> list[Array]:
        """Each record's part of an array over all samples."""
        return [x[a : a + n] for a, n in zip(self.run.starts, self.sizes, strict=False)]

    def blocks(self, x: Array) -> list[Array]:
        """Each record's part of an array (..., blocks), without a last block that it does not fill."""
        return [x[..., a : a + n // self.factor] for a, n in zip(self.block_starts, self.sizes, strict=False)]


def batches(layout: Layout, records: Sequence[Record], factor: Callable[[Record], int]) -> list[Batch]:
    """Records of the same rate together, in their order, in batches of about the same size."""
    found: list[Batch] = []
    for rates in dict.fromkeys((r.rate_hz, r.finer) for r in records):
        numbers = [k for k, r in enumerate(records) if (r.rate_hz, r.finer) == rates]
        by = factor(records[numbers[0]])
        ends = np.cumsum([len(records[k]) // by for k in numbers])
        # An even number, whatever the machine, so that two processors have as much to do.
        count = 2 * max(1, int(np.ceil(ends[-1] / (2 * MOST_BLOCKS)))) if ends[-1] > 2 * FEWEST_BLOCKS else 1
        group = np.minimum((ends - 1) * count // max(int(ends[-1]), 1), count - 1)
        for one in dict.fromkeys(group.tolist()):
            members = [k for k, g in zip(numbers, group, strict=True) if g == one]
            found.append(Batch.of(layout, members, [records[k] for k in members], by))
    return sorted(found, key=lambda batch: batch.records[0])


def _run(record: Record, factor: int) -> Run:
    return Run.of(
        1.0 / record.rate_hz,
        _filled(record.driven_m_s, factor),
        _filled(record.current_a, factor),
        _filled(record.temperature_c, factor),
        _filled(record.displacement_m, factor),
        _filled(record.acceleration_m_s2, factor),
        record.before_a,
        record.warmer_k,
    )


def _filled(x: Array, factor: int) -> Array:
    rest = -x.size % factor
    return np.concatenate([x, np.full(rest, x[-1])]) if rest else x
