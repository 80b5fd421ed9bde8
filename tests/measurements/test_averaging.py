"""Force and motion that were stored as moving means are known as such, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mrctl.measurements import moving_means
from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.averaging import averaged_over_s, behind, believed, sharpened
from mrctl.measurements.moving_means import smoothed
from mrctl.measurements.run import FloatArray, Run

RATE_HZ = 500.0


def measured(seconds: float = 12.0, hz: float = 1.3, seed: int = 0) -> dict[str, FloatArray]:
    """A damper on a press, with the noise of its sensors."""
    random = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    x = 0.01 * np.sin(2 * np.pi * hz * t)
    v = np.gradient(x, t)
    force = 800.0 * np.tanh(v / 0.01) + 2e3 * v + random.normal(0.0, 3.0, t.size)
    return {"displacement_m": x + random.normal(0.0, 1e-6, t.size), "force_n": force}


def trailing(x: FloatArray, samples: int) -> FloatArray:
    """The mean of each sample and those before it, as data loggers take it."""
    return np.convolve(x, np.full(samples, 1.0 / samples))[samples - 1 : x.size]


def loaded(channels: dict[str, FloatArray]) -> Run:
    constants = {"current_a": np.ones(1), "temperature_c": np.full(1, 22.0)}
    return assemble(RawRun("run", Path("run.csv"), channels | constants, rate_hz=RATE_HZ))


@settings(max_examples=25, deadline=None)
@given(samples=st.integers(4, 200), hz=st.floats(0.3, 4.0), seed=st.integers(0, 1000))
@example(samples=200, hz=2.3, seed=0)
def test_a_moving_mean_is_found_with_its_window(samples: int, hz: float, seed: int) -> None:
    cycles = samples / RATE_HZ * hz
    assume(abs(cycles - round(cycles)) > 0.05 or cycles < 0.5)  # whole cycles leave no motion
    stored = {name: trailing(x, samples) for name, x in measured(hz=hz, seed=seed).items()}
    window = averaged_over_s(stored["force_n"], stored["displacement_m"], 1.0 / RATE_HZ)
    assert window == pytest.approx(samples / RATE_HZ)


@settings(max_examples=25, deadline=None)
@given(hz=st.floats(0.3, 4.0), seed=st.integers(0, 1000))
def test_channels_as_sampled_are_no_moving_mean(hz: float, seed: int) -> None:
    assert loaded(measured(hz=hz, seed=seed)).averaged_s == 0.0


def test_one_averaged_channel_alone_changes_nothing() -> None:
    channels = measured()
    force = trailing(channels["force_n"], 40)
    assert averaged_over_s(force, channels["displacement_m"][: force.size], 1.0 / RATE_HZ) == 0.0


def test_a_run_says_that_it_is_averaged() -> None:
    run = loaded({name: trailing(x, 50) for name, x in measured().items()})
    assert run.averaged_s == pytest.approx(0.1)
    assert any("moving means over 100 ms" in note for note in run.notes)


def test_what_one_run_of_many_shows_is_no_mean_and_nothing_else_of_it_changes() -> None:
    averaged = loaded({name: trailing(x, 50) for name, x in measured().items()})
    plain = loaded(measured(seed=1))
    one, *others = believed((averaged, plain, plain))
    assert one.averaged_s == 0.0
    assert not any("moving means" in note for note in one.notes)
    assert len(one.notes) == len(averaged.notes) - 1
    assert others == [plain, plain]
    assert believed((averaged, plain, averaged)) == (averaged, plain, averaged)


def test_the_damper_behind_the_mean_gives_the_stored_force() -> None:
    run = behind(loaded({name: trailing(x, 50) for name, x in measured().items()}))
    static = 800.0 * np.tanh(run.velocity_m_s / 0.01) + 2e3 * run.velocity_m_s
    force = smoothed(static, run.averaged_s * run.sample_rate_hz)
    middle = slice(100, -100)
    miss = np.std(run.force_n[middle] - force[middle])
    blind = np.std(run.force_n - 800.0 * np.tanh(run.velocity_m_s / 0.01) - 2e3 * run.velocity_m_s)
    assert miss < 0.01 * np.std(run.force_n)
    assert blind > 5.0 * miss


@settings(max_examples=40, deadline=None)
@given(samples=st.floats(1.0, 30.0), seed=st.integers(0, 1000))
def test_the_mean_is_that_of_the_lines_between_samples(samples: float, seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=60)
    offsets = np.linspace(-0.5, 0.5, 20001) * samples
    wanted = [np.trapezoid(np.interp(k + offsets, np.arange(60), x), offsets) / samples for k in range(60)]
    np.testing.assert_allclose(smoothed(x, samples) if samples > 1.0 else wanted, wanted, atol=2e-4)


def test_sharpening_leaves_a_line_and_restores_a_sine() -> None:
    t = np.arange(2000) / 100.0
    sine = np.sin(2 * np.pi * 0.5 * t)
    middle = slice(100, -100)
    assert np.max(np.abs(sharpened(smoothed(sine, 20.0), 20.0) - sine)[middle]) < 5e-4
    np.testing.assert_allclose(sharpened(smoothed(t, 20.0), 20.0)[middle], t[middle])


@pytest.mark.parametrize("forward", [False, True])
def test_a_velocity_that_is_the_step_of_displacement_is_derived_anew(*, forward: bool) -> None:
    channels = {name: trailing(values, 50) for name, values in measured().items()}
    x = channels["displacement_m"]
    step = np.diff(x) * RATE_HZ
    channels["velocity_m_s"] = np.append(step, step[-1]) if forward else np.append(step[0], step)
    run = loaded(channels)
    assert "velocity_m_s" in run.derived
    assert any("half a sample" in note for note in run.notes)


def test_a_velocity_whose_sum_the_displacement_may_be_is_kept() -> None:
    channels = measured()
    channels["velocity_m_s"] = np.diff(channels["displacement_m"], prepend=0.0) * RATE_HZ
    assert "velocity_m_s" not in loaded(channels).derived


def test_a_velocity_of_its_own_is_kept() -> None:
    channels = {name: trailing(values, 50) for name, values in measured().items()}
    channels["velocity_m_s"] = np.gradient(channels["displacement_m"], 1.0 / RATE_HZ)
    assert "velocity_m_s" not in loaded(channels).derived


def test_a_run_that_is_no_mean_is_left_as_it_is() -> None:
    run = replace(loaded(measured()), averaged_s=0.0)
    assert behind(run) is run
    assert smoothed(run.force_n, run.averaged_s * run.sample_rate_hz) is run.force_n


@pytest.mark.parametrize("samples", [1.4, 2.0, 3.0, 7.3, 40.0])
def test_a_plain_installation_averages_as_a_desk_does(monkeypatch, samples):
    x = np.random.default_rng(2).normal(size=(3, 30))
    compiled = smoothed(x, samples)
    monkeypatch.setattr(moving_means, "_loop", lambda: moving_means.running_means)
    assert smoothed(x, samples) == pytest.approx(compiled, abs=1e-12)
    between = np.linspace(-0.5 * samples, 0.5 * samples, 200_001)
    fine = [np.mean(np.interp(k + between, np.arange(30.0), row)) for row in x for k in (0, 11, 29)]
    assert compiled[:, [0, 11, 29]].ravel() == pytest.approx(fine, abs=1e-4)
