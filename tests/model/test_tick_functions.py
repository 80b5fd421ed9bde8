"""What is written out for the tick gives the numbers of the formulas that it stands for, to the last bit."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from model.dampers import FORWARD, INVERSE

from mrctl.model.filters import Filter, butterworth_lowpass, iir_step, settled_state
from mrctl.model.refined import make_refined_inverse
from mrctl.model.tables import interpolate, make_lookup

reals = st.floats(-1e6, 1e6)
RATE_HZ = 500.0
FILTERS = [
    (INVERSE, FORWARD, butterworth_lowpass(80.0, 2000.0)),
    (INVERSE.resampled(RATE_HZ), FORWARD.resampled(RATE_HZ), butterworth_lowpass(80.0, RATE_HZ)),
    (INVERSE, FORWARD, None),
    (Filter.of(2000.0, (2.0,), (1.0,)), FORWARD, None),
]


@given(st.lists(st.tuples(reals, reals), min_size=1, max_size=30, unique_by=lambda pair: pair[0]), reals)
def test_a_lookup_is_the_interpolation(table, x):
    knots, values = zip(*sorted(table), strict=True)
    lookup = make_lookup(knots, values)
    for at in (x, *knots, knots[0] - 1.0, knots[-1] + 1.0):
        assert lookup(at) == interpolate(at, knots, values)


@pytest.mark.parametrize(("inverse", "forward", "lowpass"), FILTERS)
def test_the_refined_inverse_is_its_filters_one_after_another(inverse, forward, lowpass):
    rng = random.Random(1)
    step, settle = make_refined_inverse(inverse, forward, lowpass)
    for start in (0.0, 700.0):
        if start:
            settle(start)
        states = [
            settled_state(inverse.coefficients, start),
            settled_state(forward.coefficients, start),
            [0.0] * 3,
            [0.0] * 3,
        ]
        for _ in range(500):
            wish = rng.uniform(-2000.0, 2000.0)
            expected = back = iir_step(inverse.coefficients, states[0], wish)
            if lowpass is not None:
                missing = wish - iir_step(forward.coefficients, states[1], back)
                low = iir_step(lowpass.coefficients, states[2], missing)
                expected = back + iir_step(inverse.coefficients, states[3], low)
            assert step(wish) == expected


def test_two_refined_inverses_share_nothing():
    one, _ = make_refined_inverse(*FILTERS[0])
    other, _ = make_refined_inverse(*FILTERS[0])
    first = one(1000.0)
    one(1000.0)
    assert other(1000.0) == first
