"""The output guard: whatever it is given, what leaves is safe."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.runtime.guard import OutputGuard

UNIT_A = 0.001
LIMIT_A = 3.0
SLEW_A_S = 400.0
DT_S = 0.002


def guard():
    return OutputGuard(LIMIT_A, SLEW_A_S, DT_S, 1.0, UNIT_A)


@settings(max_examples=500)
@given(
    wishes=st.lists(
        st.tuples(st.floats(allow_nan=True, allow_infinity=True), st.integers(0, 3)), min_size=1, max_size=60
    )
)
def test_whatever_comes_in_what_leaves_is_finite_in_range_and_within_slew(wishes):
    one, before = guard(), 0.0
    for now, (wish, age) in enumerate(wishes):
        one.stepped_in = False
        out = one.apply(wish, now - age, now)
        assert math.isfinite(out)
        assert 0.0 <= out <= LIMIT_A
        assert abs(out - before) <= SLEW_A_S * DT_S + 1e-9
        assert one.stepped_in or abs(out - wish) <= 1.5 * UNIT_A
        before = out


def test_a_stale_command_is_replaced_by_the_fallback():
    one = guard()
    for now in range(10):
        one.stepped_in = False
        out = one.apply(2.0, -1, now)
        assert one.stepped_in
    assert out == pytest.approx(1.0)


def test_a_sound_command_passes_unchanged():
    one = guard()
    assert one.apply(0.5, 7, 7) == pytest.approx(0.5)
    assert not one.stepped_in


def test_a_slew_limit_below_one_count_a_tick_is_refused():
    with pytest.raises(ValueError, match="raise it"):
        OutputGuard(LIMIT_A, 0.4, DT_S, 1.0, UNIT_A)
