"""From a path to runs: which files are measurements, in which order, and by which reader."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from mrctl.errors import InputError, Problem
from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.find import find_files
from mrctl.measurements.plain_csv import read_plain_csv
from mrctl.measurements.run import Campaign, Run

if TYPE_CHECKING:
    from pathlib import Path


def load_run(path: Path | str, **needs: bool) -> Run:
    """One file with one run; `needs` as in `load_campaign`.

    InputError as in `load_campaign`, and where the file holds several runs.
    """
    campaign = load_campaign(path, **needs)
    if len(campaign.runs) != 1:
        raise InputError.at(
            path, f"holds {len(campaign.runs)} runs where one is due", "name a file with a single run"
        )
    return campaign.runs[0]


def load_campaign(path: Path | str, *, need_force: bool = True, need_current: bool = True) -> Campaign:
    """All runs below a folder, or of one file, in the order of their paths.

    `need_force`, `need_current`: whether
    a run without that channel is an error (else it is NaN). InputError with the problems of all files at
    once; `Campaign.warnings` for what a person should know but that stops nothing.
    """
    found = find_files(path)
    runs: list[Run] = []
    problems: list[Problem] = []
    digest = hashlib.sha256()
    for file, name in found.files:
        try:
            data = _bytes(file)
            digest.update(f"{hashlib.sha256(data).hexdigest()}  {name}\n".encode())
            runs += [
                assemble(raw, need_force=need_force, need_current=need_current)
                for raw in _read(file, data, name)
            ]
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return Campaign(found.root, tuple(runs), digest.hexdigest(), tuple(found.warnings))


def _bytes(file: Path) -> bytes:
    """The file's content; InputError where it cannot be read."""
    try:
        return file.read_bytes()
    except OSError as error:
        raise InputError.at(
            file, f"cannot be read: {error.strerror or error}", "check its permissions"
        ) from None


def _read(file: Path, data: bytes, name: str) -> list[RawRun]:
    return [read_plain_csv(file, data, name)]
