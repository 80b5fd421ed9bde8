"""A stop at either end: what a fit that knows of one only may try beside it."""

from __future__ import annotations

import pytest

from mrctl.model.effects.base import Ranges
from mrctl.model.effects.registry import effects

STOP = effects()["end_stop"]
REACH_M = 0.05
RANGES = Ranges(REACH_M, 1.0, 2.0, 1000.0)
FORM = 300.0, 1.5, 500.0


def _ends(p):
    return p[4] - p[0], p[4] + p[0]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_where_one_stop_is_reached_the_other_is_tried_within_the_stroke(side):
    one = (0.06, *FORM, side * 0.02, 0.001, 0.2)  # its outer end at 0.08 m, its inner one at 0.04 m
    points = STOP.beside(one, RANGES)
    assert len(points) == 3
    for point in points:
        touched, other = _ends(point)[:: int(side)]
        assert touched == pytest.approx(-side * 0.04)
        assert 0.5 * REACH_M < side * other < REACH_M
        assert point[1:4] == FORM
        assert point[5:] == one[5:]


def test_where_both_or_none_are_reached_there_is_nothing_to_try():
    assert not STOP.beside((0.04, *FORM, 0.002, 0.0, 0.0), RANGES)
    assert not STOP.beside((0.06, *FORM, 0.002, 0.0, 0.0), RANGES)
