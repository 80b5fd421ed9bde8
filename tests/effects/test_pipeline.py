"""The pipelines: without effects the plain models to the last bit, with them in range whatever comes."""

from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest
from conftest import DT_S, make_damper, make_drive, with_effects
from contract import by_sample, force, samples
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.model.effects.base import EffectError
from mrctl.model.effects.registry import effects
from mrctl.model.forward import ForwardModel
from mrctl.model.inverse import InverseModel
from mrctl.model.pipeline import ForwardPipeline, InversePipeline
from mrctl.model.running import Running

MOTION = st.lists(
    st.tuples(st.floats(-2.0, 2.0), st.floats(0.0, 3.0), st.floats(0.0, 110.0), st.floats(-3e3, 3e3)),
    min_size=1,
    max_size=60,
)
ALL = {name: effect.mapping(effect.typical) for name, effect in effects().items()}


@settings(max_examples=60)
@given(MOTION)
def test_without_effects_the_forward_pipeline_is_the_forward_model(motion):
    plain, ours = ForwardModel(make_damper(), DT_S), ForwardPipeline(make_damper(), DT_S)
    for v, i, temperature, _ in motion:
        assert ours.step(v, i, temperature) == plain.step(v, i, temperature)


@settings(max_examples=60)
@given(MOTION)
def test_without_effects_the_inverse_pipeline_is_the_inverse_model(motion):
    plain, ours = InverseModel(make_damper(), DT_S), InversePipeline(make_damper(), DT_S)
    for v, _, temperature, wish in motion:
        assert ours.step(wish, v, temperature) == plain.step(wish, v, temperature)
        assert ours.reach == plain.reach
    plain.reset(100.0, 1.0)
    ours.reset(100.0, 1.0)
    assert ours.step(50.0, 0.1, 40.0) == plain.step(50.0, 0.1, 40.0)


@pytest.mark.parametrize("dt_s", [0.001, 0.002])
def test_a_wish_that_steps_is_reached_by_a_held_command_without_overshoot(dt_s):
    """The coil is solved as a differential equation, its command held as a driver holds it."""
    lag = Running(effects()["current_lag"], (0.008, 0.02, 0.3))
    field = 0.2
    lag.state(field, dt_s)
    reached = []
    for wanted in [0.2] * 3 + [1.0] * 20 + [0.4] * 60:
        command = lag.input_for(wanted, field, dt_s)
        tau = (0.008 if command > field else 0.02) / (1.0 + 0.3 * field)
        field = command + (field - command) * np.exp(-dt_s / tau)
        assert lag.next_held(command, dt_s) == pytest.approx(field, rel=1e-9)
        reached.append(field)
    assert max(reached) <= 1.0 + 1e-9
    assert reached[22] == pytest.approx(1.0, abs=1e-6)
    assert min(reached[23:]) >= 0.4 - 1e-9
    assert reached[-1] == pytest.approx(0.4, abs=1e-6)


@settings(max_examples=60)
@given(MOTION)
def test_neutral_effects_leave_the_inverse_as_it_is(motion):
    neutral = {name: effects()[name].mapping(effects()[name].neutral) for name in ALL}
    plain, ours = (
        InverseModel(make_damper(), DT_S),
        InversePipeline(with_effects(make_damper(), **neutral), DT_S),
    )
    for v, _, temperature, wish in motion:
        assert ours.step(wish, v, temperature) == pytest.approx(plain.step(wish, v, temperature), abs=1e-12)


@settings(max_examples=60)
@given(MOTION)
def test_with_every_effect_commands_stay_in_range_and_within_the_slew_limit(motion):
    damper = with_effects(make_damper(), **ALL)
    inverse, before = InversePipeline(damper, DT_S), 0.0
    for v, _, temperature, wish in motion:
        command = inverse.step(wish, v, temperature, 0.02 * v)
        assert 0.0 <= command <= damper.current_max_a
        assert abs(command - before) <= damper.current_slew_a_s * DT_S * (1.0 + 1e-9)
        before = command


@pytest.mark.parametrize("pair", list(itertools.combinations(sorted(ALL), 2))[::7])
def test_pairs_of_effects_give_the_same_force_on_the_vehicle_and_at_the_desk(pair):
    damper = with_effects(make_damper(), **{name: ALL[name] for name in pair})
    drive = make_drive(0.5)
    desk = force(damper, drive)
    assert np.max(np.abs(by_sample(damper, drive) - desk)) <= 1e-9 * np.max(np.abs(desk))


def test_all_effects_together_give_the_same_force_on_the_vehicle_and_at_the_desk():
    damper, drive = with_effects(make_damper(), **ALL), make_drive()
    desk = force(damper, drive)
    assert np.max(np.abs(by_sample(damper, drive) - desk)) <= 1e-9 * np.max(np.abs(desk))


def test_a_pipeline_says_which_signals_it_needs():
    damper = with_effects(make_damper(), gas_spring=ALL["gas_spring"], fluid_inertia=ALL["fluid_inertia"])
    assert ForwardPipeline(damper, DT_S).needs == {"displacement", "acceleration"}
    assert InversePipeline(make_damper(), DT_S).needs == frozenset()


def test_without_an_acceleration_the_velocity_is_differenced():
    damper = with_effects(make_damper(), fluid_inertia={"mass_kg": 10.0})
    ours, plain = ForwardPipeline(damper, DT_S), ForwardPipeline(make_damper(), DT_S)
    v = [sample[0] for sample in samples(make_drive(0.01))]
    added = [ours.step(u, 1.0, 40.0) - plain.step(u, 1.0, 40.0) for u in v]
    assert added == pytest.approx([0.0, *(10.0 * np.diff(v) / DT_S)], abs=1e-6)


def test_a_reset_pipeline_starts_as_a_new_one():
    damper, drive = with_effects(make_damper(), **ALL), samples(make_drive(0.1))
    used = ForwardPipeline(damper, DT_S)
    for sample in drive:
        used.step(*sample)
    used.reset()
    new = ForwardPipeline(damper, DT_S)
    assert [used.step(*sample) for sample in drive] == [new.step(*sample) for sample in drive]


@pytest.mark.parametrize(
    ("chosen", "said"),
    [
        ({"gas_sprin": {}}, "there is no effect gas_sprin; there are "),
        ({"force_offset": {}}, "force_offset: offset_n is missing"),
        ({"force_offset": {"offset_n": 1.0, "more": 1.0}}, "unknown parameter more"),
        ({"fluid_inertia": {"mass_kg": -1.0}}, "mass_kg = -1 is outside 0 to 50000 kg"),
        ({"fluid_inertia": {"mass_kg": float("nan")}}, "mass_kg = nan is outside"),
    ],
)
def test_an_unsound_setting_is_refused(chosen, said):
    with pytest.raises(EffectError) as caught:
        ForwardPipeline(with_effects(make_damper(), **chosen), DT_S)
    assert said in str(caught.value)


def test_an_optional_parameter_that_is_left_out_is_neutral():
    drive = samples(make_drive(0.1))
    short, whole = (
        ForwardPipeline(with_effects(make_damper(), viscous_damping=values), DT_S)
        for values in (
            {"damping_n_s_m": 300.0, "thinning_per_k": 0.01},
            {"damping_n_s_m": 300.0, "thinning_per_k": 0.01, "lag_s": 0.0},
        )
    )
    assert [short.step(*sample) for sample in drive] == [whole.step(*sample) for sample in drive]


def test_the_vehicle_loads_no_desk_library_for_effects():
    code = (
        "import sys, mrctl.model.pipeline as p, mrctl.model.effects.registry as r; r.effects();"
        "loaded = {m.partition('.')[0] for m in sys.modules};"
        "print(sorted(loaded & {'numba', 'scipy', 'pandas', 'matplotlib'}))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
