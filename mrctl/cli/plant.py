"""`mrctl plant`: the simulated vehicle on the bus."""

from __future__ import annotations

import argparse
import json
import signal
import time
from typing import Any

from pydantic import ValidationError

from mrctl.can.ports import Port, open_port
from mrctl.config import Config, PlantConfig, load_config
from mrctl.errors import InputError, Problem
from mrctl.plant.road import ROUGHNESS_M3
from mrctl.plant.vehicle import Vehicle
from mrctl.runtime.log import make_logger
from mrctl.runtime.loop import Loop
from mrctl.yaml_source.writer import write_atomically

# Option -> key of the configuration's block `plant`.
OVERRIDES = {"temperature": "temperature_c", "road": "road_class", "speed": "speed_m_s", "seed": "seed"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl plant`."""
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="configuration, YAML")
    parser.add_argument("--channel", help="CAN interface, instead of the configuration's")
    parser.add_argument("--duration", type=float, metavar="SECONDS", help="stop by itself after so long")
    parser.add_argument("--temperature", type=float, metavar="DEGC", help="of the dampers at the start")
    parser.add_argument("--road", choices=tuple(ROUGHNESS_M3), help="ISO 8608 class")
    parser.add_argument("--speed", type=float, metavar="M_S", help="of the car")
    parser.add_argument("--seed", type=int, help="of the random road and of the noise")
    parser.add_argument("--noise", action="store_true", help="sensors with noise, instead of perfect ones")
    parser.add_argument("--json", metavar="FILE", help="write a summary at the end; - is standard output")
    parser.epilog = """\
A quarter car for every damper of the configuration, on a rough road with a bump now and then. Sends the
sensor frames that the configuration receives and obeys the current commands, but for broken ones (CRC,
counter); 0.1 s without a good command and the coils get 0 A. SIGTERM or Ctrl-C ends it.

examples:
  mrctl plant -c config/vehicle.yaml
  mrctl plant -c config/vehicle.yaml --road D --temperature 85 --duration 30 --json plant.json
"""


def run(args: argparse.Namespace) -> int:
    """Drive until told to stop."""
    config = load_config(args.config).on_bus(args.channel)
    plant = _plant(config, args)
    vehicle = Vehicle(config, plant, noisy=args.noise)
    log = make_logger(config.log.level)
    bus = config.bus
    port = open_port(
        bus.interface, bus.channel, bus.bitrate, bus.fd, vehicle.wanted_ids, data_bitrate=bus.data_bitrate
    )
    try:
        loop = _drive(vehicle, port, log, args.duration)
    finally:
        port.close()
    result = vehicle.summary() | {
        "frames": port.counters.sent,
        "unsent": loop.unsent,
        "skipped": loop.skipped,
    }
    log.info("stopped", **{key: value for key, value in result.items() if key != "dampers"})
    if args.json == "-":
        print(json.dumps(result, indent=2))
    elif args.json:
        write_atomically(args.json, json.dumps(result, indent=2) + "\n")
    return 0


def _plant(config: Config, args: argparse.Namespace) -> PlantConfig:
    """The configuration's vehicle with the options put over it. Raises InputError for values out of range."""
    options = {key: getattr(args, option) for option, key in OVERRIDES.items()}
    given = {key: value for key, value in options.items() if value is not None}
    try:
        return PlantConfig.model_validate(config.plant.model_dump() | given)
    except ValidationError as error:
        option_of = {key: f"--{option}" for option, key in OVERRIDES.items()}
        raise InputError(
            Problem(option_of[str(e["loc"][0])], None, f"{e['input']!r} will not do", e["msg"].lower())
            for e in error.errors()
        ) from None


def _drive(vehicle: Vehicle, port: Port, log: Any, duration_s: float | None) -> Loop:  # noqa: ANN401  # structlog's logger
    """Run the vehicle on its own schedule until a signal, or for so long."""
    stop: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _frame: stop.append(number))
        for number in (signal.SIGTERM, signal.SIGINT)
    }

    def say_events(_ticks: int) -> None:
        for event in port.take_events():
            log.warning(event.kind, detail=event.detail)

    ticking: Any = vehicle  # the loop asks for no more than `step`
    loop = Loop(ticking, port, 1.0 / vehicle.period_s, after_tick=say_events)
    ends = None if duration_s is None else time.monotonic() + duration_s
    try:
        log.info("driving", rate_hz=round(1.0 / vehicle.period_s))
        loop.run(lambda: bool(stop) or (ends is not None and time.monotonic() >= ends))
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return loop
