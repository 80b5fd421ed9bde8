"""Where a run begins slowly: its velocity is noise or has just turned; its force tells from where it came."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.forward import modelled
from mrctl.identify.records import Record
from mrctl.model.damper import EffectSetting
from mrctl.model.effects.registry import effect

sys.path.insert(0, str(Path(__file__).parent))
from virtual import Bench, random_damper

RATE_HZ = 1000.0


@pytest.mark.parametrize(
    ("first_n", "begun_m_s"),
    [(3.0, 0.0), (-3.0, 0.0), (200.0, 2e-4), (-200.0, 2e-4), (560.0, 2e-4), (-560.0, -2e-4)],
)
def test_where_a_record_begins_slowly_its_force_tells_from_where_it_came(first_n, begun_m_s):
    """Next to none: nothing holds yet; most of what it has soon: as before the turn; else the motion."""
    t = np.arange(800) / RATE_HZ
    v = 0.3 * np.sin(2.0 * np.pi * 3.0 * t) + 2e-4
    flat, force = np.ones(t.size), 600.0 * np.tanh(v / 0.05)
    one = Record(0, RATE_HZ, v, flat, flat, np.concatenate([[first_n], force[1:]]), flat, flat)
    assert not one.starts_at_rest
    assert one.driven_m_s[0] == pytest.approx(begun_m_s)
    assert np.array_equal(one.driven_m_s[1:], v[1:])


@pytest.mark.parametrize("preload_n", [0.0, 900.0, -900.0])
@pytest.mark.parametrize(("held", "begun"), [(-1.0, -1.0), (0.2, 1.0), (1.0, 1.0)])
def test_soon_after_a_turn_what_yields_is_where_it_was_before(preload_n, held, begun):
    t = np.arange(800) / RATE_HZ
    v = 0.3 * np.sin(2.0 * np.pi * 3.0 * t + 0.1)
    flat, force = np.ones(t.size), 600.0 * np.tanh(v / 0.05)
    force[0] = 600.0 * held
    one = Record(0, RATE_HZ, v, flat, flat, force + preload_n, flat, flat)
    assert one.driven_m_s[0] == pytest.approx(begun * v[0])


def test_a_record_that_begins_in_motion_is_driven_as_it_was_measured():
    t = np.arange(800) / RATE_HZ
    v = 0.3 * np.cos(2.0 * np.pi * 3.0 * t)
    flat, force = np.ones(t.size), np.concatenate([[-600.0], 600.0 * np.tanh(v[1:] / 0.05)])
    one = Record(0, RATE_HZ, v, flat, flat, force, flat, flat)
    assert np.array_equal(one.driven_m_s, v)


@pytest.mark.parametrize("noise_m_s", [3e-4, -3e-4])
def test_a_run_from_rest_is_modelled_from_rest_whatever_its_first_velocity(noise_m_s):
    elastic = effect("preyield_stiffness")
    neutral = {p.name: value for p, value in zip(elastic.parameters, elastic.neutral, strict=True)}
    values = neutral | {"yield_length_m": 1e-3, "share": 0.0, "plastic": 0.5}
    damper = replace(random_damper(3), effects=(EffectSetting(elastic.name, values),))
    t = np.arange(2000) / RATE_HZ
    v = np.where(t < 0.025, 0.0, 0.25 * np.sin(4.0 * np.pi * t) * np.minimum(t / 0.5, 1.0))
    run = Bench(damper, np.random.default_rng(1), 0.0).run("rest", t, v, 1.0, 30.0)
    noisy = np.where(t < 0.025, noise_m_s, v)
    left = modelled(damper, replace(run, velocity_m_s=noisy)) - run.force_n
    assert np.abs(left).max() < 0.05 * np.abs(run.force_n).max()
