"""The noise floor against noise that is known."""

from __future__ import annotations

import numpy as np
import pytest
from discover.campaigns import coloured, road, silence, sine

from mrctl.discover.noise.noise_floor import find_cycles, noise_floor, pooled_floor, quantisation_step


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.95], ids=["white", "5 samples", "20 samples"])
@pytest.mark.parametrize("cycles", [4.3, 9.4, 25.3])
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0, 2000.0])
def test_the_floor_is_the_noise_within_ten_percent(damper, rate_hz, cycles, pole):
    found = []
    for seed in range(6 if cycles < 9 else 2):  # coloured noise in four cycles varies by itself
        noise = lambda rng, n: coloured(rng, n, 20.0, pole)  # noqa: E731 - one use
        found.append(noise_floor(sine(damper, rate_hz, cycles, noise=noise, seed=seed)))
    assert {f.method for f in found} == {"cycles"}
    assert {f.cycles for f in found} == {int(cycles) - 1}
    assert pooled_floor(found, [1] * len(found)) == pytest.approx(20.0, rel=0.1)


def test_a_quantised_sensor_has_the_noise_of_its_step(damper):
    run = sine(damper, noise=silence)
    force = np.round(run.force_n / 40.0) * 40.0
    coarse = type(run)(**{**{f: getattr(run, f) for f in run.__dataclass_fields__}, "force_n": force})
    assert quantisation_step(force) == 40.0
    assert noise_floor(coarse).floor_n == pytest.approx(np.std(force - run.force_n), rel=0.1)


def test_without_noise_the_floor_is_next_to_nothing(damper):
    assert noise_floor(sine(damper, noise=silence)).floor_n < 1.0


def test_coloured_noise_leaves_fewer_independent_samples(damper):
    white = noise_floor(sine(damper))
    red = noise_floor(sine(damper, noise=lambda rng, n: coloured(rng, n, 20.0, 0.9)))
    n = len(sine(damper))
    assert white.effective_samples == pytest.approx(n, rel=0.25)
    assert red.effective_samples == pytest.approx(n / 19.0, rel=0.4)


def test_a_heating_damper_drifts_and_is_no_noisier(damper):
    steady, heating = noise_floor(sine(damper)), noise_floor(sine(damper, heating=0.2))
    assert heating.floor_n == pytest.approx(20.0, rel=0.1)
    assert heating.drift_n > 40.0
    assert steady.drift_n < 5.0


def test_a_road_has_no_floor_but_a_bound_that_is_below_the_noise(damper):
    found = noise_floor(road(damper))
    assert found.floor_n is None
    assert 0.0 < found.lower_bound_n < 22.0
    assert pooled_floor([found], [1]) is None


def test_a_current_that_changes_within_cycles_is_not_taken_for_noise(damper):
    run = sine(damper)
    current = 1.0 + 0.5 * np.sin(2 * np.pi * 0.9 * run.time_s)
    changed = type(run)(**{**{f: getattr(run, f) for f in run.__dataclass_fields__}, "current_a": current})
    assert find_cycles(changed) is None


def test_a_damper_at_rest_has_no_cycles(damper):
    assert noise_floor(sine(damper, amplitude_m=0.0)).floor_n is None


def test_what_a_residual_does_not_repeat_is_told_from_what_it_does(damper):
    run = sine(damper, 500.0, 12.4)
    floor = noise_floor(run)
    rng = np.random.default_rng(7)
    skipped = 130  # samples at the start that a fit leaves out
    phase = 2.0 * np.pi * np.arange(len(run)) / floor.steady.period
    error = (40.0 * np.sin(3.0 * phase) + rng.normal(0.0, 6.0, len(run)))[skipped:]
    assert np.sqrt(floor.unrepeated(error)) == pytest.approx(6.0, rel=0.1)
    assert floor.unrepeated(error[-int(2.5 * floor.steady.period) :]) is None
    assert noise_floor(road(damper)).unrepeated(error) is None
