from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from motions import damper_force, rows, sine, write_csv
from scipy import signal

from mrctl.measurements import (
    Campaign,
    RawRun,
    assemble,
    check_campaign,
    check_run,
    load_campaign,
    load_run,
    require_sound,
)
from mrctl.measurements.quality.spikes import check_spikes
from mrctl.plant.dyno.campaign import Bench

RATE = 1000.0


def run_of(velocity, force, current=1.0, rate=RATE, name="run.csv", **more):
    n = len(velocity)
    channels = {
        "velocity_m_s": np.asarray(velocity),
        "force_n": np.asarray(force),
        "current_a": np.full(n, current),
        "temperature_c": np.full(n, 30.0),
        **more,
    }
    return assemble(RawRun(name, Path(name), channels, rate_hz=rate))


def noise(n, sigma, seed=3):
    return sigma * np.random.default_rng(seed).standard_normal(n)


def motions():
    """Name to (displacement, velocity) of motions that benches and roads make, 12 s at 1 kHz."""
    t = np.arange(12_000) / RATE
    rng = np.random.default_rng(7)
    b, a = signal.butter(2, [0.8 / 500, 15 / 500], "band")
    shapes = {
        "slow sine": 0.025 * np.sin(2 * np.pi * 0.3 * t),
        "dyno sine": 0.0127 * np.sin(2 * np.pi * 2.387 * t),
        "fast sine": 0.002 * np.sin(2 * np.pi * 14 * t),
        "ramped sine": 0.0127 * np.clip(t / 2, 0, 1) * np.sin(2 * np.pi * 2.387 * t),
        "triangle": 0.02 * signal.sawtooth(2 * np.pi * 0.5 * t, 0.5),
        "three sines": 0.008 * (np.sin(5 * t) + 0.4 * np.sin(23 * t + 1) + 0.1 * np.sin(80 * t)),
        "sweep": 0.008 * signal.chirp(t, 0.5, 12, 12) / (1 + t / 4),
        "road": 0.05 * signal.lfilter(b, a, rng.standard_normal(len(t))),
    }
    return {name: (x, np.gradient(x, 1 / RATE)) for name, x in shapes.items()}


def forces(x, v):
    """Forces of sound dampers with everything that may look odd."""
    a = np.gradient(v, 1 / RATE)
    late = np.concatenate((np.full(5, v[0]), v))[: len(v)]

    def base(v, a=0.0):
        return 1400 * np.tanh((v - 0.003 * a) / 0.05) + 1500 * v

    return {
        "plain": base(v),
        "hysteretic": base(v, a),
        "gas force": base(v) + 300 + 4000 * x,
        "stiff gas spring, off": 300 * np.tanh(v / 0.05) + 400 * v + 9000 * x,
        "friction": 100 * np.sign(v) + 600 * v,
        "fluid inertia": base(v) + 15 * a,
        "5 ms late": base(late),
        "one-sided": np.where(v > 0, 1.0, 0.2) * base(v),
        "load cell off by 80 N": base(v) + 80,
    }


@pytest.mark.parametrize("motion", motions())
@pytest.mark.parametrize("damper", forces(np.zeros(9), np.zeros(9)))
def test_sound_dampers_in_all_motions_raise_no_error(motion, damper):
    x, v = motions()[motion]
    force = forces(x, v)[damper] + noise(len(v), 5.0)
    measured = v + noise(len(v), 2e-3 * np.std(v), seed=4)
    findings = check_run(run_of(measured, force))
    assert [str(finding) for finding in findings if finding.level == "error"] == []
    assert [str(finding) for finding in findings if "flipped" in finding.what] == []


@pytest.mark.parametrize("motion", motions())
@pytest.mark.parametrize("damper", forces(np.zeros(9), np.zeros(9)))
def test_what_no_cable_made_is_no_spike(motion, damper):
    x, v = motions()[motion]
    force = forces(x, v)[damper] + noise(len(v), 5.0)
    assert not list(check_spikes(run_of(v, force)))


def test_a_struck_cable_is_told_with_its_row():
    _, v = motions()["dyno sine"]
    force = 900.0 * np.tanh(v / 0.03) + noise(len(v), 5.0)
    force[[300, 7000]] += 4000.0
    force[9000:] += 800.0  # a step is no spike
    (found,) = check_spikes(run_of(v, force))
    assert (found.level, found.row) == ("warning", run_of(v, force).row(300))
    assert "force_N leaps by 4e+03 for a single sample, 2 times" in found.what


def test_an_accelerometer_that_was_struck_is_told_and_a_derived_acceleration_is_not_asked():
    _, v = motions()["dyno sine"]
    run = run_of(v, 900.0 * np.tanh(v / 0.03) + noise(len(v), 5.0))
    struck = np.gradient(v, run.dt_s) + noise(len(v), 0.3, seed=5)
    struck[[300, 7000]] += 700.0
    (found,) = check_spikes(replace(run, acceleration_m_s2=struck, derived=()))
    assert "acceleration_m_s2 leaps by 700 for a single sample, 2 times" in found.what
    assert "velocity's slope is taken" in found.mend
    (found,) = check_spikes(
        replace(run, acceleration_m_s2=struck, derived=("velocity_m_s", "displacement_m"))
    )
    assert "cut the samples out" in found.mend  # nothing else knows the motion
    assert not list(check_spikes(replace(run, acceleration_m_s2=struck, derived=("acceleration_m_s2",))))


@pytest.mark.parametrize(("zero_a", "level"), [(0.0, "warning"), (-0.5, "error")])
def test_noise_at_no_current_is_no_clamp_turned_round(zero_a, level):
    _, v = motions()["dyno sine"]
    force = 900.0 * np.tanh(v / 0.03) + noise(len(v), 5.0)
    run = run_of(v, force, current=0.0)
    run = replace(run, current_a=zero_a + np.clip(noise(len(v), 0.02), -0.06, 0.06))
    assert [f.level for f in check_run(run) if "current_A" in f.what] == [level]


@pytest.mark.parametrize("motion", motions())
def test_a_flipped_sign_is_found_in_all_motions(motion):
    x, v = motions()[motion]
    for damper in ("plain", "hysteretic", "gas force", "5 ms late", "friction"):
        force = forces(x, v)[damper] + noise(len(v), 5.0)
        errors = [finding.what for finding in check_run(run_of(v, -force)) if finding.level == "error"]
        assert len(errors) == 1, damper
        assert "flipped" in errors[0]


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_coarse_converters_are_not_called_clipped_or_stuck(bits):
    for x, v in motions().values():
        force = forces(x, v)["hysteretic"] + noise(len(v), 5.0)
        steps = 2 ** (bits - 1)
        coarse = [np.round(c / np.max(np.abs(c)) * steps) / steps * np.max(np.abs(c)) for c in (v, force)]
        errors = [str(finding) for finding in check_run(run_of(*coarse)) if finding.level == "error"]
        assert errors == []


def test_clean_data_of_a_saturating_model_raise_no_error():
    _, v = motions()["dyno sine"]
    for force in (1500 * np.tanh(v / 0.004), 1500 * np.clip(v / 0.05, -1, 1), 500 * np.sign(v)):
        assert [str(finding) for finding in check_run(run_of(v, force)) if finding.level == "error"] == []


@pytest.mark.parametrize(
    ("motion", "share"),
    [("dyno sine", 0.6), ("dyno sine", 0.95), ("dyno sine", 0.99), ("slow sine", 0.8), ("road", 0.5)],
)
def test_clipping_is_found_down_to_the_last_percent(motion, share):
    x, v = motions()[motion]
    force = forces(x, v)["hysteretic"] + noise(len(v), 1.0)
    limit = share * np.max(force)
    findings = check_run(run_of(v, np.minimum(force, limit)))
    assert any("clipped" in finding.what and f"{limit:.6g}" in finding.what for finding in findings)


def test_a_delay_that_all_runs_share_is_told_from_elasticity():
    def campaign(delay, travel):
        runs = []
        for frequency, amplitude in ((0.5, 0.02), (1.0, 0.02), (2.0, 0.015), (4.0, 0.008), (6.0, 0.005)):
            motion = sine(frequency, 10.3, 2000, amplitude, third=0.0)
            # The play of an elastic element: force follows the motion less what the element takes up.
            follower = np.empty_like(motion.x)
            taken = 0.0
            for index, x in enumerate(motion.x):
                taken = min(max(taken, x - travel), x + travel)
                follower[index] = (x - taken) / travel
            force = 1500 * follower + 300 * np.tanh(motion.v / 0.1)
            late = int(delay * 2000)
            force = np.concatenate((np.full(late, force[0]), force))[: len(force)] + noise(len(force), 5.0)
            runs.append(run_of(motion.v + noise(len(force), 1e-4), force, rate=2000, name=f"{frequency}.csv"))
        return Campaign(Path(), tuple(runs), "")

    late = [finding for finding in check_campaign(campaign(0.012, 5e-5)) if "late" in finding.what]
    assert len(late) == 1
    assert late[0].level == "warning"
    assert 10 < float(late[0].what.split("comes ")[1].split(" ms")[0]) < 14
    assert check_campaign(campaign(0.0, 2e-4)) == []
    assert check_campaign(campaign(0.0, 5e-5)) == []


def test_the_real_sines_and_the_real_recording_are_sound(utfsm, sines_map, raw_map):
    assert require_sound(load_campaign(utfsm, sines_map)) == []
    warnings = require_sound(load_campaign(utfsm, raw_map))
    assert len(warnings) == 5
    assert all("no motion in rows" in str(warning) for warning in warnings)


@pytest.mark.parametrize(
    ("factor", "said"),
    [(1.04, None), (1.1, "warning"), (0.6, "error"), (9.80665, "in g?"), (1 / 9.80665, "in g?")],
)
def test_acceleration_is_held_against_velocity(factor, said):
    motion = sine()
    run = run_of(motion.v, damper_force(motion), acceleration_m_s2=motion.a / factor)
    findings = [str(finding) for finding in check_run(run)]
    assert len(findings) == (said is not None)
    assert said is None or said in findings[0]


@pytest.mark.parametrize(("factor", "levels"), [(1.0, []), (0.6, ["error"])])
def test_noise_of_an_accelerometer_is_no_scale_of_the_velocity(factor, levels):
    """A slope alone would say that the velocity is 0.81 times what it measured."""
    motion = sine(amplitude=0.0055)
    noisy = motion.a + 0.8 * np.random.default_rng(2).normal(size=motion.v.size)
    run = run_of(motion.v, damper_force(motion), acceleration_m_s2=noisy / factor)
    assert [f.level for f in check_run(run) if "adds up to" in f.what] == levels


def test_a_unit_that_a_person_stated_is_believed(tmp_path):
    table = rows()
    table[:, 3] = 170.0
    path = write_csv(tmp_path / "hot.csv", table)
    assert [finding.level for finding in check_run(load_run(path))] == ["error"]
    (tmp_path / "map.yaml").write_text(
        "columns:\n  time_s: 1\n  velocity_m_s: 2\n  current_A: 3\n  force_N: 5\n"
        "  temperature_C: {column: 4, unit: degC}\n"
    )
    findings = check_run(load_run(path, tmp_path / "map.yaml"))
    assert [finding.level for finding in findings] == ["warning"]
    assert "kept" in str(findings[0])


@pytest.mark.parametrize(
    ("weak_n", "strong_n", "errors"), [(8.0, 90.0, 0), (8.0, 9.0, 2), (2.3, 2300.0, 1), (8.0, 1500.0, 1)]
)
def test_a_weak_run_is_in_kilonewtons_unless_another_shows_a_weak_damper(weak_n, strong_n, errors):
    motion = sine()
    unit = damper_force(motion) / np.max(np.abs(damper_force(motion)))
    runs = tuple(run_of(motion.v, size * unit, name=f"{k}.csv") for k, size in enumerate((weak_n, strong_n)))
    findings = check_campaign(Campaign(Path("weak"), runs, "0" * 64))
    assert [finding.level for finding in findings] == (["error"] * errors or ["warning"])
    assert all("in kN?" in str(finding) for finding in findings)


def test_runs_without_force_or_current_are_judged_by_what_they_have(tmp_path):
    path = write_csv(tmp_path / "v.csv", rows()[:, [0, 1, 3]], header="time_s,velocity_m_s,temperature_C")
    assert check_run(load_run(path, need_force=False, need_current=False)) == []


def test_a_run_made_in_memory_is_judged_like_one_that_was_read():
    motion = sine()
    run = run_of(motion.v, damper_force(motion))
    broken = run.force_n.copy()
    broken[40] = np.nan
    object.__setattr__(run, "force_n", broken)
    findings = check_run(run)
    assert [str(finding) for finding in findings] == [
        "error: run.csv:41: force_N is not finite in 1 rows; fill in the values, or remove the rows"
    ]


@pytest.mark.parametrize("protocol", ["grid", "steps", "sweeps", "road"])
def test_campaigns_of_the_virtual_dyno_are_sound(protocol):
    assert [str(finding) for finding in check_campaign(Bench().campaign(protocol))] == []


@pytest.mark.parametrize(("hz", "low"), [(2.5, False), (2.502, False), (4.0, True)])
def test_a_rate_is_low_below_what_the_mend_asks_for_and_not_at_it(hz, low):
    t = np.arange(600) / 50.0
    v = 0.3 * np.sin(2.0 * np.pi * hz * t)
    run = run_of(v, 800.0 * np.tanh(v / 0.05) + noise(t.size, 3.0), rate=50.0)
    assert any("the sample rate is low" in str(one) for one in check_run(run)) is low
