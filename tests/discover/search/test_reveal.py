"""What a campaign cannot show, and what the base's own tables have taken up."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.search.reveal import compression_change, hidden_effects, taken_up
from mrctl.model.effects.registry import effect

KNOTS = np.linspace(-0.4, 0.5, 19)


def _tables(compression):
    layout = SimpleNamespace(velocity_m_s=KNOTS)
    g = np.tanh(KNOTS / 0.05) * np.where(KNOTS < 0.0, compression, 1.0)
    return layout, SimpleNamespace(g=g)


def test_how_much_more_g_damps_compression_is_read_off_at_speeds_that_both_reach():
    assert compression_change(*_tables(0.85)) == pytest.approx(-0.15, abs=0.005)
    assert compression_change(*_tables(1.2)) == pytest.approx(0.2, abs=0.005)


def test_an_asymmetry_that_g_has_is_told_with_its_size():
    hidden = {"rebound_asymmetry": "taken up", "gas_spring": "no stroke"}
    told = taken_up(hidden, *_tables(0.85))
    assert told["rebound_asymmetry"] == "taken up; g damps compression 15 % less than rebound"
    assert told["gas_spring"] == "no stroke"
    assert taken_up(hidden, *_tables(1.0)) == hidden


def test_an_asymmetry_that_g_has_is_told_also_where_one_that_the_current_changes_would_show():
    told = taken_up({}, *_tables(0.85))["rebound_asymmetry"]
    assert told.startswith("one that is alike at all currents is the base model's own")
    assert told.endswith("g damps compression 15 % less than rebound")
    assert taken_up({}, *_tables(1.0)) == {}


@pytest.mark.parametrize(("steady", "said"), [(True, "steady in every run"), (False, "take up 99 %")])
def test_what_acts_on_a_current_that_never_changes_is_said_to_lack_that(steady, said):
    looks = [
        SimpleNamespace(effect=effect(name), usual_force=100.0, usual_beyond=1.0)
        for name in ("current_lag", "gas_spring")
    ]
    hidden = hidden_effects(looks, 1.0, steady=steady)
    assert said in hidden["current_lag"]
    assert "take up 99 %" in hidden["gas_spring"]
