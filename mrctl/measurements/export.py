"""Writing a run as an interface CSV: whole or not at all, and exact when read again."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from mrctl.measurements.run import CHANNELS, KINEMATICS, FloatArray, Run
from mrctl.yaml_source.writer import write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def write_run_csv(run: Run, path: Path | str, extra_columns: Mapping[str, FloatArray] | None = None) -> None:
    """Write `run` and `extra_columns` (name: (n,) array); an extra of the same name as its own replaces it.

    What was measured is written, and velocity always; displacement and acceleration that were derived from a
    measured velocity are left to the reader, who derives the same. Floats have all digits that count, so
    reading gives exactly the same numbers. InputError where the path cannot be written.
    """
    columns: dict[str, FloatArray] = {}
    for channel in CHANNELS:
        values = getattr(run, channel.attribute)
        if values is None or bool(np.isnan(values).all()):
            continue
        if channel.attribute in _left_out(run):
            continue
        columns[channel.column] = values
    for name, values in (extra_columns or {}).items():
        array = np.asarray(values, dtype=np.float64)
        if array.shape != run.time_s.shape:
            raise ValueError(f"{name}: shape {array.shape}, the run has {len(run)} samples")
        columns[name] = array
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
    write_atomically(path, text.getvalue())


def _left_out(run: Run) -> set[str]:
    """Channels that a reader of the file derives again, to the same numbers."""
    return set() if "velocity_m_s" in run.derived else set(run.derived) & set(KINEMATICS)
