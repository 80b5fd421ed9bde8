"""What the demonstration compares, and one run of it."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mrctl.config import Config, load_config
from mrctl.control.laws import make_law
from mrctl.demo.bench import one_corner, tick_controller
from mrctl.plant.closed_loop import Metrics, Record, constant_current, measured_corner, metrics, simulate
from mrctl.plant.quarter_car import QuarterCar
from mrctl.plant.road import Bump, IsoRoad, Sum
from mrctl.plant.virtual_damper import PhysicsParameters

TEMPERATURES_C = (25.0, 55.0, 85.0)
DURATION_S = 14.0
SETTLED_S = 3.0  # the controller has qualified its signals, the car has settled
BUMP_AT_S = 8.0
BUMP_LENGTH_M = 4.0
FIRM_A = 1.5


@dataclass(frozen=True, slots=True)
class Strategy:
    """One way to command the damper: a constant current, or the law through a current map."""

    label: str
    current_map: str | None = None
    constant_a: float = 0.0
    ideal_coil: bool = False  # the current follows its command at once


STRATEGIES = (
    Strategy("passive soft, 0 A"),
    Strategy(f"passive firm, {FIRM_A:g} A", constant_a=FIRM_A),
    Strategy("skyhook, linear map", "linear"),
    Strategy("skyhook, Reader", "reader"),
    Strategy("skyhook, Liu", "liu"),
    Strategy("skyhook, mrctl", "inverse"),
)
# Why is there an error left? The same again with a coil that does not lag.
IDEAL = (
    Strategy("skyhook, linear map", "linear", ideal_coil=True),
    Strategy("skyhook, mrctl", "inverse", ideal_coil=True),
)


@dataclass(frozen=True, slots=True)
class Result:
    """One run: what was run, how it went, and what happened."""

    strategy: Strategy
    temperature_c: float
    metrics: Metrics
    record: Record


def cases() -> list[tuple[Strategy, float]]:
    """All runs of the demonstration."""
    return [(strategy, T) for strategy in (*STRATEGIES, *IDEAL) for T in TEMPERATURES_C]


def run_case(config_path: Path, strategy: Strategy, temperature_c: float) -> Result:
    """One quarter car over the road of the configuration, with its damper at a temperature."""
    config = load_config(config_path)
    plant = config.plant
    road = Sum(
        IsoRoad(plant.road_class, plant.seed),
        Bump(BUMP_AT_S * plant.speed_m_s, BUMP_LENGTH_M, plant.bump_height_m),
    )
    lag_s = 0.0 if strategy.ideal_coil else plant.coil_lag_s
    damper = next(iter(config.calibrations.values())).damper
    corner = measured_corner(
        QuarterCar(road, plant.speed_m_s),
        damper,
        temperature_c,
        PhysicsParameters(coil_rise_s=lag_s, coil_fall_s=lag_s),
    )
    if strategy.current_map is None:
        control = constant_current(
            make_law(config.control.law, config.control.parameters), strategy.constant_a
        )
    else:
        control = tick_controller(one_corner(config, strategy.current_map, ideal_coil=strategy.ideal_coil))
    record = simulate(corner, control, DURATION_S, 1.0 / config.loop.rate_hz).after(SETTLED_S)
    return Result(strategy, temperature_c, metrics(record), record)


def run_all(config: Config, workers: int) -> Iterator[Result]:
    """All cases on `workers` processes, in the order in which they end."""
    # Ctrl-C reaches this process alone, which then ends the others.
    with multiprocessing.Pool(workers, signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
        yield from pool.imap_unordered(_run_words, [(config.path, *case) for case in cases()])


def _run_words(words: tuple[Path, Strategy, float]) -> Result:
    return run_case(*words)
