"""From a path to runs: which files are measurements, in which order, and by which reader."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.averaging import believed
from mrctl.measurements.column_map import ColumnMap, read_map
from mrctl.measurements.find import find_files, format_of
from mrctl.measurements.mapped import read_mapped_text
from mrctl.measurements.plain_csv import read_plain_csv
from mrctl.measurements.run import Campaign, Run
from mrctl.measurements.smoothed_velocity import less_smoothed
from mrctl.printable import printable

if TYPE_CHECKING:
    from pathlib import Path


def load_run(
    path: Path | str,
    columns: Path | str | None = None,
    *,
    need_force: bool = True,
    need_current: bool = True,
) -> Run:
    """One file with one run; arguments as in `load_campaign`.

    InputError as in `load_campaign`, and where the file holds several runs.
    """
    campaign = load_campaign(path, columns, need_force=need_force, need_current=need_current)
    if len(campaign.runs) != 1:
        raise InputError.at(
            path, f"holds {len(campaign.runs)} runs where one is due", "name a file with a single run"
        )
    return campaign.runs[0]


def load_campaign(
    path: Path | str,
    columns: Path | str | None = None,
    *,
    need_force: bool = True,
    need_current: bool = True,
) -> Campaign:
    """All runs below a folder, or of one file, in the order of their paths.

    A run's name is its file's, made printable. `columns`: a map for foreign files, see `column_map`.
    `need_force`, `need_current`: whether a run without that channel is an error; else it is NaN. InputError
    with the problems of all files at once; `Campaign.warnings` is what stops nothing, but should be known.
    """
    mapping = read_map(columns) if columns is not None else None
    found = find_files(path, mapping.patterns if mapping is not None else ())
    runs: list[Run] = []
    problems: list[Problem] = []
    digest = hashlib.sha256()
    for file, name in found.files:
        try:
            data = _bytes(file)
            digest.update(f"{hashlib.sha256(data).hexdigest()}  {name}\n".encode(errors="surrogateescape"))
            runs += [
                assemble(raw, need_force=need_force, need_current=need_current)
                for raw in _read(file, data, printable(name), mapping)
            ]
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return Campaign(
        found.root, tuple(less_smoothed(believed(runs))), digest.hexdigest(), tuple(found.warnings)
    )


def _bytes(file: Path) -> bytes:
    """The file's content; InputError where it cannot be read."""
    try:
        return file.read_bytes()
    except FileNotFoundError:
        if not file.is_symlink():
            raise InputError.at(file, "is gone", "do not change the campaign while it is read") from None
        raise InputError.at(file, "is a link to nothing", "mend the link, or remove it") from None
    except OSError as error:
        raise InputError.at(
            file, f"cannot be read: {error.strerror or error}", "check its permissions"
        ) from None


def _read(file: Path, data: bytes, name: str, mapping: ColumnMap | None) -> list[RawRun]:
    """The runs of one file, by the reader for its format."""
    kind = format_of(file, mapping.model if mapping is not None else None)
    if kind == "mat":
        from mrctl.measurements.mat import read_mat  # noqa: PLC0415 - its libraries are heavy: only for such files

        return [read_mat(file, data, name, mapping)]
    if kind == "mdf":
        from mrctl.measurements.mdf import read_mdf  # noqa: PLC0415 - as above

        return [read_mdf(file, data, name, mapping)]
    if kind == "can":
        if mapping is None:
            mend = "say with --columns MAP.yaml which signals of which DBC it is (`dbc`, `signals`)"
            raise InputError.at(file, "a CAN log holds frames, no channels", mend)
        from mrctl.measurements.can_log import read_can_log  # noqa: PLC0415 - as above

        return read_can_log(file, data, name, mapping)
    if mapping is not None:
        return read_mapped_text(file, data, name, mapping)
    return [read_plain_csv(file, data, name)]
