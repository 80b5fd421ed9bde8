"""The switch between off and on: the same in fits and in the damper, and neither state is lost in a fit."""

from __future__ import annotations

import numpy as np
import pytest
from identify.virtual import Bench, random_damper

from mrctl.identify.base import on_weights
from mrctl.identify.bounds import base_bounds
from mrctl.identify.records import records_of
from mrctl.identify.start import layout_for
from mrctl.model.static import on_weight

CURRENT_A = np.linspace(0.0, 3.0, 61)


@pytest.mark.parametrize(("off_a", "on_a"), [(0.5, 1.5), (1.0, 1.0), (3.0, 1.5), (0.0, 0.0)])
def test_fits_and_dampers_switch_alike_crossed_too(off_a, on_a):
    """A fit whose slopes are of another switch than its forces finds no step that helps."""
    one_by_one = [on_weight(i, off_a, on_a) for i in CURRENT_A.tolist()]
    assert on_weights(CURRENT_A, off_a, on_a).tolist() == pytest.approx(one_by_one)


def test_at_held_currents_the_lowest_stays_off_and_the_rest_may_be_on():
    bench = Bench(random_damper(2), np.random.default_rng(2))
    records = records_of(
        [bench.sine(f"{i:g}", 400.0, 2.0, 0.02, 4, i, c) for i in (0, 1, 3) for c in (30, 60)]
    )
    layout = layout_for(records)
    lower, upper = base_bounds(layout, 400.0, 1.0, minimum_phase=True)
    off, on = range(*layout.parts["blend"].indices(layout.size))
    lowest, next_one, highest = layout.current_a
    assert lower[off] == lowest < lower[on] < next_one == upper[off] < upper[on] == highest
