from __future__ import annotations

import numpy as np
import pytest

from mrctl.calibration import load_calibration
from mrctl.errors import InputError
from mrctl.measurements import check_campaign, load_campaign
from mrctl.model.effects.base import EffectError
from mrctl.model.effects.registry import effect
from mrctl.model.pipeline import ForwardPipeline
from mrctl.plant.dyno import motion
from mrctl.plant.dyno.campaign import Bench, with_typical, write_campaign
from mrctl.plant.dyno.protocols import PROTOCOLS
from mrctl.share_path import share_file


@pytest.mark.parametrize("name", PROTOCOLS)
def test_velocity_is_the_rate_of_displacement_and_both_start_and_end_at_rest(name):
    for drive in Bench().drives(name):
        x, v = drive.motion.displacement_m, drive.motion.velocity_m_s
        assert x[0] == v[0] == 0.0
        assert abs(x[-1]) < 1e-4
        assert abs(v[-1]) < 3e-3
        stroke = np.cumsum(0.5 * (v[1:] + v[:-1])) / drive.rate_hz
        assert np.max(np.abs(stroke - x[1:])) < 2e-5
        assert len(drive.current_a) == len(drive.motion)
        assert 0.0 <= drive.current_a.min() <= drive.current_a.max() <= 3.0


@pytest.mark.parametrize("name", PROTOCOLS)
def test_runs_of_a_protocol_have_names_of_their_own(name):
    names = [drive.name for drive in Bench().drives(name)]
    assert len(set(names)) == len(names) > 0


def test_the_paper_protocol_is_forty_runs_of_nine_cycles_at_2000_hz():
    drives = Bench().drives("paper")
    assert len(drives) == 40
    assert {d.current_a.mean() for d in drives} == {0.0, 1.0, 2.0, 3.0}
    assert {round(1.8 * d.temperature_c + 32) for d in drives} == {
        84,
        97,
        111,
        122,
        132,
        141,
        151,
        162,
        171,
        181,
    }
    for drive in drives:
        assert len(drive.motion) == pytest.approx(9 / 2.387 * 2000, abs=2)
        assert np.max(drive.motion.displacement_m) == pytest.approx(0.0254, rel=1e-3)
        assert np.max(drive.motion.velocity_m_s) == pytest.approx(2 * np.pi * 2.387 * 0.0254, rel=1e-3)


def test_the_same_seed_gives_the_same_measurement_and_another_seed_does_not():
    drive = Bench().drives("paper")[7]
    again = [Bench(seed=s).measure(drive).run.force_n for s in (3, 3, 4)]
    assert np.array_equal(again[0], again[1])
    assert not np.array_equal(again[0], again[2])
    assert not np.array_equal(
        Bench(seed=1).drives("road")[0].current_a, Bench(seed=2).drives("road")[0].current_a
    )


def test_the_force_starts_smaller_than_it_goes_on():
    item = Bench(noise_n=0.0).measure(Bench().drives("paper")[20])
    cycle = round(2000 / 2.387)
    peaks = [np.max(-(item.run.force_n[k * cycle : (k + 1) * cycle])) for k in range(8)]
    assert peaks[0] < 0.99 * peaks[3]


def test_noise_has_the_rms_that_was_asked_for_and_zero_is_the_truth():
    drive = Bench().drives("paper")[0]
    noisy = Bench(noise_n=8.0).measure(drive)
    assert np.std(noisy.run.force_n - noisy.truth.force_n) == pytest.approx(8.0, rel=0.05)
    exact = Bench(noise_n=0.0).measure(drive)
    assert np.array_equal(exact.run.force_n, exact.truth.force_n)
    assert np.array_equal(exact.run.velocity_m_s, drive.motion.velocity_m_s)


def test_a_written_campaign_reads_back_as_the_one_in_memory_and_is_sound(tmp_path):
    bench = Bench(seed=5)
    write_campaign(bench, "single", tmp_path / "c")
    read = load_campaign(tmp_path / "c")
    kept = bench.campaign("single").runs[0]
    for name in ("time_s", "velocity_m_s", "current_a", "temperature_c", "force_n", "displacement_m"):
        assert np.array_equal(getattr(read.runs[0], name), getattr(kept, name)), name
    assert [f for f in check_campaign(read) if f.level == "error"] == []


def test_a_folder_with_other_runs_is_not_written_into(tmp_path):
    (tmp_path / "other.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds 1 CSV files already, other\.csv first; name a new folder"):
        write_campaign(Bench(), "single", tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["other.csv"]


def test_an_unknown_protocol_names_the_known_ones():
    with pytest.raises(InputError, match="no protocol 'x'; take one of paper, grid"):
        Bench().drives("x")


def test_a_velocity_sweep_keeps_its_limits():
    moving = motion.velocity_sweep(0.5, 15.0, 0.38, 0.03, 15.0, 2000.0)
    assert np.max(np.abs(moving.displacement_m)) < 0.0301
    assert np.max(np.abs(moving.velocity_m_s)) < 0.385
    late = slice(-4000, -2000)
    assert np.max(np.abs(moving.velocity_m_s[late])) > 0.36


def test_road_like_motion_has_the_asked_speed_and_no_jump():
    moving = motion.road_like(np.random.default_rng(1), 0.13, 15.0, 1000.0)
    assert np.sqrt(np.mean(moving.velocity_m_s**2)) == pytest.approx(0.13, rel=0.1)
    assert np.max(np.abs(np.diff(moving.velocity_m_s))) < 0.13


def test_a_calibrations_damper_is_measured_to_the_letter_with_what_is_hidden_in_it():
    plain = load_calibration(share_file("config/calibration.yaml")).damper
    drive = Bench().drives("single", 500.0)[0]
    x = drive.motion.displacement_m
    known, hidden = (
        Bench(d, noise_n=0.0).measure(drive) for d in (plain, with_typical(plain, ["gas_spring"]))
    )
    forward = ForwardPipeline(plain, 1.0 / drive.rate_hz)
    forward.settle(0.0, drive.current_a[0], drive.temperature_c, 0.0)
    signals = zip(drive.motion.velocity_m_s, drive.current_a, x, strict=True)
    steps = [forward.step(v, i, drive.temperature_c, stroke) for v, i, stroke in signals]
    np.testing.assert_allclose(known.truth.force_n, steps, atol=1e-6)
    spring = effect("gas_spring").typical
    stiffness = np.polyfit(x, hidden.truth.force_n - known.truth.force_n, 1)[0]
    assert stiffness == pytest.approx(spring[1], rel=0.2)


def test_an_unknown_effect_cannot_be_hidden():
    with pytest.raises(EffectError, match="there is no effect ghost"):
        with_typical(load_calibration(share_file("config/calibration.yaml")).damper, ["ghost"])
