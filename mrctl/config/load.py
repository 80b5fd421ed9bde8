"""From a configuration file to a Config: everything held against everything, all faults at once."""

from __future__ import annotations

import os
from pathlib import Path
from types import MappingProxyType
from typing import Any

from mrctl.calibration import Calibration, load_calibration
from mrctl.can.busload import BusLoad
from mrctl.config.calibration_checks import check_calibrations
from mrctl.config.checks import check_bus, check_control, check_dampers, check_rates, check_signal_rules
from mrctl.config.config import Config, DamperConfig, FramesConfig
from mrctl.config.database_checks import BusFrames, check_database
from mrctl.config.models import SCHEMA, VERSION, ConfigFile
from mrctl.errors import InputError
from mrctl.share_path import share_file
from mrctl.yaml_source import Document, Findings, check_model, quiet_model, read_document, schema_version

DEFAULT_DATABASE = "dbc/mrctl.dbc"
# Stands in for dampers that could not be read, so that the rest can be judged.
_NO_DAMPERS = {"x": {"signals": {"relative_velocity": "x", "temperature": "x"}, "command": "x"}}


def load_config(path: Path | str) -> Config:
    """The configuration in a file; raises InputError with all that is wrong in it and the files it names."""
    return config_from_document(read_document(path))


def config_from_document(document: Document) -> Config:
    """The configuration in a document that was read; raises InputError like load_config."""
    findings = Findings(document)
    if not schema_version(document, "config", VERSION, findings):
        findings.raise_if_any()
    data = {**document.data, "schema": SCHEMA}
    whole = check_model(ConfigFile, data, findings)
    file, sound = (whole, set(ConfigFile.model_fields)) if whole else _what_is_sound(data)
    paths = _Paths(document, file)
    if "bus" in sound:
        check_bus(file, findings)
    if "signals" in sound:
        check_signal_rules(file, findings)
    if "dampers" in sound:
        check_dampers(file, findings)
    if sound >= {"control", "dampers"}:
        check_control(file, findings)
    if sound >= {"loop", "frames"}:
        check_rates(file, findings)
    frames = BusFrames.none()
    if sound >= {"database", "dampers", "frames", "loop", "bus", "signals"}:
        frames = check_database(file, paths.database(findings), findings)
    calibrations = paths.calibrations(findings) if sound >= {"calibration", "dampers"} else {}
    if sound >= {"loop", "control", "safety", "dampers", "body_velocity_from_acceleration"}:
        check_calibrations(file, calibrations, frames, findings)
    findings.raise_if_any()
    if whole is None:
        raise InputError.at(document.file, "the file does not have the shape of a configuration")
    return _config(document, whole, paths, calibrations, frames)


def _what_is_sound(data: dict[str, Any]) -> tuple[ConfigFile, set[str]]:
    """A file with the defaults in place of the blocks that are broken, and the names of the others."""
    sound = set()
    for name in ConfigFile.model_fields:
        trial = {"schema": SCHEMA, "dampers": _NO_DAMPERS}
        if name in data:
            trial[name] = data[name]
        if quiet_model(ConfigFile, trial) is not None and (name in data or name != "dampers"):
            sound.add(name)
    kept = {name: value for name, value in data.items() if name in sound}
    file = ConfigFile.model_validate({"dampers": _NO_DAMPERS, **kept, "schema": SCHEMA})
    return file, sound


def _missing(path: Path) -> str | None:
    """Why there is no file at a path, or None where there is one."""
    try:
        return None if path.is_file() else f"there is no file {path}"
    except OSError as error:  # a folder that may not be entered, a name too long
        return f"{path} cannot be reached ({error.strerror})"


class _Paths:
    """The files that a configuration names, relative to itself."""

    def __init__(self, document: Document, file: ConfigFile) -> None:
        self._folder = Path(document.file).parent
        self._file = file

    def of(self, relative: str) -> Path:
        return Path(os.path.normpath(self._folder / relative))

    def database(self, findings: Findings) -> Path | None:
        """The DBC's path; None where it is not there."""
        if self._file.database is None:
            return share_file(DEFAULT_DATABASE)
        path = self.of(self._file.database)
        missing = _missing(path)
        if missing is None:
            return path
        findings.add(("database",), missing, "give the DBC's path, relative to this file")
        return None

    def calibration(self, damper: str) -> Path:
        return self.of(self._file.dampers[damper].calibration or self._file.calibration)

    def calibrations(self, findings: Findings) -> dict[str, Calibration]:
        """The calibration of each damper; a file that several share is read once."""
        loaded: dict[Path, Calibration | None] = {}
        found = {}
        for damper, entry in self._file.dampers.items():
            path = self.calibration(damper)
            if path not in loaded:
                key = ("dampers", damper, "calibration") if entry.calibration else ("calibration",)
                loaded[path] = self._load(path, key, findings)
            calibration = loaded[path]
            if calibration is not None:
                found[damper] = calibration
        return found

    @staticmethod
    def _load(path: Path, key: tuple[str, ...], findings: Findings) -> Calibration | None:
        missing = _missing(path)
        if missing is not None:
            findings.add(key, missing, "give the calibration's path, relative to this file")
            return None
        try:
            return load_calibration(path)
        except InputError as error:
            findings.problems += error.problems
            return None


def _config(
    document: Document,
    file: ConfigFile,
    paths: _Paths,
    calibrations: dict[str, Calibration],
    frames: BusFrames,
) -> Config:
    database = share_file(DEFAULT_DATABASE) if file.database is None else paths.of(file.database)
    warnings = {warning: None for calibration in calibrations.values() for warning in calibration.warnings}
    return Config(
        path=Path(document.file),
        sha256=document.sha256,
        bus=file.bus,
        database=database,
        loop=file.loop,
        dampers=MappingProxyType(
            {
                name: DamperConfig(
                    signals=MappingProxyType(entry.signals.model_dump(exclude_none=True)),
                    command=entry.command,
                    calibration=paths.calibration(name),
                )
                for name, entry in file.dampers.items()
            }
        ),
        calibrations=MappingProxyType(calibrations),
        control=file.control,
        body_velocity_from_acceleration=file.body_velocity_from_acceleration,
        signals=MappingProxyType(file.signals.by_role()),
        safety=file.safety,
        frames=FramesConfig(MappingProxyType(frames.receive), MappingProxyType(frames.send)),
        realtime=file.realtime,
        log=file.log,
        plant=file.plant,
        bus_load=frames.load or BusLoad((), 0.0),
        warnings=tuple(warnings),
    )
