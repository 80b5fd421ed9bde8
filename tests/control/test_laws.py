"""The contract that every control law keeps, and what each one is for."""

from __future__ import annotations

import inspect
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.control.base import Motion
from mrctl.control.laws import LAWS, make_law
from mrctl.model.baselines.liu import viscosity_pa_s

every_law = pytest.mark.parametrize("name", LAWS)
velocities = st.floats(-3.0, 3.0)
motions = st.builds(
    Motion,
    velocities,
    velocities,
    st.floats(-40.0, 150.0),
    st.floats(-0.2, 0.2),
    st.floats(-5000.0, 5000.0),
)


def settings_within_bounds(law):
    """Parameters drawn between their bounds; tables stay as they are."""
    return st.fixed_dictionaries(
        {
            p.name: st.floats(p.low, p.high)
            for p in law.parameters
            if isinstance(p.default, float) and p.name not in {"minimum_n_s_m", "maximum_n_s_m"}
        }
    )


@every_law
@settings(deadline=None)  # a busy machine is no failure
@given(data=st.data())
def test_force_is_finite_for_all_motions_and_all_parameters_within_their_bounds(name, data):
    law = make_law(name, data.draw(settings_within_bounds(LAWS[name])))
    assert math.isfinite(law(data.draw(motions)))


@every_law
@settings(deadline=None)  # a busy machine is no failure
@given(motion=motions)
def test_law_that_claims_to_be_dissipative_never_drives_the_motion(name, motion):
    power = make_law(name)(motion) * motion.relative_velocity_m_s
    assert power >= 0.0 or not LAWS[name].dissipative


def test_the_external_wish_is_the_only_law_that_may_ask_for_driving_forces():
    assert [name for name, law in LAWS.items() if not law.dissipative] == ["external"]


def jump_at_a_sign_change(law, motion, field):
    """How much the force jumps where one velocity changes its sign."""
    tiny = 1e-9
    return abs(law(replace(motion, **{field: tiny})) - law(replace(motion, **{field: -tiny})))


@every_law
@settings(deadline=None)  # a busy machine is no failure
@given(motion=motions)
def test_law_that_claims_to_be_continuous_does_not_jump_where_a_velocity_changes_sign(name, motion):
    law = make_law(name)
    jumps = [
        jump_at_a_sign_change(law, motion, field) for field in ("relative_velocity_m_s", "body_velocity_m_s")
    ]
    assert max(jumps) < 1e-3 or not LAWS[name].continuous


@pytest.mark.parametrize(
    ("name", "field"),
    [("skyhook_two_state", "body_velocity_m_s"), ("liu", "relative_velocity_m_s")],
)
def test_laws_that_do_not_claim_continuity_do_jump(name, field):
    assert jump_at_a_sign_change(make_law(name), Motion(0.5, 0.5, 25.0), field) > 100.0


@every_law
@settings(deadline=None)  # a busy machine is no failure
@given(motion=motions)
def test_law_is_the_same_in_rebound_and_compression(name, motion):
    law = make_law(name)
    mirrored = Motion(
        -motion.relative_velocity_m_s,
        -motion.body_velocity_m_s,
        motion.temperature_c,
        -motion.displacement_m,
        -motion.force_wish_n,
    )
    assert law(mirrored) == pytest.approx(-law(motion), abs=1e-9)


@every_law
def test_no_force_at_rest(name):
    assert make_law(name)(Motion(0.0, 0.0, 55.0)) == 0.0


@every_law
def test_law_needs_what_it_says_and_nothing_else(name):
    fields = {
        "body_velocity": ("body_velocity_m_s", 0.4, -0.7),
        "temperature": ("temperature_c", 20.0, 80.0),
        "displacement": ("displacement_m", 0.01, -0.02),
        "force_wish": ("force_wish_n", 100.0, -300.0),
    }
    law = make_law(name)
    used = set()
    for role, (field, one, other) in fields.items():
        for v in (-0.3, -0.1, 0.05, 0.2):
            base = Motion(v, 0.1, 30.0, 0.0, 0.0)
            if law(replace(base, **{field: one})) != law(replace(base, **{field: other})):
                used.add(role)
    assert used == LAWS[name].needs


@every_law
def test_law_and_its_parameters_are_documented_and_their_defaults_lie_within_their_bounds(name):
    law = LAWS[name]
    assert law.name == name
    assert law.summary
    assert law.source
    for parameter in law.parameters:
        assert parameter.help
        assert parameter.unit
        entries = parameter.default if isinstance(parameter.default, tuple) else (parameter.default,)
        assert all(parameter.low <= entry <= parameter.high for entry in entries)


@every_law
def test_law_takes_plain_floats_and_gives_one(name):
    force = make_law(name)(Motion(0.2, 0.3, 25.0, 0.0, 50.0))
    assert type(force) is float
    assert "numpy" not in inspect.getsource(inspect.getmodule(LAWS[name].make))


# --- what each law does ---


def test_skyhook_gives_the_sky_dampers_force_where_it_dissipates_and_the_minimum_elsewhere():
    law = make_law("skyhook_continuous", {"sky_n_s_m": 3000.0, "minimum_n_s_m": 200.0, "maximum_n_s_m": 1e6})
    assert law(Motion(0.5, 0.2, 25.0)) == pytest.approx(600.0)
    assert law(Motion(-0.5, 0.2, 25.0)) == pytest.approx(-100.0)


def test_two_state_skyhook_is_firm_only_while_it_also_damps_the_body():
    law = make_law("skyhook_two_state", {"minimum_n_s_m": 300.0, "maximum_n_s_m": 4000.0})
    assert law(Motion(0.1, 0.01, 25.0)) == pytest.approx(400.0)
    assert law(Motion(0.1, -0.01, 25.0)) == pytest.approx(30.0)


def test_no_jerk_skyhook_becomes_skyhook_at_high_relative_velocity():
    law = make_law("skyhook_no_jerk", {"sky_n_s_m": 3000.0, "blend_m_s": 0.05, "minimum_n_s_m": 0.0})
    assert law(Motion(1.0, 0.2, 25.0)) == pytest.approx(600.0)
    assert law(Motion(0.005, 0.2, 25.0)) == pytest.approx(600.0 * 0.1, rel=0.01)


def test_groundhook_resists_the_wheels_motion():
    law = make_law("groundhook", {"ground_n_s_m": 2000.0, "minimum_n_s_m": 0.0, "maximum_n_s_m": 1e6})
    # Body still, wheel falling at 0.2 m/s: the damper extends and its force pulls the wheel up.
    assert law(Motion(0.2, 0.0, 25.0)) == pytest.approx(400.0)
    # The wheel rises with 0.1 while the damper extends: groundhook would have to push, so nothing.
    assert law(Motion(0.2, 0.3, 25.0)) == 0.0


@settings(deadline=None)  # a busy machine is no failure
@given(motion=motions, share=st.sampled_from([0.0, 1.0]))
def test_hybrid_ends_in_skyhook_and_groundhook(motion, share):
    hybrid = make_law("hybrid", {"sky_share": share})
    pure = make_law("skyhook_continuous" if share == 1.0 else "groundhook")
    assert hybrid(motion) == pytest.approx(pure(motion), abs=1e-9)


def test_reference_damper_follows_its_curve_and_mirrors_one_that_starts_at_rest():
    whole = make_law("reference_damper", {"velocity_m_s": (-0.4, 0.0, 0.2), "force_n": (-900, 0, 400)})
    assert whole(Motion(0.1, 0.0, 25.0)) == pytest.approx(200.0)
    assert whole(Motion(-0.2, 0.0, 25.0)) == pytest.approx(-450.0)
    assert whole(Motion(5.0, 0.0, 25.0)) == pytest.approx(400.0)
    half = make_law("reference_damper", {"velocity_m_s": (0.0, 0.2), "force_n": (0.0, 400.0)})
    assert half(Motion(-0.1, 0.0, 25.0)) == pytest.approx(-200.0)


def test_liu_asks_for_the_viscous_force_where_skyhook_is_less():
    law = make_law("liu", {"sky_n_s_m": 3000.0, "viscous_length_m": 5000.0})
    viscous = 5000.0 * viscosity_pa_s(60.0)
    assert law(Motion(0.1, 0.3, 60.0)) == pytest.approx(900.0)
    assert law(Motion(1.5, 0.3, 60.0)) == pytest.approx(1.5 * viscous)
    assert law(Motion(-0.1, 0.3, 60.0)) == pytest.approx(-0.1 * viscous)


def test_external_wish_is_limited():
    law = make_law("external", {"limit_n": 800.0})
    assert law(Motion(0.0, 0.0, 25.0, 0.0, -2000.0)) == -800.0


# --- unusable parameters ---


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("skyhook", {}, "did you mean 'skyhook"),
        ("passive", {"damping": 100.0}, "did you mean 'damping_n_s_m'"),
        ("passive", {"damping_n_s_m": -1.0}, "give a number from 0 to 1e+06 N s/m"),
        ("passive", {"damping_n_s_m": "firm"}, "give a number from 0"),
        ("passive", {"damping_n_s_m": True}, "give a number from 0"),
        ("passive", {"damping_n_s_m": math.nan}, "give a number from 0"),
        ("passive", {"damping_n_s_m": [1.0, 2.0]}, "give a number from 0"),
        ("skyhook_continuous", {"minimum_n_s_m": 900.0, "maximum_n_s_m": 800.0}, "swap them"),
        ("reference_damper", {"velocity_m_s": [0.0, 0.1, 0.2], "force_n": [0.0, 1.0]}, "same length"),
        ("reference_damper", {"velocity_m_s": [0.0, 0.2, 0.1], "force_n": [0.0, 1.0, 2.0]}, "sort it"),
        ("reference_damper", {"velocity_m_s": [0.0, 0.2], "force_n": [0.0, -5.0]}, "sign of velocity"),
        ("reference_damper", {"velocity_m_s": [0.0, 0.2], "force_n": [3.0, 5.0]}, "sign of velocity"),
        ("reference_damper", {"velocity_m_s": [-0.1, 0.2], "force_n": [-3.0, 5.0]}, "add 0 to"),
        ("reference_damper", {"velocity_m_s": [], "force_n": []}, "give a list of numbers"),
        ("reference_damper", {"force_n": 3.0}, "give a list of numbers"),
    ],
)
def test_unusable_parameters_are_refused_with_the_mend(name, parameters, words):
    with pytest.raises(ValueError, match=name) as caught:
        make_law(name, parameters)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_all_faults_are_told_at_once():
    with pytest.raises(ValueError, match="sky_share is 2") as caught:
        make_law("hybrid", {"sky_share": 2.0, "sky_n_s_m": -1.0, "wheel": 1.0})
    assert "sky_n_s_m is -1" in str(caught.value)
    assert "no parameter 'wheel'" in str(caught.value)
