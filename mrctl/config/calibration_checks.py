"""A configuration against its calibrations: loop rate, limits, resolution of the command."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from mrctl.calibration import Calibration
from mrctl.config.database_checks import BusFrames
from mrctl.config.models import ConfigFile
from mrctl.control.body_velocity import BodyVelocityEstimator
from mrctl.control.laws import make_law
from mrctl.control.maps import CURRENT_MAPS, make_current_map
from mrctl.control.parameters import parameter_faults
from mrctl.yaml_source import Findings


def check_calibrations(
    file: ConfigFile, calibrations: Mapping[str, Calibration], frames: BusFrames, findings: Findings
) -> None:
    """What the loop will do with each damper can be done, at its rate and within its limits."""
    dt_s = 1.0 / file.loop.rate_hz
    if any(damper.signals.body_acceleration for damper in file.dampers.values()):
        _attempt(
            lambda: BodyVelocityEstimator(file.body_velocity_from_acceleration.cutoff_hz, dt_s),
            ("body_velocity_from_acceleration", "cutoff_hz"),
            findings,
        )
    _attempt(
        lambda: make_law("passive", {"damping_n_s_m": file.safety.substitute_damping_n_s_m}),
        ("safety", "substitute_damping_n_s_m"),
        findings,
    )
    told: set[str] = set()  # calibrations that were already judged at this rate
    for name, calibration in calibrations.items():
        key = str(calibration.path)
        if key not in told:
            told.add(key)
            _check_rate(file, calibration, dt_s, findings)
            _check_limits(file, name, calibration, findings)
        _check_command(file, name, calibration, frames, dt_s, findings)


def _check_rate(file: ConfigFile, calibration: Calibration, dt_s: float, findings: Findings) -> None:
    """The current map with this calibration can run at the loop's rate."""
    control = file.control
    kind = CURRENT_MAPS.get(control.current_map)
    if kind is None or parameter_faults(kind.parameters, control.map_parameters):
        return
    cutoff_hz = calibration.damper.refine_cutoff_hz
    if cutoff_hz is not None and cutoff_hz > 0.4 * file.loop.rate_hz:
        findings.add(
            ("loop", "rate_hz"),
            f"the loop's {file.loop.rate_hz:g} Hz are too slow for the refine_cutoff of "
            f"{calibration.path}, {cutoff_hz:g} Hz",
            "raise loop.rate_hz, or lower refine_cutoff below 0.4 of it",
        )
        return
    _attempt(
        lambda: make_current_map(control.current_map, calibration.damper, dt_s, control.map_parameters),
        ("loop", "rate_hz"),
        findings,
        prefix=f"with {calibration.path}: ",
        mend="choose loop.rate_hz 500, 1000 or 2000",
    )


def _check_limits(file: ConfigFile, name: str, calibration: Calibration, findings: Findings) -> None:
    limp, largest = file.safety.limp_current_a, calibration.damper.current_max_a
    if limp > largest:
        findings.add(
            ("safety", "limp_current_a"),
            f"`safety.limp_current_a` ({limp:g} A) is beyond damper {name}'s largest current ({largest:g} A)",
            f"choose a medium current, e.g. {largest / 3.0:.2g}",
        )


def _check_command(
    file: ConfigFile,
    name: str,
    calibration: Calibration,
    frames: BusFrames,
    dt_s: float,
    findings: Findings,
) -> None:
    """The command signal can carry the largest current, and the current moves by more than its resolution."""
    damper = calibration.damper
    command = frames.command(file.dampers[name].command)
    if command is None:
        return
    path = ("dampers", name, "command")
    if command.maximum < damper.current_max_a:
        findings.add(
            path,
            f"{command.name} carries at most {command.maximum:g} A, "
            f"less than the largest current of {calibration.path}, {damper.current_max_a:g} A",
            "widen the signal in the DBC, or lower limits.current_max",
        )
    if damper.current_slew_a_s * dt_s < command.factor:
        findings.add(
            path,
            f"in one tick the current of damper {name} may change by {damper.current_slew_a_s * dt_s:.2g} A, "
            f"less than the resolution of {command.name}, {command.factor:g} A",
            "raise limits.current_slew or lower loop.rate_hz",
        )


def _attempt(
    make: Callable[[], object], path: tuple[str, ...], findings: Findings, prefix: str = "", mend: str = ""
) -> None:
    """Make something as the loop will; what it refuses is a finding."""
    try:
        make()
    except ValueError as error:
        what, _, own_mend = str(error).partition("; ")
        findings.add(path, prefix + what, own_mend or mend)
