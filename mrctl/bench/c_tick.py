"""The same tick compiled in C (tick.c), for what the processor could do; held to the same commands."""

from __future__ import annotations

import math
import shutil
import struct
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mrctl.can.codec import make_encoder
from mrctl.config import Config
from mrctl.control.anticipation import SLOPE_TIME_S
from mrctl.control.laws import LAWS
from mrctl.control.parameters import resolve
from mrctl.errors import MrctlError
from mrctl.model.filters import butterworth_lowpass
from mrctl.model.inverse import AUTHORITY_SHAPE, AUTHORITY_TIME_S
from mrctl.model.static import on_weight
from mrctl.model.tables import interpolate
from mrctl.runtime.build import frame_specs, input_signals, plan_of
from mrctl.runtime.tick import Frame, Tick

TEMPERATURE_EVERY: Final = 50
SETTLED_AFTER: Final = 2000
"""Ticks after which two controllers that began differently must command the same."""
REPEATS: Final = 20
_FRAMES: Final = ("RelativeVelocity", "BodyVelocity", "CaseTemperature")
_ROLES: Final = ("relative_velocity", "body_velocity", "temperature")


@dataclass(frozen=True, slots=True)
class CTick:
    """Median cost of the Python tick's work and the C tick's in µs, and how far their commands differ."""

    python_us: float
    c_us: float
    difference_a: float


def measure(config: Config, ticks: int, advance: Callable[[float], None] = lambda _: None) -> CTick:
    """Cost of a tick without reception and sending. Raises MrctlError where there is no C compiler.

    config: four dampers with the continuous skyhook, the inverse map, no effects and one calibration.
    """
    program = compiler()
    _fits(config)
    ticks = max(ticks, 2 * SETTLED_AFTER)
    frames = _drive(config, ticks)
    tick = Tick(plan_of(config))
    command = frame_specs(config)["CurrentCommand"]
    times, commands = [], []
    for of_tick in frames:
        start = time.perf_counter_ns()
        out = tick.step(of_tick)
        times.append(time.perf_counter_ns() - start)
        commands.append(next(data for can_id, data in out if can_id == command.linux_id))
        advance(1)
    theirs, c_ns = _run_c(config, program, frames)
    unit = command.signals[0].factor
    difference = max(
        abs(a - b)
        for mine, other in zip(commands[SETTLED_AFTER:], theirs[SETTLED_AFTER:], strict=True)
        for a, b in zip(_currents(mine), _currents(other), strict=True)
    )
    return CTick(sorted(times)[len(times) // 2] / 1e3, c_ns / 1e3, difference * unit)


def compiler() -> str:
    """The C compiler's path. Raises MrctlError where there is none."""
    found = shutil.which("cc") or shutil.which("gcc")
    if found is None:
        raise MrctlError("there is no C compiler; apt-get install gcc libc6-dev")
    return found


def _fits(config: Config) -> None:
    control = config.control
    dampers = {id(calibration): calibration.damper for calibration in config.calibrations.values()}
    if (
        len(config.dampers) != 4
        or (control.law, control.current_map) != ("skyhook_continuous", "inverse")
        or len(dampers) != 1
        or any(damper.effects or damper.refine_cutoff_hz is None for damper in dampers.values())
    ):
        raise MrctlError("the C tick is that of config/vehicle.yaml; leave out -c")


def _drive(config: Config, ticks: int) -> list[list[Frame]]:
    """Good frames of a car on a wavy road, tick by tick, in the order of _FRAMES."""
    encoders = {spec.name: (spec, make_encoder(spec)) for spec, _ in input_signals(config)}
    out = []
    for n in range(ticks):
        t = n / config.loop.rate_hz
        values = {
            "RelativeVelocity": [0.3 * math.sin(13.0 * t + k) for k in range(4)],
            "BodyVelocity": [0.2 * math.sin(8.0 * t + 2 * k) for k in range(4)],
        }
        counter = n
        if n % TEMPERATURE_EVERY == 0:
            values["CaseTemperature"] = [50.0 + k + t / 10.0 for k in range(4)]
        out.append(
            [
                (spec.linux_id, encode(own, counter // TEMPERATURE_EVERY if name == _FRAMES[2] else counter))
                for name, own in values.items()
                for spec, encode in (encoders[name],)
            ]
        )
    return out


def _currents(data: bytes) -> list[int]:
    word = int.from_bytes(data, "little")
    return [word >> 12 + 13 * k & 0x1FFF for k in range(4)]


def _run_c(config: Config, cc: str, frames: Sequence[Sequence[Frame]]) -> tuple[list[bytes], float]:
    packed = b"".join(
        struct.pack("8s8s8sB", f[0][1], f[1][1], f[2][1] if len(f) > 2 else bytes(8), len(f) > 2)
        for f in frames
    )
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "tick"
        (Path(folder) / "tick_numbers.h").write_text(_numbers(config), encoding="utf-8")
        source = Path(__file__).with_name("tick.c")
        words = [cc, "-O2", "-ffp-contract=off", f"-I{folder}", str(source), "-lm", "-o", str(program)]
        built = subprocess.run(words, capture_output=True, text=True, check=False)  # noqa: S603  # its own source
        if built.returncode != 0:
            raise MrctlError(
                f"the C tick does not compile: {built.stderr.strip().splitlines()[0]}; report this"
            )
        done = subprocess.run(  # noqa: S603  # as above
            [str(program), str(len(frames)), str(REPEATS)], input=packed, capture_output=True, check=False
        )
    if done.returncode != 0 or len(done.stdout) != 8 * len(frames):
        raise MrctlError(f"the C tick ended with status {done.returncode}; report this")
    return [done.stdout[k : k + 8] for k in range(0, len(done.stdout), 8)], float(done.stderr)


def _numbers(config: Config) -> str:
    """The header with all numbers of calibration, configuration and DBC."""
    damper = next(iter(config.calibrations.values())).damper
    t, rate_hz, parameters = damper.static, config.loop.rate_hz, plan_of(config).corners[0]
    dt, top = 1.0 / rate_hz, damper.current_max_a
    levels = sorted({0.0, top, *(i for i in (*t.current_a, t.off_below_a, t.on_above_a) if 0.0 < i < top)})
    inverse, forward = damper.inverse_filter.resampled(rate_hz), damper.forward_filter.resampled(rate_hz)
    lowpass = butterworth_lowpass(damper.refine_cutoff_hz or rate_hz, rate_hz)
    specs = {spec.name: spec for spec, _ in input_signals(config)}
    command = frame_specs(config)["CurrentCommand"]
    known = LAWS[config.control.law].parameters
    given = resolve(config.control.law, known, config.control.parameters)
    law = {name: repr(float(v)) for name, v in given.items() if isinstance(v, int | float)}
    look_ahead = config.control.anticipation_ms / 1000.0
    rules = [config.signals[role] for role in _ROLES]
    lines = [
        f"#define DAMPERS {len(config.dampers)}",
        f"#define LEVELS {len(levels)}",
        f"#define G_COUNT {len(t.shape)}",
        f"#define T_COUNT {len(t.temperature_c)}",
        f"#define DT {dt!r}",
        f"#define CURRENT_MAX {top!r}",
        f"#define SLEW_STEP {damper.current_slew_a_s * dt!r}",
        f"#define UNIT {command.signals[0].factor!r}",
        f"#define RAW_MAX {math.floor(parameters.current_max_a / command.signals[0].factor + 1e-9)}",
        f"#define FADE {-dt / (AUTHORITY_TIME_S * AUTHORITY_SHAPE**2)!r}",
        f"#define NOMINAL_C {config.safety.nominal_temperature_c!r}",
        f"#define SKY {law['sky_n_s_m']}",
        f"#define LOW_DAMPING {law['minimum_n_s_m']}",
        f"#define HIGH_DAMPING {law['maximum_n_s_m']}",
        f"#define GAIN {look_ahead / dt!r}",
        f"#define SHARE {-math.expm1(-dt / SLOPE_TIME_S)!r}",
        _array("LEVEL_I", levels),
        _array("LEVEL_F", [interpolate(i, t.current_a, t.force_n) for i in levels]),
        _array("ON_WEIGHT", [on_weight(i, t.off_below_a, t.on_above_a) for i in levels]),
        _array("G_KNOTS", t.velocity_m_s),
        _array("G_SHAPE", t.shape),
        _array("T_KNOTS", t.temperature_c),
        _array("H_OFF", t.h_off),
        _array("H_ON", t.h_on),
        *(
            _array(f"{name}_{part}", getattr(own, part.lower()))
            for name, own in (("INVERSE", inverse), ("FORWARD", forward), ("LOWPASS", lowpass))
            for part in ("B", "A")
        ),
        _array("FACTORS", [specs[name].signals[0].factor for name in _FRAMES]),
        "static const double RULES[3][3] = {"
        + ", ".join(f"{{{r.minimum!r}, {r.maximum!r}, {r.rate_max!r}}}" for r in rules)
        + "};",
        "static const uint8_t DATA_IDS[3][16] = {"
        + ", ".join("{" + ", ".join(map(str, specs[name].data_ids)) + "}" for name in _FRAMES)
        + "};",
        "static const uint8_t COMMAND_IDS[16] = {" + ", ".join(map(str, command.data_ids)) + "};",
    ]
    return "\n".join(lines) + "\n"


def _array(name: str, values: Sequence[float]) -> str:
    return f"static const double {name}[{len(values)}] = {{{', '.join(repr(float(v)) for v in values)}}};"
