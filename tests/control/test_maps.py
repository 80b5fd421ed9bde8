"""Every current map keeps the range and the slew limit; the baselines are what their sources say."""

from __future__ import annotations

import cmath
import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model.dampers import magneride

from mrctl.control.maps import CURRENT_MAPS, make_current_map
from mrctl.model.baselines.linear import largest_force_n
from mrctl.model.baselines.liu import LiuMap, fit_liu, viscosity_pa_s
from mrctl.model.baselines.reader import lead_filter, nearest_lowpass_rad_s
from mrctl.model.static import backbone_force, static_tables
from mrctl.model.static_inverse import Reach

DAMPER = magneride()
DT = 0.001
MAPS = {name: make_current_map(name, DAMPER, DT) for name in CURRENT_MAPS}
every_map = pytest.mark.parametrize("name", CURRENT_MAPS)
# A damper whose current may go anywhere within a step, to look at a map without its slew limit.
QUICK = dataclasses.replace(DAMPER, current_slew_a_s=1e9)


@every_map
@settings(deadline=None)  # a busy machine is no failure
@given(
    samples=st.lists(
        st.tuples(st.floats(-1e4, 1e4), st.floats(-3.0, 3.0), st.floats(-40.0, 150.0)),
        min_size=1,
        max_size=50,
    )
)
def test_current_stays_finite_within_range_and_slew(name, samples):
    current_map = MAPS[name]
    current_map.reset()
    last = 0.0
    for wish, velocity, temperature in samples:
        current = current_map.step(wish, velocity, temperature)
        assert 0.0 <= current <= DAMPER.current_max_a
        assert abs(current - last) <= DAMPER.current_slew_a_s * DT * (1.0 + 1e-12)
        assert current_map.current_a == current
        last = current


@every_map
def test_driving_force_gets_no_current_in_the_end(name):
    current_map = make_current_map(name, DAMPER, DT)
    current_map.reset(0.0, 2.0)
    for _ in range(100):
        current = current_map.step(-500.0, 0.2, 40.0)
    assert current == pytest.approx(0.0, abs=1e-9)
    assert current_map.reach is Reach.BELOW


@every_map
def test_too_large_a_wish_gets_the_largest_current_and_says_so(name):
    current_map = make_current_map(name, DAMPER, DT)
    for _ in range(300):
        current = current_map.step(9000.0, 0.3, 40.0)
    assert current == pytest.approx(DAMPER.current_max_a)
    assert current_map.reach is Reach.ABOVE


@every_map
def test_reset_takes_the_flowing_current(name):
    current_map = make_current_map(name, DAMPER, DT)
    current_map.reset(600.0, 1.25)
    assert current_map.current_a == 1.25
    assert abs(current_map.step(600.0, 0.2, 40.0) - 1.25) <= DAMPER.current_slew_a_s * DT


@every_map
def test_map_and_its_parameters_are_documented(name):
    kind = CURRENT_MAPS[name]
    assert kind.name == name
    assert kind.summary
    assert kind.source
    assert all(p.help and p.unit and p.low <= p.default <= p.high for p in kind.parameters)


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("invers", {}, "did you mean 'inverse'"),
        ("inverse", {"gain": 1.0}, "there are no parameters"),
        ("reader", {"lead_ratio": 0.5}, "give a number from 1.01"),
        ("linear", {"force_max": 100.0}, "did you mean 'force_max_n'"),
    ],
)
def test_unusable_choice_is_refused_with_the_mend(name, parameters, words):
    with pytest.raises(ValueError, match=name) as caught:
        make_current_map(name, DAMPER, DT, parameters)
    assert words in str(caught.value)


# --- linear ---


def test_linear_map_goes_through_the_dampers_largest_force():
    linear = make_current_map("linear", QUICK, DT)
    largest = largest_force_n(DAMPER)
    assert largest == pytest.approx(backbone_force(0.381, 3.0, 28.9, DAMPER.static))
    assert linear.step(largest, 0.381, 25.0) == pytest.approx(3.0)
    assert linear.step(-0.5 * largest, -0.01, 90.0) == pytest.approx(1.5)
    assert linear.step(0.5 * largest, -0.01, 90.0) == 0.0


# --- Reader ---


def test_readers_static_inverse_is_exact_at_room_temperature():
    reader = make_current_map("reader", QUICK, DT)
    wish = backbone_force(0.2, 1.7, 28.9, DAMPER.static)
    for _ in range(200):
        current = reader.step(wish, 0.2, 80.0)
    assert current == pytest.approx(1.7, abs=1e-9)


def test_readers_lag_corner_is_the_nearest_first_order_lowpass():
    corner = nearest_lowpass_rad_s(DAMPER.forward_filter)
    f = np.linspace(0.0, 100.0, 401)
    target = DAMPER.forward_filter.response(f)

    def misfit(a):
        return np.sum(np.abs(a / (2j * np.pi * f + a) - target) ** 2)

    assert misfit(corner) < min(misfit(0.99 * corner), misfit(1.01 * corner))
    assert 50.0 < corner / (2.0 * math.pi) < 120.0


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
def test_readers_lead_undoes_the_lag_where_the_printed_equation_does_not(rate_hz):
    a = nearest_lowpass_rad_s(DAMPER.forward_filter)
    b = 5.0 * a
    lead = lead_filter(a, 5.0, rate_hz)
    assert lead.is_stable()
    assert lead.dc_gain() == pytest.approx(1.0)
    for hz in (1.0, 5.0, 20.0):
        s = 2j * math.pi * hz
        lag = a / (s + a)
        corrected = lag * lead.response(np.array([hz]))[0]
        assert abs(abs(corrected) - 1.0) < 0.01
        assert abs(math.degrees(cmath.phase(corrected))) < 4.0
        printed = lag * (b * s + a) / (a * s + b)
        assert abs(abs(printed) - 1.0) > 0.3


# --- Liu ---


def test_viscosity_is_continuous_at_zero_and_falls_with_temperature():
    assert viscosity_pa_s(0.0) == 0.245
    assert viscosity_pa_s(-1e-9) == pytest.approx(0.245)
    assert viscosity_pa_s(-20.0) > viscosity_pa_s(0.0) > viscosity_pa_s(80.0) > 0.0


def liu_like_damper(k, alpha, beta):
    """A damper whose tables are Liu's model at 40 degC without viscous force (g is 1 when sliding)."""
    currents = np.linspace(0.0, 3.0, 61)
    return dataclasses.replace(
        DAMPER,
        static=static_tables(
            currents.tolist(),
            (k * viscosity_pa_s(40.0) * 0.2 + alpha * currents**beta).tolist(),
            [-0.2, -1e-6, 0.0, 1e-6, 0.2],
            [-1.0, -1.0, 0.0, 1.0, 1.0],
            [39.0, 41.0],
            [1.0, 1.0],
            [1.0, 1.0],
            0.0,
            1.0,
        ),
    )


def test_fit_finds_the_power_law_that_made_the_tables():
    fitted = fit_liu(liu_like_damper(0.01, 700.0, 0.8))
    assert fitted.field_force_n == pytest.approx(700.0, rel=0.01)
    assert fitted.exponent == pytest.approx(0.8, abs=0.011)


def test_liu_inverts_his_own_model():
    liu = LiuMap(QUICK, DT, {"viscous_length_m": 6000.0, "field_force_n": 600.0, "exponent": 0.8})
    viscous = 6000.0 * viscosity_pa_s(50.0) * 0.15
    assert liu.step(viscous + 600.0 * 1.4**0.8, 0.15, 50.0) == pytest.approx(1.4)
    assert liu.step(0.9 * viscous, 0.15, 50.0) == 0.0


def test_given_liu_parameters_win_over_fitted_ones():
    fitted = fit_liu(DAMPER)
    assert fitted.viscous_length_m > 0.0
    liu = make_current_map("liu", DAMPER, DT, {"exponent": 1.0})
    assert isinstance(liu, LiuMap)
    assert liu.fitted == fitted._replace(exponent=1.0)
