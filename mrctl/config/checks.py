"""What a configuration must fulfil in itself: bus, signals, control law, rates."""

from __future__ import annotations

from difflib import get_close_matches

from mrctl.can.frames import FRAMES_OUT
from mrctl.config.models import ConfigFile
from mrctl.control.laws import LAWS, make_law
from mrctl.control.maps import CURRENT_MAPS
from mrctl.control.parameters import parameter_faults
from mrctl.yaml_source import Findings


def nearest(name: str, known: list[str]) -> str:
    """The mend for a name that is not known."""
    close = get_close_matches(name, known, n=1)
    return f"did you mean `{close[0]}`?" if close else "there are: " + ", ".join(known)


def check_bus(file: ConfigFile, findings: Findings) -> None:
    """CAN FD has a data bit rate, at least the arbitration's; classic CAN has none."""
    bus = file.bus
    if bus.fd and bus.data_bitrate is None:
        findings.add(
            ("bus", "fd"), "`bus.fd` without `bus.data_bitrate`", "add it, e.g. data_bitrate: 2000000"
        )
    elif not bus.fd and bus.data_bitrate is not None:
        findings.add(
            ("bus", "data_bitrate"), "`bus.data_bitrate` without CAN FD", "set fd: true, or remove it"
        )
    elif bus.data_bitrate is not None and bus.data_bitrate < bus.bitrate:
        findings.add(
            ("bus", "data_bitrate"),
            f"`bus.data_bitrate` ({bus.data_bitrate}) is below `bus.bitrate` ({bus.bitrate})",
            "the data phase is at least as fast as the arbitration",
        )


def check_signal_rules(file: ConfigFile, findings: Findings) -> None:
    """Each role's range is one, and a signal is stood in for only once it is late."""
    for role, rules in file.signals.by_role().items():
        if rules.minimum >= rules.maximum:
            findings.add(
                ("signals", role, "minimum"),
                f"`signals.{role}`: minimum {rules.minimum:g} is not below maximum {rules.maximum:g}",
                "swap them",
            )
        if rules.limp_after_ms is not None and rules.limp_after_ms < rules.timeout_ms:
            findings.add(
                ("signals", role, "limp_after_ms"),
                f"`signals.{role}`: limp_after_ms {rules.limp_after_ms:g} is below timeout_ms "
                f"{rules.timeout_ms:g}",
                "it counts from the last good value too: make it larger",
            )


def check_dampers(file: ConfigFile, findings: Findings) -> None:
    """One source of body velocity a damper, one command for each."""
    commands: dict[str, str] = {}
    for name, damper in file.dampers.items():
        signals = damper.signals
        if signals.body_velocity and signals.body_acceleration:
            findings.add(
                ("dampers", name, "signals", "body_acceleration"),
                f"damper {name} has body_velocity and body_acceleration",
                "keep one: the acceleration is only integrated where there is no velocity",
            )
        if damper.command in commands:
            findings.add(
                ("dampers", name, "command"),
                f"dampers {commands[damper.command]} and {name} have the same command {damper.command}",
                "give each its own",
            )
        commands[damper.command] = name


def check_control(file: ConfigFile, findings: Findings) -> None:
    """Law and current map are known, their parameters sound, and each damper has what the law needs."""
    control = file.control
    law, current_map = LAWS.get(control.law), CURRENT_MAPS.get(control.current_map)
    if current_map is None:
        mend = nearest(control.current_map, list(CURRENT_MAPS))
        findings.add(("control", "current_map"), f"no current map {control.current_map!r}", mend)
    else:
        for fault in parameter_faults(current_map.parameters, control.map_parameters):
            findings.add(("control", "map_parameters", fault.name), fault.what, fault.mend)
    if law is None:
        findings.add(("control", "law"), f"no control law {control.law!r}", nearest(control.law, list(LAWS)))
        return
    faults = parameter_faults(law.parameters, control.parameters)
    for fault in faults:
        findings.add(("control", "parameters", fault.name), fault.what, fault.mend)
    if not faults:
        try:
            make_law(law.name, control.parameters)
        except ValueError as error:
            what, _, mend = str(error).partition("; ")
            findings.add(("control", "parameters"), what, mend)
    for name, damper in file.dampers.items():
        given = set(damper.signals.model_dump(exclude_none=True))
        if "body_acceleration" in given:
            given.add("body_velocity")
        for role in sorted(law.needs - given):
            instead = " or `body_acceleration`" if role == "body_velocity" else ""
            findings.add(
                ("dampers", name, "signals"),
                f"the law {law.name} needs {role} of damper {name}",
                f"add `{role}`{instead} to its signals, or choose another law",
            )


def check_rates(file: ConfigFile, findings: Findings) -> None:
    """The loop has time to sleep; frames go out at whole fractions of its rate, and come in no faster."""
    loop_hz = file.loop.rate_hz
    if file.realtime.poll_us > 0.5e6 / loop_hz:
        findings.add(
            ("realtime", "poll_us"),
            f"`realtime.poll_us` ({file.realtime.poll_us:g}) is more than half of the loop's period",
            f"at most {0.5e6 / loop_hz:g}, or the processor does nothing else",
        )
    for frame, rate_hz in file.frames.send.items():
        path = ("frames", "send", frame)
        if frame not in FRAMES_OUT:
            findings.add(path, f"mrctl sends no frame {frame}", nearest(frame, list(FRAMES_OUT)))
        elif rate_hz > loop_hz:
            findings.add(
                path, f"{frame} at {rate_hz:g} Hz is faster than the loop ({loop_hz:g} Hz)", "lower it"
            )
        elif abs(loop_hz / rate_hz - round(loop_hz / rate_hz)) > 1e-6:
            findings.add(
                path,
                f"{frame} at {rate_hz:g} Hz is no whole fraction of the loop's {loop_hz:g} Hz",
                f"e.g. {loop_hz / round(loop_hz / rate_hz):g}",
            )
    for frame, rate_hz in (file.frames.receive or {}).items():
        if rate_hz > loop_hz:
            findings.add(
                ("frames", "receive", frame),
                f"{frame} at {rate_hz:g} Hz comes faster than the loop turns ({loop_hz:g} Hz)",
                "let it be sent at the loop's rate, or raise loop.rate_hz",
            )
