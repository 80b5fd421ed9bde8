"""What a tick costs, against the peers (peer.py) on the same frames, in blocks of ticks in turn."""

from __future__ import annotations

import gc
import importlib
import math
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Any

from mrctl.bench.interpreted import Interpreted
from mrctl.bench.peer import Peer, PerDamper, Vectorised
from mrctl.bench.wire import INTERFACE, Wire, WireBus
from mrctl.can.codec import make_encoder
from mrctl.can.quiet_import import can
from mrctl.can.socketcan_port import SocketCanPort
from mrctl.config import Config
from mrctl.runtime.build import input_signals, plan_of
from mrctl.runtime.compiled import COMPILED
from mrctl.runtime.tick import Frame, Tick

BLOCK_TICKS = 100
WARM_UP_TICKS = 10
TEMPERATURE_EVERY = 50
OURS, INTERPRETED = "mrctl", "mrctl, interpreted"


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
    config: Config, ticks: int, advance: Callable[[float], None] = lambda _: None
) -> dict[str, dict[str, float]]:
    """Quantiles in µs of a tick of mrctl and of each peer, in blocks of ticks in turn.

    Each side takes the frames from a socket without a kernel behind it (wire.py), through its own driver code
    (mrctl's port; python-can's SocketCAN functions), does its work, and sends its command the same way. The
    first ticks of a block are not counted: they find the caches as the other side left them. `advance` is
    told how many ticks are done. In a compiled build the interpreter has a turn too, in a process of its own.
    """
    sides = {OURS: ours(config)} | {name: _theirs(peer(config)) for name, peer in PEERS.items()}
    source = drive(config)
    times: dict[str, list[int]] = {name: [] for name in (OURS, *([INTERPRETED] if COMPILED else []), *PEERS)}
    gc.collect()
    gc.disable()
    try:
        with Interpreted(config.path) if COMPILED else nullcontext() as interpreted:
            for first in range(0, ticks, BLOCK_TICKS):
                last = min(first + BLOCK_TICKS, ticks)
                block = [source(n) for n in range(first, last)]
                for name, (wire, step) in sides.items():
                    times[name] += times_ns(wire, step, block)
                if interpreted is not None:
                    times[INTERPRETED] += interpreted.block(first, last)
                advance(len(block))
    finally:
        gc.enable()
    return {name: quantiles_us(taken) for name, taken in times.items()}


def times_ns(wire: Wire, step: Callable[[], None], block: Sequence[Sequence[Frame]]) -> list[int]:
    """What each tick of a block took, but for the first ones."""
    clock, taken = time.perf_counter_ns, []
    for frames in block:
        for can_id, data in frames:
            wire.lay(can_id, data)
        start = clock()
        step()
        taken.append(clock() - start)
    return taken[WARM_UP_TICKS:]


def ours(config: Config) -> tuple[Wire, Callable[[], None]]:
    """A wire, and what runs a tick on it: receive, work, send."""
    tick, wire = Tick(plan_of(config)), Wire(stamped=False)
    port = SocketCanPort(WireBus(wire), INTERFACE, tick.wanted_ids)
    receive, send, step = port.receive, port.send, tick.step

    def run() -> None:
        for can_id, data in step(receive()):
            send(can_id, data)

    return wire, run


def _theirs(peer: Peer) -> tuple[Wire, Callable[[], None]]:
    wire = Wire(stamped=True)
    driver: Any = importlib.import_module("can.interfaces.socketcan.socketcan")
    capture, build = driver.capture_message, driver.build_can_frame

    def run() -> None:
        messages = []
        while True:
            try:
                messages.append(capture(wire, False))  # python-can's own signature
            except can.CanOperationError:
                break
        wire.send(build(peer.step(messages)))

    return wire, run


def drive(config: Config) -> Callable[[int], list[Frame]]:
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
