"""A calibration with effects: the controller undoes them, and asks for the signals that they need."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType

import numpy as np
import pytest

from mrctl.can.codec import make_decoder, make_encoder
from mrctl.can.frames import CAUSE_CODE, State
from mrctl.config import load_config
from mrctl.control.base import Motion
from mrctl.demo.bench import tick_controller
from mrctl.errors import InputError
from mrctl.model.damper import EffectSetting
from mrctl.model.pipeline import ForwardPipeline
from mrctl.runtime.build import damper_needs, frame_specs, input_signals, plan_of
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file

SPRING = EffectSetting("gas_spring", {"preload_n": 80.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0})


def config_with(*effects):
    """The bench's damper under a passive law, with a stroke sensor as fast as the velocity's."""
    config = load_config(share_file("config/bench.yaml"))
    (name, calibration), *_ = config.calibrations.items()
    damper = dataclasses.replace(calibration.damper, effects=effects)
    frames = dataclasses.replace(
        config.frames, receive=MappingProxyType({**config.frames.receive, "Displacement": 500.0})
    )
    signals = {role: s for role, s in config.dampers[name].signals.items() if role != "force"}
    return dataclasses.replace(
        config,
        frames=frames,
        dampers=MappingProxyType({name: dataclasses.replace(config.dampers[name], signals=signals)}),
        calibrations=MappingProxyType({name: dataclasses.replace(calibration, damper=damper)}),
    )


def tracking_error_n(known, true):
    """RMS force error of the tick that knows `known` effects on a damper that has `true` ones."""
    dt = 0.002
    control = tick_controller(config_with(*known))
    damper = next(iter(config_with(*true).calibrations.values())).damper
    plant = ForwardPipeline(damper, dt)
    errors = []
    for k in range(3000):
        phase = 2.0 * np.pi * 1.5 * k * dt
        x, v = 0.03 * np.sin(phase), 0.03 * 2.0 * np.pi * 1.5 * np.cos(phase)
        wish, current = control(Motion(v, 0.0, 50.0, x))
        force = plant.step(v, current, 50.0, x)
        if k > 1000:
            errors.append(force - wish)
    return float(np.sqrt(np.mean(np.square(errors))))


def test_an_effect_that_the_calibration_knows_is_undone():
    ignorant = tracking_error_n((), (SPRING,))
    knowing = tracking_error_n((SPRING,), (SPRING,))
    assert knowing < 0.5 * ignorant


def test_a_damper_is_active_only_with_the_signals_that_its_effects_need():
    config = config_with(SPRING)
    name = next(iter(config.dampers))
    assert "displacement" in damper_needs(config, name)
    assert "displacement" not in damper_needs(config_with(), name)


def test_an_effect_whose_signal_the_car_lacks_is_refused():
    config = config_with(SPRING)
    ((name, damper),) = config.dampers.items()
    signals = {role: s for role, s in damper.signals.items() if role != "displacement"}
    dampers = MappingProxyType({name: dataclasses.replace(damper, signals=signals)})
    with pytest.raises(InputError, match="displacement"):
        plan_of(dataclasses.replace(config, dampers=dampers))


@pytest.mark.parametrize("effects", [(), (SPRING,)])
def test_the_configuration_runs(effects):
    wish, current = tick_controller(config_with(*effects))(Motion(0.1, 0.0, 50.0, 0.01))
    assert wish > 0.0
    assert current == 0.0  # the first tick: not yet ACTIVE


def test_a_damper_that_lacks_its_stroke_says_so_and_does_not_stop_the_tick():
    config = config_with(SPRING)
    tick = Tick(plan_of(config))
    encoders = {spec.name: (spec.linux_id, make_encoder(spec)) for spec, _ in input_signals(config)}
    states = make_decoder(frame_specs(config)["ControllerState"])
    state_id = frame_specs(config)["ControllerState"].linux_id
    said = None
    for n in range(1500):
        sent = [("RelativeVelocity", 0.1 * np.sin(n / 20), n)]
        if n % 50 == 0:
            sent.append(("CaseTemperature", 50.0, n // 50))
        frames = [(encoders[name][0], encoders[name][1]([v], count)) for name, v, count in sent]
        said = dict(tick.step(frames)).get(state_id, said)
    (corner,) = tick.corners
    assert corner.state is State.SUBSTITUTE
    assert tick.cause_of(corner) == "DISPLACEMENT_MISSING"
    assert states(said)[1] == CAUSE_CODE["RELATIVE_VELOCITY_MISSING"]  # the nearest that the bus has
