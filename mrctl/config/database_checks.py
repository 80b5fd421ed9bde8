"""A configuration against the DBC: frames, signals, rates, time-outs, bus load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mrctl.can.busload import BusLoad, FrameRate, bus_load
from mrctl.can.database import load_database
from mrctl.can.dbc_file import DbcFile
from mrctl.can.frames import FRAMES_OUT, OPTIONAL_FRAMES_OUT, signals_of
from mrctl.can.specs import FrameSpec, SignalSpec
from mrctl.config.checks import nearest
from mrctl.config.models import ConfigFile
from mrctl.errors import InputError
from mrctl.yaml_source import Findings

COMMAND_FRAME = "CurrentCommand"
# Of the frames that go out: Hz where the configuration does not say, at most the loop's rate.
_SEND_HZ = {
    "CurrentCommand": 1e9,
    "ControllerState": 50.0,
    "Health": 10.0,
    "HealthTiming": 1.0,
    "HealthRejects": 1.0,
}


def suffix_of(command: str) -> str:
    """What a damper's state signals end in: as its command, Cur_FL, so State_FL."""
    return command.partition("_")[2]


@dataclass(slots=True)
class BusFrames:
    """What is known of the frames once the DBC is read."""

    receive: dict[str, float] = field(default_factory=dict)
    send: dict[str, float] = field(default_factory=dict)
    specs: Mapping[str, FrameSpec] = field(default_factory=dict)
    load: BusLoad | None = None

    @classmethod
    def none(cls) -> BusFrames:
        """Nothing known."""
        return cls()

    def command(self, name: str) -> SignalSpec | None:
        """The command signal of that name, None where it is not known."""
        spec = self.specs.get(COMMAND_FRAME)
        return next((s for s in spec.signals if s.name == name), None) if spec else None


def check_database(file: ConfigFile, path: Path | None, findings: Findings) -> BusFrames:
    """What the configuration needs of the DBC, with all that does not go together added to the findings."""
    frames = BusFrames(send=_send_rates(file))
    if path is None:
        return frames
    before = len(findings.problems)
    try:
        messages = DbcFile.read(path).messages()
    except InputError as error:
        findings.problems += error.problems
        return frames
    for name in OPTIONAL_FRAMES_OUT:
        if name not in messages and name not in file.frames.send:
            del frames.send[name]
    home = {signal.name: name for name, message in messages.items() for signal in message.signals}
    frames.receive = _receive_rates(file, messages, home)
    received = _received(file, messages, home, frames, findings)
    required = {
        frame: list(dict.fromkeys(signals))
        for frame, signals in (received | _sent(file, messages, findings)).items()
    }
    if len(findings.problems) == before:
        try:
            frames.specs = load_database(path, required)
        except InputError as error:
            findings.problems += error.problems
    _check_timeouts(file, home, frames, findings)
    frames.load = _load(file, messages, frames)
    if frames.load.total > file.bus.load_limit:
        findings.add(
            ("frames",) if "frames" in findings.document.data else (),
            f"the bus would be loaded to {frames.load.total:.1%} at worst, "
            f"more than bus.load_limit ({file.bus.load_limit:.0%})",
            "lower rates in frames, raise the bit rate, or use CAN FD",
        )
    return frames


def _send_rates(file: ConfigFile) -> dict[str, float]:
    loop_hz = file.loop.rate_hz
    return {frame: file.frames.send.get(frame, min(_SEND_HZ[frame], loop_hz)) for frame in FRAMES_OUT}


def _receive_rates(
    file: ConfigFile, messages: Mapping[str, Any], home: Mapping[str, str]
) -> dict[str, float]:
    """The given rates; else, for each frame that a signal of ours is in, the DBC's cycle time."""
    if file.frames.receive is not None:
        return dict(file.frames.receive)
    rates: dict[str, float] = {}
    for damper in file.dampers.values():
        for signal in damper.signals.model_dump(exclude_none=True).values():
            if signal in home:
                cycle_ms = messages[home[signal]].cycle_time
                rates[home[signal]] = 1000.0 / cycle_ms if cycle_ms else file.loop.rate_hz
    return rates


def _received(
    file: ConfigFile,
    messages: Mapping[str, Any],
    home: Mapping[str, str],
    frames: BusFrames,
    findings: Findings,
) -> dict[str, list[str]]:
    """Input signals by frame; what the DBC lacks is a finding at the line that names it."""
    required: dict[str, list[str]] = {}
    for frame in frames.receive:
        if frame not in messages:
            findings.add(
                ("frames", "receive", frame), f"the DBC has no frame {frame}", nearest(frame, list(messages))
            )
    for name, damper in file.dampers.items():
        for role, signal in damper.signals.model_dump(exclude_none=True).items():
            path = ("dampers", name, "signals", role)
            if signal not in home:
                findings.add(path, f"the DBC has no signal {signal}", nearest(signal, list(home)))
            elif home[signal] not in frames.receive:
                what = f"{signal} comes in {home[signal]}, which is not in frames.receive"
                findings.add(path, what, f"add `{home[signal]}: RATE` there")
            else:
                required.setdefault(home[signal], []).append(signal)
    return required


def _sent(file: ConfigFile, messages: Mapping[str, Any], findings: Findings) -> dict[str, list[str]]:
    """Output signals by frame; what the DBC lacks is a finding at the line that names it."""
    required: dict[str, list[str]] = {}
    for frame in FRAMES_OUT:
        if frame not in messages:
            if frame in OPTIONAL_FRAMES_OUT and frame not in file.frames.send:
                continue
            findings.add((), f"the DBC has no frame {frame}", "add it to the DBC")
            continue
        there = [signal.name for signal in messages[frame].signals]
        if frame == COMMAND_FRAME:
            required[frame] = [damper.command for damper in file.dampers.values()]
            for name, damper in file.dampers.items():
                if damper.command not in there:
                    what = f"{frame} has no signal {damper.command}"
                    findings.add(("dampers", name, "command"), what, nearest(damper.command, there))
        else:
            suffixes = [suffix_of(damper.command) for damper in file.dampers.values()]
            required[frame] = list(signals_of(frame, suffixes))
            _check_state_signals(file, frame, there, findings)
    return required


def _check_state_signals(file: ConfigFile, frame: str, there: list[str], findings: Findings) -> None:
    """The state of each damper has its signals, which end as the damper's command does."""
    for name, damper in file.dampers.items():
        missing = [s for s in signals_of(frame, [suffix_of(damper.command)]) if s not in there]
        if missing:
            findings.add(
                ("dampers", name, "command"),
                f"{frame} has no signal {missing[0]}",
                f"it belongs to the command {damper.command}: add it to the DBC",
            )


def _check_timeouts(file: ConfigFile, home: Mapping[str, str], frames: BusFrames, findings: Findings) -> None:
    """A signal's time-out is not shorter than the period of the frame that brings it."""
    rules = file.signals.by_role()
    seen = set()
    for damper in file.dampers.values():
        for role, signal in damper.signals.model_dump(exclude_none=True).items():
            rate_hz = frames.receive.get(home.get(signal, ""))
            if role in seen or rate_hz is None or rules[role].timeout_ms >= 1000.0 / rate_hz:
                continue
            seen.add(role)
            findings.add(
                ("signals", role, "timeout_ms"),
                f"`signals.{role}.timeout_ms` ({rules[role].timeout_ms:g}) is shorter than the period of "
                f"{home[signal]} ({1000.0 / rate_hz:g} ms)",
                f"give it some periods, e.g. {5000.0 / rate_hz:g}",
            )


def _load(file: ConfigFile, messages: Mapping[str, Any], frames: BusFrames) -> BusLoad:
    """The worst-case load of the bus by the frames that are known."""
    rates = [
        FrameRate(name, messages[name].length, bool(messages[name].is_extended_frame), rate_hz)
        for name, rate_hz in {**frames.receive, **frames.send}.items()
        if name in messages and messages[name].length <= (64 if file.bus.fd else 8)
    ]
    return bus_load(rates, file.bus.bitrate, file.bus.data_bitrate if file.bus.fd else None)
