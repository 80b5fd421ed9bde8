"""The four-damper configuration as the test bed runs it: config/vehicle.yaml, but slow on the bus.

The guest has one CPU and forks in tenths of a second, so frames come at a tenth of the car's rates, and
time-outs are long enough for a process that has to wait for its turn. The loop turns at a fifth of its rate,
with a calibration whose filters let all pass, since its own need 500 Hz: on a machine that others use too,
the guest would have no time for anything else. One drive has both as they are in the car (test_drive.py);
ticks that the guest cannot make in time are skipped there, as they would be in the car.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import buslog
import yaml
from bed import CHECKOUT, CLOCK_STEP_S, Result

from mrctl.can.codec import make_encoder
from mrctl.config import load_config
from mrctl.judge.frames import read_dbc
from mrctl.judge.judge import Judge, Violation
from mrctl.judge.limits import limits_of_config
from mrctl.judge.logs import frames_of_log
from mrctl.runtime.build import input_signals

CONFIG: dict[str, Any] = yaml.safe_load((CHECKOUT / "config" / "vehicle.yaml").read_text(encoding="utf-8"))
OWN_CALIBRATION = (CHECKOUT / "config" / "calibration.yaml").read_text(encoding="utf-8")
CALIBRATION = re.sub(
    r"(?<=\n)((forward|inverse)_filter:\n  sample_rate: .*\n)(  .*\n)+",
    r"\1  numerator: [1.0]\n  denominator: [1.0]\n",
    OWN_CALIBRATION,
)
LOOP_HZ = 100
DAMPERS = tuple(CONFIG["dampers"])
CURRENT_MAX_A: float = yaml.safe_load(OWN_CALIBRATION)["limits"]["current_max"]["value"]
COMMAND_RATE_HZ = 50
SILENT_OFF_S = 3.0
# Between commands where the controller was held up, and until its current is safe when it goes on.
HELD_UP_S = 0.1
ON_ITS_WAY_S = 0.1
LIMP_CURRENT_A: float = CONFIG["safety"]["limp_current_a"]

# A pattern for a line of the log with all dampers in state ACTIVE.
ALL_ACTIVE = buslog.line_pattern(
    "ControllerState", **{f"State_{corner}": "ACTIVE" for corner in ("FL", "FR", "RL", "RR")}
)
SIGNALS: dict[str, Any] = CONFIG["signals"] | {
    "relative_velocity": CONFIG["signals"]["relative_velocity"] | {"timeout_ms": 1500, "limp_after_ms": 2000},
    "body_velocity": CONFIG["signals"]["body_velocity"] | {"timeout_ms": 1500},
    "temperature": CONFIG["signals"]["temperature"] | {"timeout_ms": 2000},
}
# As the daemon has it: a frame is stale once it has waited for longer than the shortest time-out.
STALE_AFTER_S: float = min(rules["timeout_ms"] for rules in SIGNALS.values()) / 1000.0
FRAMES: dict[str, Any] = {
    "send": {"CurrentCommand": COMMAND_RATE_HZ, "ControllerState": 20, "Health": 5},
    "receive": {"RelativeVelocity": 50, "BodyVelocity": 50, "CaseTemperature": 10},
}


def guest_files(
    signals: Mapping[str, Any] = SIGNALS, frames: Mapping[str, Any] = FRAMES, *, own_loop: bool = False
) -> dict[str, str]:
    """vehicle.yaml and the files it points at, side by side, as an installation under /etc/mrctl has them.

    own_loop: at the rate and with the calibration of config/, which takes most of the guest's CPU.
    """
    config = CONFIG | {
        "loop": CONFIG["loop"] if own_loop else CONFIG["loop"] | {"rate_hz": LOOP_HZ},
        "calibration": "calibration.yaml",
        "database": "mrctl.dbc",
        "bus": CONFIG["bus"] | {"interface": "socketcan", "channel": "vcan0"},
        "frames": dict(frames),
        "safety": CONFIG["safety"] | {"bus_silent_off_s": SILENT_OFF_S, "init_timeout_s": 10.0},
        "signals": dict(signals),
    }
    return {
        "vehicle.yaml": yaml.safe_dump(config, sort_keys=False),
        "calibration.yaml": OWN_CALIBRATION if own_loop else CALIBRATION,
        "mrctl.dbc": (CHECKOUT / "dbc" / "mrctl.dbc").read_text(encoding="utf-8"),
    }


def car_files() -> dict[str, str]:
    """A car that starts at once (car.py) and what it sends: whole turns of every motion and counter."""
    round_s, lines = 8, []
    swings = {"relative_velocity": (0.3, 11), "body_velocity": (0.2, 9), "temperature": (0.0, 0)}
    for spec, users in input_signals(load_config(CHECKOUT / "config" / "vehicle.yaml")):
        encode, rate_hz = make_encoder(spec), FRAMES["receive"][spec.name]
        assert round_s * rate_hz % 16 == 0
        swing, turns = swings[users[0][0][1]]
        for n in range(round_s * rate_hz):
            phase = 2.0 * math.pi * turns * n / (round_s * rate_hz)
            values = [swing * math.sin(phase + k) if turns else 50.0 + k for k in range(len(users))]
            lines.append((1000 * n // rate_hz, f"{spec.linux_id:X} {encode(values, n).hex()}"))
    frames = "".join(f"{ms} {frame}\n" for ms, frame in sorted(lines))
    program = Path(__file__).with_name("car.py").read_text(encoding="utf-8")
    return {"car.py": program, "frames.txt": f"{frames}{1000 * round_s}\n"}


def violations(result: Result) -> list[Violation]:
    """What the independent judge finds in a recording, but for what the guest's time does, which is not real.

    That is the cycle, and an input's time-out that was over when a controller that had been held up went on:
    its current is only then on its way.
    """
    bus = read_dbc(result.directory / "mrctl.dbc", "CurrentCommand")
    judge = Judge(bus, limits_of_config(result.directory / "vehicle.yaml", bus))
    found: list[Violation] = []
    ahead_s, last_s, command_s, went_on_s = 0.0, None, -math.inf, -math.inf
    for time_s, identifier, data, *_ in frames_of_log(result.directory / "bus.log"):
        if last_s is not None and abs(time_s - last_s) > CLOCK_STEP_S:
            ahead_s += time_s - last_s  # to the judge that would be an hour without any input
        last_s = time_s
        if identifier == bus.command.identifier:
            if time_s - ahead_s - command_s > HELD_UP_S:
                went_on_s = time_s - ahead_s
            command_s = time_s - ahead_s
        for violation in judge.see(time_s - ahead_s, identifier, data):
            late = violation.rule == "timeout" and violation.time_s - went_on_s < ON_ITS_WAY_S
            if violation.rule != "cycle" and not late:
                found.append(violation)
    assert judge.commands > 100
    return found
