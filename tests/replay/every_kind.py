"""What leaves under every law, current map and effect, as a digest of its bytes.

    python tests/replay/every_kind.py --ticks 3000

For holding one build, or one Python, against another: equal lines are equal bytes. Each line is a run of the
live loop with faults and skipped ticks; the last is the replay of a recording, written as a log.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import random
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import MappingProxyType

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))  # behind the package that is to be looked at

from replay.recording import candump, live, write  # noqa: E402  # once the path is set

from mrctl.config import Config, load_config  # noqa: E402  # as above
from mrctl.control.laws import LAWS  # noqa: E402  # as above
from mrctl.control.maps import CURRENT_MAPS  # noqa: E402  # as above
from mrctl.model.damper import EffectSetting  # noqa: E402  # as above
from mrctl.model.effects.registry import effects  # noqa: E402  # as above
from mrctl.replay.run import replay  # noqa: E402  # as above
from mrctl.runtime.compiled import COMPILED  # noqa: E402  # as above
from mrctl.share_path import share_file  # noqa: E402  # as above


def kinds() -> Iterator[tuple[str, Config]]:
    """Configurations that together use every law, map and effect."""
    car, bench = (load_config(share_file(f"config/{name}.yaml")) for name in ("vehicle", "bench"))
    yield "car", car
    for law in LAWS:
        if law != "external":
            yield law, with_control(car, law=law, parameters={})
    for current_map in CURRENT_MAPS:
        yield f"map {current_map}", with_control(car, current_map=current_map, map_parameters={})
    estimated = {
        name: dataclasses.replace(
            damper,
            signals={role: signal for role, signal in damper.signals.items() if role != "body_velocity"}
            | {"body_acceleration": damper.signals["body_velocity"].replace("BodyVel", "BodyAcc")},
        )
        for name, damper in car.dampers.items()
    }
    yield "estimated", receiving(car, {"BodyAcceleration": 500.0}, estimated)
    (name, of_bench), *_ = bench.dampers.items()
    signals = {role: signal for role, signal in of_bench.signals.items() if role != "force"}
    moving = {name: dataclasses.replace(of_bench, signals=signals)}
    bench = receiving(bench, {"Displacement": 500.0}, moving)
    for effect in effects().values():
        settings = dict(zip([p.name for p in effect.parameters], effect.typical, strict=True))
        calibration = bench.calibrations[name]
        damper = dataclasses.replace(calibration.damper, effects=(EffectSetting(effect.name, settings),))
        known = {name: dataclasses.replace(calibration, damper=damper)}
        yield effect.name, dataclasses.replace(bench, calibrations=MappingProxyType(known))


def with_control(config: Config, **update: object) -> Config:
    return dataclasses.replace(config, control=config.control.model_copy(update=update))


def receiving(config: Config, more: dict[str, float], dampers: dict) -> Config:
    frames = dataclasses.replace(config.frames, receive=MappingProxyType({**config.frames.receive, **more}))
    return dataclasses.replace(config, frames=frames, dampers=MappingProxyType(dampers))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ticks", type=int, default=3000)
    ticks = parser.parse_args().ticks
    print(f"Python {sys.version.split()[0]}, {'compiled' if COMPILED else 'interpreted'}", file=sys.stderr)
    for name, config in kinds():
        rng = random.Random(7)

        def oversleep(rng=rng):
            return rng.randrange(2_000_000, 30_000_000) if rng.random() < 0.003 else 0

        rows, _, _ = live(ticks, config=config, faults=True, oversleep=oversleep)
        digest = hashlib.sha256("\n".join(candump(rows)).encode())
        print(f"{name}: {len(rows)} frames, {digest.hexdigest()}")
    config = load_config(share_file("config/vehicle.yaml"))
    rows, _, _ = live(4 * ticks, config=config, faults=True, seed=3)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "again.log")
        figures = replay(write(Path(folder, "bus.log"), candump(rows)), config, out=out).figures
        digest = hashlib.sha256(out.read_bytes())
    print(f"replay: {figures['ticks']} ticks, {figures['differences']} differences, {digest.hexdigest()}")


if __name__ == "__main__":
    main()
