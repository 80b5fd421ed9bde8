"""What was before a run, which no file tells, but its first forces."""

import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.forward import modelled
from mrctl.identify.pasts import with_pasts
from mrctl.identify.records import records_of
from mrctl.measurements.pasts import PAST_S, pasts_of
from mrctl.model.damper import EffectSetting
from mrctl.simulate import simulate

sys.path.insert(0, str(Path(__file__).parent))
from virtual import Bench, random_damper

RATE_HZ = 2000.0  # of their filters
SOON = 100  # samples


def moved(seed, noise_n=0.0, effects=()):
    damper = replace(random_damper(seed), effects=effects)
    bench = Bench(damper, np.random.default_rng(seed), noise_n)
    t, v = bench.road(RATE_HZ, 4.0)
    return damper, bench.run("road", t, v, 1.0, 30.0)


def cut(run, first):
    signals = {f.name: getattr(run, f.name) for f in fields(run) if f.init}
    whole = len(run)
    return replace(
        run,
        **{
            name: x[first:] - (x[first] if name == "time_s" else 0.0)
            for name, x in signals.items()
            if isinstance(x, np.ndarray) and x.shape == (whole,)
        },
    )


def soon(damper, run, force=modelled):
    return float(np.sqrt(np.mean((run.force_n - force(damper, run))[:SOON] ** 2)))


def as_its_first_sample(damper, run):
    return simulate(
        damper,
        1.0 / RATE_HZ,
        run.velocity_m_s,
        run.current_a,
        run.temperature_c,
        run.displacement_m,
        run.acceleration_m_s2,
    )


def test_a_motion_turned_round_goes_on_where_the_run_begins():
    t = np.arange(2000) / RATE_HZ
    v, x = 0.3 * np.sin(12.0 * t + 0.5), -0.025 * np.cos(12.0 * t + 0.5)
    first, rest, turned = pasts_of(v, x, np.gradient(v, t), np.ones(t.size), RATE_HZ)
    assert np.all(turned.current_a == 1.0)
    assert len(first) == 0
    assert np.all(rest.velocity_m_s == 0.0)
    assert np.all(rest.displacement_m == x[0])
    assert len(turned) == int(PAST_S * RATE_HZ)
    before, ago = turned.velocity_m_s, np.arange(len(turned), 0, -1) / RATE_HZ
    assert before[-10:] == pytest.approx(0.3 * np.sin(0.5 - 12.0 * ago[-10:]), abs=0.003)
    assert turned.displacement_m[-10:] == pytest.approx(-0.025 * np.cos(0.5 - 12.0 * ago[-10:]), abs=1e-4)
    assert turned.displacement_m.min() >= x.min()
    assert turned.displacement_m.max() <= x.max()


@pytest.mark.parametrize("late", [False, True])
def test_a_run_cut_out_of_a_motion_begins_nearer_to_its_force(late):
    """Of many cuts; with a delay too, which holds forces of before the run."""
    effects = (EffectSetting("sensor_delay", {"delay_s": 0.004}),) if late else ()
    told, plain = [], []
    for seed in range(4):
        damper, run = moved(seed, noise_n=5.0, effects=effects)
        for first in range(1000, 7000, 600):
            part = cut(run, first)
            told.append(soon(damper, part))
            plain.append(soon(damper, part, as_its_first_sample))
    told, plain = np.array(told), np.array(plain)
    assert np.sqrt(np.mean(told**2)) < 0.7 * np.sqrt(np.mean(plain**2))
    assert np.all(told <= 1.01 * plain)


def test_a_force_that_began_at_nothing_is_modelled_from_rest():
    damper, run = moved(7)
    part = cut(run, int(np.argmax(np.abs(run.velocity_m_s[:4000]))))
    at_rest = simulate(
        damper,
        1.0 / RATE_HZ,
        part.velocity_m_s,
        part.current_a,
        part.temperature_c,
        part.displacement_m,
        part.acceleration_m_s2,
        settled=False,
    )
    begun = replace(part, force_n=at_rest)
    assert soon(damper, begun) < 0.01 * soon(damper, begun, as_its_first_sample)


def test_a_run_that_began_as_its_first_sample_stays_as_it_is():
    damper, run = moved(5)
    assert np.array_equal(modelled(damper, run), as_its_first_sample(damper, run))


def test_the_past_of_a_refined_record_has_whole_samples():
    _, run = moved(3)
    [record] = records_of([run])
    fine = record.refined(3)

    def from_rest(records):
        return [r.force_n + abs(r.velocity_m_s[0]) for r in records]

    [(whole, before)] = with_pasts([fine], from_rest)
    assert before > 0
    assert before % fine.finer == 0
    assert len(whole) == before + len(fine)
    assert np.array_equal(whole.force_n[before:], fine.force_n)


def test_a_field_that_remembers_a_larger_current_is_modelled_with_it():
    field = EffectSetting("magnetic_hysteresis", {"half_width_a": 0.3, "share": 0.8, "smoothness": 0.0})
    damper, run = moved(2, effects=(field,))
    current = np.where(np.arange(len(run)) < 1000, damper.current_max_a, 0.5)
    t, v = run.time_s, run.velocity_m_s
    whole = Bench(damper, np.random.default_rng(3), 2.0).run("after 4 A", t, v, current, 30.0)
    part = cut(whole, 3000)
    assert soon(damper, part) < 0.3 * soon(damper, part, as_its_first_sample)
