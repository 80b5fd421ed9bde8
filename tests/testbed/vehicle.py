"""The four-damper configuration as the test bed runs it: config/vehicle.yaml, but slow on the bus.

The guest has one CPU and forks in tenths of a second, so frames come at a tenth of the car's rates, and
time-outs are long enough for a process that has to wait for its turn. The loop keeps its rate, which the
calibration's filters need; ticks that the guest cannot make in time are skipped, as they would be in the car.
"""

from __future__ import annotations

from typing import Any

import buslog
import yaml
from bed import CHECKOUT

CONFIG: dict[str, Any] = yaml.safe_load((CHECKOUT / "config" / "vehicle.yaml").read_text(encoding="utf-8"))
CALIBRATION = (CHECKOUT / "config" / "calibration.yaml").read_text(encoding="utf-8")
DAMPERS = tuple(CONFIG["dampers"])
CURRENT_MAX_A: float = yaml.safe_load(CALIBRATION)["limits"]["current_max"]["value"]
COMMAND_RATE_HZ = 50
SILENT_OFF_S = 3.0
LIMP_CURRENT_A: float = CONFIG["safety"]["limp_current_a"]

# A pattern for a line of the log with all dampers in state ACTIVE.
ALL_ACTIVE = buslog.line_pattern(
    "ControllerState", **{f"State_{corner}": "ACTIVE" for corner in ("FL", "FR", "RL", "RR")}
)


def guest_files() -> dict[str, str]:
    """vehicle.yaml and the files it points at, side by side, as an installation under /etc/mrctl has them."""
    config = CONFIG | {
        "calibration": "calibration.yaml",
        "database": "mrctl.dbc",
        "bus": CONFIG["bus"] | {"interface": "socketcan", "channel": "vcan0"},
        "frames": {
            "send": {"CurrentCommand": COMMAND_RATE_HZ, "ControllerState": 20, "Health": 5},
            "receive": {"RelativeVelocity": 50, "BodyVelocity": 50, "CaseTemperature": 10},
        },
        "safety": CONFIG["safety"] | {"bus_silent_off_s": SILENT_OFF_S, "init_timeout_s": 10.0},
        "signals": CONFIG["signals"]
        | {
            "relative_velocity": CONFIG["signals"]["relative_velocity"]
            | {"timeout_ms": 1500, "limp_after_ms": 2000},
            "body_velocity": CONFIG["signals"]["body_velocity"] | {"timeout_ms": 1500},
            "temperature": CONFIG["signals"]["temperature"] | {"timeout_ms": 2000},
        },
    }
    return {
        "vehicle.yaml": yaml.safe_dump(config, sort_keys=False),
        "calibration.yaml": CALIBRATION,
        "mrctl.dbc": (CHECKOUT / "dbc" / "mrctl.dbc").read_text(encoding="utf-8"),
    }
