"""MDF files (MF4 and older) through asammdf: channels by name."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from mrctl.errors import InputError, Problem
from mrctl.measurements.align import Sampled, align
from mrctl.measurements.assemble import RawRun
from mrctl.measurements.column_map import ColumnMap
from mrctl.measurements.convert import Conversion, unit_of_file
from mrctl.measurements.external import damage_is_input_error, library
from mrctl.measurements.mapped import finish
from mrctl.measurements.run import BY_ATTRIBUTE, CHANNELS


def read_mdf(path: Path, data: bytes, name: str, mapping: ColumnMap | None) -> RawRun:
    """The run in an MDF file: channels with the interface's names, or those of a map. InputError if not."""
    asammdf = library("asammdf", path, "MDF")
    broken = asammdf.blocks.utils.MdfException
    with damage_is_input_error(path, "MDF", broken), asammdf.MDF(io.BytesIO(data)) as file:
        wanted: dict[str, tuple[str, int | None]]
        if mapping is None:
            wanted = {c.attribute: (c.column, None) for c in CHANNELS if c.column in file.channels_db}
            wanted.pop("time_s", None)  # MDF has its own clock
        else:
            wanted = {name: (str(spec.column), spec.group) for name, spec in mapping.places.items()}
        if not wanted:
            mend = "say with --columns MAP.yaml which channel is which"
            raise InputError.at(path, "no channel has one of the interface's names", mend)
        signals = _get(path, file, wanted)
    sampled, notes = {}, []
    for attribute, signal in signals.items():
        unit = str(signal.unit or "")
        convert, foreign = _unit(mapping, attribute, unit)
        if foreign:
            notes.append(f"{BY_ATTRIBUTE[attribute].column} converted from {foreign}, the unit in the file")
        values = convert(np.asarray(signal.samples, dtype=np.float64))
        sampled[attribute] = Sampled(np.asarray(signal.timestamps, dtype=np.float64), values)
    channels, said = align(path, sampled)
    raw = RawRun(name, path, channels, notes=[*said, *notes])
    return finish(raw, mapping) if mapping is not None else raw


def _unit(mapping: ColumnMap | None, attribute: str, unit: str) -> tuple[Conversion, str | None]:
    """Conversion by the map or by the file's own unit."""
    if mapping is not None:
        return mapping.conversion(attribute, unit)
    return unit_of_file(Conversion(), unit, BY_ATTRIBUTE[attribute].unit)


def _get(path: Path, file: Any, wanted: dict[str, tuple[str, int | None]]) -> dict[str, Any]:  # noqa: ANN401 - untyped
    """The signals by attribute; InputError with all that are missing, ambiguous or no numbers."""
    problems: list[Problem] = []
    signals = {}
    for attribute, (channel, group) in wanted.items():
        places = file.channels_db.get(channel, ())
        groups = sorted({place[0] for place in places})
        if group is not None:
            places = [place for place in places if place[0] == group]
        if len({place[0] for place in places}) != 1:
            there = (
                f"it has {', '.join(sorted(file.channels_db)[:12])}" if not groups else f"it is in {groups}"
            )
            what = f"{'no' if not places else 'more than one'} channel {channel}"
            mend = f"{there}: correct the map" + (", add `group`" if groups else "")
            problems.append(Problem(str(path), None, what, mend))
            continue
        signal = file.get(channel, group=places[0][0], index=places[0][1])
        if np.asarray(signal.samples).dtype.kind not in "fiub" or np.asarray(signal.samples).ndim != 1:
            problems.append(
                Problem(str(path), None, f"channel {channel} holds no numbers", "correct the map")
            )
            continue
        signals[attribute] = signal
    if problems:
        raise InputError(problems)
    return signals
