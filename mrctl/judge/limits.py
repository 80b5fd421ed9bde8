"""What a command must keep to, from a configuration or from hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mrctl.judge.frames import Bus, UnusableError


@dataclass(frozen=True, slots=True)
class Limits:
    """The defaults are those of the controller's configuration; None: not judged."""

    cycle_s: float
    current_max_a: Mapping[str, float] = field(default_factory=dict)
    """By command signal; without an entry, the signal's range in the DBC."""
    slew_a_s: Mapping[str, float] = field(default_factory=dict)
    safe_after: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    """By command signal: the input signal that it may not be without, and for how long in s."""
    input_range: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By input signal: what the controller takes for plausible."""
    limp_a: float = 1.0
    off_after_s: float = 5.0
    """Without any input: no current."""
    ramp_s: float = 0.2
    late_cycles: float = 5.0
    """Two commands may be so many cycles apart; a power stage gives up at ten."""
    mean_tolerance: float = 0.1
    """The mean cycle over MEAN_OVER commands may be off by this share."""


def default_limits(bus: Bus) -> Limits:
    """Limits without a configuration: the command's range and cycle in the DBC, and no slew."""
    if bus.command.cycle_s is None:
        raise UnusableError(f"frame {bus.command.name} has no GenMsgCycleTime in the DBC; give --config")
    return Limits(bus.command.cycle_s)


def limits_of_config(path: Path, bus: Bus) -> Limits:
    """The limits in a configuration and the calibrations that it names. Raises UnusableError."""
    config = _yaml(path)
    limits = default_limits(bus)
    dampers = _mapping(config, "dampers", path)
    safety, signals = config.get("safety") or {}, config.get("signals") or {}
    rate_hz = ((config.get("frames") or {}).get("send") or {}).get(bus.command.name)
    velocity = signals.get("relative_velocity") or {}
    try:
        largest, slew, needed, ranges = {}, {}, {}, {}
        for damper in dampers.values():
            file = path.parent / str(
                damper.get("calibration") or config.get("calibration") or "calibration.yaml"
            )
            of_damper = _mapping(_yaml(file), "limits", file)
            command = str(damper["command"])
            largest[command] = _number(of_damper["current_max"])
            slew[command] = _number(of_damper["current_slew"])
            after_ms = velocity.get("limp_after_ms", 50)
            if after_ms is not None:
                needed[command] = (str(damper["signals"]["relative_velocity"]), float(after_ms) / 1000.0)
            for role, name in damper["signals"].items():
                rules = signals.get(role) or {}
                if "minimum" in rules and "maximum" in rules:
                    ranges[str(name)] = (float(rules["minimum"]), float(rules["maximum"]))
        return replace(
            limits,
            cycle_s=limits.cycle_s if rate_hz is None else 1.0 / float(rate_hz),
            current_max_a=largest,
            slew_a_s=slew,
            safe_after=needed,
            input_range=ranges,
            limp_a=float(safety.get("limp_current_a", limits.limp_a)),
            off_after_s=float(safety.get("bus_silent_off_s", limits.off_after_s)),
            ramp_s=float(safety.get("off_ramp_s", limits.ramp_s)),
        )
    except (KeyError, TypeError, ValueError, AttributeError, ZeroDivisionError) as error:
        what = f"is no configuration that limits can be taken from ({type(error).__name__}: {error})"
        raise UnusableError(f"{path}: {what}; `mrctl check` says more") from error


def _yaml(path: Path) -> dict[str, Any]:
    import yaml  # noqa: PLC0415  # only with --config

    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        why = " ".join(str(error).split())
        raise UnusableError(f"{path}: cannot be read ({why}); give a configuration of mrctl") from error
    if not isinstance(data, dict):
        raise UnusableError(f"{path}: is no configuration; give one of mrctl")
    return data


def _mapping(data: dict[str, Any], key: str, path: Path) -> dict[str, Any]:
    value = data.get(key)
    if not isinstance(value, dict):
        raise UnusableError(f"{path}: has no {key}; `mrctl check` says more")
    return value


def _number(value: Any) -> float:  # noqa: ANN401  # as YAML has it
    """A number, bare or as `{value: ..., unit: ...}`."""
    return float(value["value"] if isinstance(value, dict) else value)
