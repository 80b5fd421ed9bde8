"""Filters: the paper's with its corrections, at any loop rate."""

from __future__ import annotations

import numpy as np
import pytest
from model.dampers import FORWARD, INVERSE
from scipy import signal

from mrctl.model.filters import (
    Filter,
    FilterError,
    band_difference,
    butterworth_lowpass,
    iir_step,
    plain_lag,
    settled_state,
)

BAND = np.linspace(0.0, 20.0, 401)


def test_cascade_is_within_three_quarters_of_a_decibel_and_three_degrees_to_20_hz():
    cascade = FORWARD.response(BAND) * INVERSE.response(BAND)
    assert np.max(np.abs(20.0 * np.log10(np.abs(cascade)))) < 0.75
    assert np.max(np.abs(np.angle(cascade, deg=True))) < 3.0


@pytest.mark.parametrize("original", [FORWARD, INVERSE], ids=["forward", "inverse"])
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0, 4000.0])
def test_a_resampled_filter_agrees_to_20_hz(original, rate_hz):
    resampled = original.resampled(rate_hz)
    assert resampled.is_stable()
    gain_db, phase_deg = band_difference(resampled, original)
    assert gain_db <= 0.1
    assert phase_deg <= 0.5
    assert resampled.dc_gain() == pytest.approx(original.dc_gain(), abs=1e-9)


def test_a_rate_at_which_the_filter_cannot_live_is_refused():
    with pytest.raises(FilterError, match="cannot be carried"):
        FORWARD.resampled(60.0)


def test_an_unstable_filter_is_refused():
    printed = Filter.of(2000.0, (0.2166, -0.4128, 0.1964), (1.0, -2.738, 0.0, -0.7604))
    assert not printed.is_stable()
    with pytest.raises(FilterError, match="unstable"):
        printed.resampled(1000.0)


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [
        ((1.0, 2.0), (1.0,)),
        ((), (1.0,)),
        ((1.0,), (0.0, 1.0)),
        ((1.0,), (1.0,) * 5),
        ((float("nan"),), (1.0,)),
    ],
)
def test_a_filter_that_is_none_is_refused(numerator, denominator):
    with pytest.raises(FilterError):
        Filter.of(1000.0, numerator, denominator)


def test_the_scalar_step_is_the_standard_difference_equation():
    u = np.random.default_rng(1).standard_normal(2000)
    for one in (FORWARD, INVERSE, butterworth_lowpass(80.0, 1000.0)):
        state = [0.0, 0.0, 0.0]
        ours = [iir_step(one.coefficients, state, x) for x in u.tolist()]
        assert np.allclose(ours, signal.lfilter(one.b, one.a, u), rtol=0.0, atol=1e-12)


def test_a_settled_filter_stays_where_it_is():
    for one in (FORWARD, INVERSE, butterworth_lowpass(80.0, 1000.0)):
        state = settled_state(one.coefficients, 700.0)
        expected = 700.0 * one.dc_gain()
        assert iir_step(one.coefficients, state, 700.0) == pytest.approx(expected, rel=1e-9)
        assert iir_step(one.coefficients, state, 700.0) == pytest.approx(expected, rel=1e-9)


def test_butterworth_equals_the_library():
    b, a = signal.butter(2, 80.0, fs=1000.0)
    ours = butterworth_lowpass(80.0, 1000.0)
    assert np.allclose(ours.b[:3], b, atol=1e-14)
    assert np.allclose(ours.a[:3], a, atol=1e-14)


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
def test_a_plain_lag_delays_slow_signals_as_the_filter_does_and_is_positive_real(rate_hz):
    lag = plain_lag(FORWARD.resampled(rate_hz).coefficients)
    near_0 = np.array([1e-3, 2e-3])
    f = np.array([*near_0, *np.linspace(1.0, 0.5 * rate_hz, 50)])
    own = Filter(rate_hz, lag[:4], (1.0, *lag[4:])).response(f)
    delay_s = -np.diff(np.unwrap(np.angle(own[:2]))) / (2.0 * np.pi * np.diff(near_0))
    theirs = -np.diff(np.unwrap(np.angle(FORWARD.resampled(rate_hz).response(near_0))))
    assert delay_s == pytest.approx(theirs / (2.0 * np.pi * np.diff(near_0)), rel=1e-4)
    assert np.all(own.real > 0.0)


def test_a_filter_that_leads_has_no_lag():
    assert plain_lag((2.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
