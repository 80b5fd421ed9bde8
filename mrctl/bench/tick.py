"""What a tick costs, against the peer (peer.py) on the same frames, tick by tick in turn."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable
from typing import Any

from mrctl.bench.peer import Peer, PerDamper, Vectorised
from mrctl.can.codec import make_encoder
from mrctl.can.quiet_import import can
from mrctl.config import Config
from mrctl.runtime.build import input_signals, plan_of
from mrctl.runtime.tick import Frame, Tick

WARM_UP_TICKS = 500
TEMPERATURE_EVERY = 50


PEERS: dict[str, type[Peer]] = {
    "python-can + cantools + numpy": PerDamper,
    "the same, vectorised": Vectorised,
}
QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}


def quantiles_us(times_ns: list[int]) -> dict[str, float]:
    """Median, 99th and 99.9th percentile in µs."""
    ordered = sorted(times_ns)
    last = len(ordered) - 1
    return {name: ordered[min(int(share * len(ordered)), last)] / 1e3 for name, share in QUANTILES.items()}


def measure(
    config: Config, ticks: int, advance: Callable[[], None] = lambda: None
) -> dict[str, dict[str, float]]:
    """Quantiles in µs of a tick of mrctl and of each peer, run in turn; `advance` is called after each turn.

    The bus itself is left out on all sides: frames are handed over as each side's bus gives them (raw bytes
    from a socket here, python-can messages there).
    """
    tick = Tick(plan_of(config))
    peers = [peer(config) for peer in PEERS.values()]
    source = _drive(config)
    times: list[list[int]] = [[] for _ in range(1 + len(peers))]
    clock = time.perf_counter_ns
    gc.collect()
    gc.disable()
    try:
        for n in range(WARM_UP_TICKS + ticks):
            frames = source(n)
            messages: list[Any] = [
                can.Message(arbitration_id=can_id, data=data, is_extended_id=False) for can_id, data in frames
            ]
            marks = [clock()]
            tick.step(frames)
            marks.append(clock())
            for peer in peers:
                peer.step(messages)
                marks.append(clock())
            tick.changes.clear()
            if n >= WARM_UP_TICKS:
                for of_one, start, end in zip(times, marks, marks[1:], strict=False):
                    of_one.append(end - start)
                advance()
    finally:
        gc.enable()
    return {name: quantiles_us(of_one) for name, of_one in zip(("mrctl", *PEERS), times, strict=True)}


def _drive(config: Config) -> Callable[[int], list[Frame]]:
    """Good frames for tick n: a car on a wavy road."""
    rate_hz = config.loop.rate_hz
    encoders = [(spec, users, make_encoder(spec)) for spec, users in input_signals(config)]

    def value(user: tuple[int, str], n: int) -> float:
        corner, role = user
        phase = 2.0 * math.pi * n / rate_hz + corner
        if role == "temperature":
            return 50.0
        return 0.2 * math.sin(1.3 * phase) if role == "body_velocity" else 0.3 * math.sin(2.1 * phase)

    def frames(n: int) -> list[Frame]:
        out = []
        for spec, users, encode in encoders:
            roles = {role for of_signal in users for _, role in of_signal}
            if "temperature" in roles and n % TEMPERATURE_EVERY:
                continue
            values = [value(of_signal[0], n) if of_signal else math.nan for of_signal in users]
            out.append(
                (spec.linux_id, encode(values, n // TEMPERATURE_EVERY if "temperature" in roles else n))
            )
        return out

    return frames
