"""What the bus says of a controller: its frames, checked and decoded, and how often each comes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mrctl.can import e2e
from mrctl.can.codec import make_decoder
from mrctl.can.frames import (
    CAUSES,
    HEALTH_SIGNALS,
    OPTIONAL_FRAMES_OUT,
    REJECT_SIGNALS,
    STATE_SIGNALS,
    TIMING_SIGNALS,
    State,
)
from mrctl.can.specs import FrameSpec
from mrctl.config import Config
from mrctl.runtime.build import frame_specs, input_signals

ALIVE_PERIODS = 10.0
"""A controller whose last command is older than so many periods is taken for dead, as by a power stage."""
_SHOWN = (
    "relative_velocity",
    "body_velocity",
    "body_acceleration",
    "temperature",
    "displacement",
    "force_wish",
)


@dataclass(slots=True)
class FrameWatch:
    """One frame: its last good payload, and what was wrong with others."""

    spec: FrameSpec
    expected_hz: float
    decode: Callable[[bytes], tuple[float, ...]]
    data: bytes | None = None
    last_s: float = -math.inf
    count: int = 0
    bad: int = 0
    lost: int = 0
    counted_from: tuple[float, int] = (0.0, 0)  # for the rate: a time, and the count by then
    rate_hz: float = 0.0

    def take(self, data: bytes, now_s: float) -> None:
        """A payload that arrived."""
        if len(data) != self.spec.length or not e2e.check(data, self.spec.data_ids):
            self.bad += 1
            return
        if self.data is not None:
            step = e2e.counter_delta(e2e.counter_of(data), e2e.counter_of(self.data))
            self.lost += max(step - 1, 0)
        self.data, self.last_s = data, now_s
        self.count += 1

    def measure_rate(self, now_s: float) -> None:
        """Work the rate out over what came since the last call."""
        since_s, count = self.counted_from
        if now_s > since_s:
            self.rate_hz = (self.count - count) / (now_s - since_s)
        self.counted_from = now_s, self.count

    def values(self) -> dict[str, float]:
        """The signals by name; empty before the first good frame."""
        if self.data is None:
            return {}
        names = (signal.name for signal in self.spec.signals)
        return dict(zip(names, self.decode(self.data), strict=True))


@dataclass(slots=True)
class Watch:
    """All that is known of a controller and its car."""

    config: Config
    frames: dict[int, FrameWatch] = field(default_factory=dict)
    started_s: float = 0.0

    @classmethod
    def of(cls, config: Config, now_s: float) -> Watch:
        """A watch on the frames that the configuration names. Raises InputError as the daemon does."""
        watch = cls(config, started_s=now_s)
        rates = {**config.frames.receive, **config.frames.send}
        specs = [spec for spec, _ in input_signals(config)] + list(frame_specs(config).values())
        for spec in specs:
            frame = FrameWatch(spec, rates[spec.name], make_decoder(spec), counted_from=(now_s, 0))
            watch.frames[spec.linux_id] = frame
        return watch

    def take(self, frames: list[tuple[int, bytes]], now_s: float) -> None:
        """Frames that arrived."""
        for can_id, data in frames:
            frame = self.frames.get(can_id)
            if frame is not None:
                frame.take(data, now_s)

    def measure_rates(self, now_s: float) -> None:
        """Work the rates of all frames out since the last call."""
        for frame in self.frames.values():
            frame.measure_rate(now_s)

    def snapshot(self, now_s: float) -> dict[str, Any]:
        """All of it as plain data, for the screen and for JSON. What is not known is None."""
        by_name = {frame.spec.name: frame for frame in self.frames.values()}
        command = by_name["CurrentCommand"]
        age_s = now_s - command.last_s
        health = _numbers(by_name, "Health", HEALTH_SIGNALS)
        timing = _numbers(by_name, "HealthTiming", TIMING_SIGNALS)
        return {
            "channel": self.config.bus.channel,
            "alive": age_s <= ALIVE_PERIODS / command.expected_hz + 0.1,  # the view itself looks now and then
            "command_age_s": age_s if math.isfinite(age_s) else None,
            "uptime_s": health["Uptime"],
            "dampers": self._dampers(by_name),
            "lateness_us": {
                "p50": health["LatenessP50"],
                "p99": health["LatenessP99"],
                "p99.9": timing["LatenessP999"],
                "max": health["LatenessMax"],
            },
            "duration_us": {
                "p50": timing["DurationP50"],
                "p99": timing["DurationP99"],
                "max": timing["DurationMax"],
            },
            "skipped_periods": health["Overruns"],
            "long_ticks": timing["LongTicks"],
            "rejected": health["Rejected"],
            "rejected_by_reason": _numbers(by_name, OPTIONAL_FRAMES_OUT[1], REJECT_SIGNALS),
            "frames": {
                frame.spec.name: {
                    "id": f"{frame.spec.can_id:0{8 if frame.spec.extended else 3}X}",
                    "rate_hz": frame.rate_hz,
                    "expected_hz": frame.expected_hz,
                    "age_s": now_s - frame.last_s if frame.data else None,
                    "bad": frame.bad,
                    "lost": frame.lost,
                }
                for frame in self.frames.values()
            },
        }

    def _dampers(self, by_name: dict[str, FrameWatch]) -> dict[str, dict[str, Any]]:
        signals: dict[str, float] = {}
        for frame in by_name.values():
            signals |= frame.values()
        out = {}
        for name, damper in self.config.dampers.items():
            suffix = damper.command.partition("_")[2]
            state, cause, *flags = (signals.get(f"{word}_{suffix}") for word in STATE_SIGNALS)
            out[name] = {
                "state": _name(state, [s.name for s in State]),
                "cause": _name(cause, CAUSES),
                "current_a": _number(signals.get(damper.command)),
                "flags": [word.lower() for word, flag in zip(STATE_SIGNALS[2:], flags, strict=True) if flag],
                **{
                    role: _number(signals.get(damper.signals[role]))
                    for role in _SHOWN
                    if role in damper.signals
                },
            }
        return out


def _number(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else value


def _name(value: float | None, names: list[str] | tuple[str, ...]) -> str | None:
    return None if value is None else names[int(value)] if value < len(names) else f"{value:g}"


def _numbers(by_name: dict[str, FrameWatch], frame: str, signals: tuple[str, ...]) -> dict[str, float | None]:
    values = by_name[frame].values() if frame in by_name else {}
    return {signal: _number(values.get(signal)) for signal in signals}
