"""Comparisons whose answer is known: an effect was added, and the place of the failure follows."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace

import numpy as np
import pytest
from discover.campaigns import CALIBRATION, campaign, coloured, grid, road, sine, with_effect

from mrctl.cli.compare import add_arguments, run
from mrctl.discover.compare import compare, figures
from mrctl.measurements import write_run_csv


def test_a_true_model_errs_by_the_noise_and_fails_nowhere(damper):
    result = compare(damper, grid(damper))
    assert result.rmse_n == pytest.approx(20.0, rel=0.02)
    assert result.noise_floor_n == pytest.approx(20.0, rel=0.02)
    assert result.worst == ()


def test_coloured_noise_alone_is_no_failure(damper):
    noise = lambda rng, n: coloured(rng, n, 20.0, 0.98)  # noqa: E731 - one use
    false = 0
    for seed in range(20):
        false += len(compare(damper, campaign(sine(damper, noise=noise, seed=seed))).worst) > 0
    assert false <= 1


def test_the_figures_are_those_of_their_definitions(damper):
    runs = (sine(damper), sine(damper, current_a=2.0, name="two.csv"))
    result = compare(damper, campaign(*runs))
    residual = np.concatenate([fit.residual_n for fit in result.runs])
    force = np.concatenate([one.force_n for one in runs])
    share = np.linalg.norm(residual) / np.linalg.norm(force - force.mean())
    assert result.fit_percent == pytest.approx(100.0 * (1.0 - share))
    assert result.rmse_n == pytest.approx(np.sqrt(np.mean(residual**2)))
    assert sum(fit.residual_n.size for fit in result.runs) == force.size
    octaves = np.sqrt(sum(band.rms_n**2 for band in result.bands))
    assert octaves == pytest.approx(result.rmse_n, rel=0.01)


def test_a_hidden_gas_spring_shows_at_the_ends_of_the_stroke(damper):
    hidden = with_effect(damper, "gas_spring", preload_n=0.0, stiffness_n_m=12000.0, progression_per_m=0.0)
    worst = compare(damper, grid(hidden)).worst
    assert worst[0].variable == "displacement_m"
    ends = [c for c in worst if c.variable == "displacement_m"]
    assert all(c.low > 0.01 or c.high < -0.01 for c in ends)
    assert {np.sign(c.bias_n) for c in ends} == {-1.0, 1.0}


def test_a_hidden_quadratic_damping_shows_at_high_speed_and_as_too_little(damper):
    hidden = with_effect(damper, "quadratic_damping", coefficient_n_s2_m2=2000.0)
    worst = compare(damper, grid(hidden)).worst
    speed = [c for c in worst if c.variable == "velocity_m_s"]
    assert {c.words.split("(")[1].split(")")[0] for c in speed} == {"rebound", "compression"}
    assert all(c.low > 0.2 or c.high < -0.2 for c in speed)
    assert all("too little" in c.words for c in speed)


def test_a_road_has_an_unknown_floor_in_json(damper):
    told = figures(compare(damper, campaign(road(damper))))
    assert told["noise_floor_n"] is None
    assert told["runs"][0]["noise_lower_bound_n"] > 0.0


def test_the_command_writes_json_and_a_report(damper, tmp_path, capsys):
    (tmp_path / "data").mkdir()
    for k, amps in enumerate((0.5, 1.5)):
        write_run_csv(sine(damper, current_a=amps, seed=k), tmp_path / "data" / f"{k}.csv")
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    words = [str(CALIBRATION), str(tmp_path / "data"), "--json", "-", "--report", str(tmp_path / "r.html")]
    assert run(parser.parse_args(words)) == 0
    told = json.loads(capsys.readouterr().out)
    assert {"rmse_n", "fit_percent", "noise_floor_n", "runs", "worst"} <= set(told)
    assert [set(one) >= {"file", "rmse_n", "fit_percent", "rmse_percent"} for one in told["runs"]] == [
        True,
        True,
    ]
    assert (tmp_path / "r.html").read_text().startswith("<!DOCTYPE html>")
    assert run(parser.parse_args(words[:2])) == 0
    assert "Where it fails" in capsys.readouterr().out


def test_a_model_that_fails_everywhere_alike_is_not_said_to_fail_nowhere(damper):
    result = compare(damper, campaign(sine(damper), sine(damper, current_a=2.0, name="two.csv")))
    assert result.nowhere == "nowhere significantly worse than on average"
    worse = replace(result, rmse_n=10.0 * result.noise_floor_n)
    assert "10 times the noise; most in " in worse.nowhere


@pytest.mark.parametrize(("times", "told"), [(1.0, False), (0.5, False), (180.0, True), (0.01, True)])
def test_the_calibration_of_a_damper_of_another_size_is_told(damper, times, told):
    large = (
        tuple(times * x for x in damper.static.force_n),
        tuple(times * x for x in damper.static.blend_force_n),
    )
    static = damper.static._replace(force_n=large[0], blend_force_n=large[1])
    result = compare(replace(damper, static=static), campaign(sine(damper, seed=3)))
    assert (result.of_another is not None) is told
    assert result.force_ratio == pytest.approx(times, rel=0.05)
