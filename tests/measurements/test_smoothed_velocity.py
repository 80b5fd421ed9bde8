"""A velocity column that is the file's stroke, differentiated and smoothed, is told from a second sensor."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.smoothed_velocity import less_smoothed, made_of_stroke

RATE_HZ = 400.0
STROKE_NOISE_M, SPEED_NOISE_M_S = 3e-6, 4e-4


def measured(corner_s=0.01, seconds=8.0, fineness=1e-6):
    """Time, true velocity and measured stroke of a triangle whose corners take that long."""
    fine_hz = 50.0 * RATE_HZ
    t = np.arange(0.0, seconds, 1.0 / fine_hz)
    corner = np.hanning(max(3, round(corner_s * fine_hz)))
    v = np.convolve(0.06 * np.sign(np.sin(2.0 * np.pi * 3.0 * t)), corner / corner.sum(), mode="same")
    x = np.cumsum(v) / fine_hz
    t, v, x = t[::50], v[::50], x[::50]
    x = x + STROKE_NOISE_M * np.random.default_rng(1).standard_normal(x.size)
    return t, v, np.round(x / fineness) * fineness


def differentiated(x, cut_off_hz=None, fineness=1e-6):
    v = np.gradient(x, 1.0 / RATE_HZ)
    if cut_off_hz:
        v = filtfilt(*butter(2, cut_off_hz, fs=RATE_HZ), v)
    return np.round(v / fineness) * fineness


def run_of(v, x, name="run"):
    """A run whose file says that its velocity is v and its stroke x."""
    steady = np.ones(x.size)
    channels = {
        "time_s": np.arange(x.size) / RATE_HZ,
        "velocity_m_s": v,
        "displacement_m": x,
        "current_a": steady,
        "temperature_c": 25.0 * steady,
        "force_n": 600.0 * np.tanh(v / 0.02),
    }
    return assemble(RawRun(name, Path(f"{name}.csv"), channels))


def derived(run):
    return any("derived anew" in note for note in run.notes)


@pytest.mark.parametrize(
    ("corner_s", "cut_off_hz", "smoothed"),
    [
        (0.01, 50.0, True),
        (0.01, None, False),  # nothing is taken away
        (0.3, 50.0, False),  # what is taken away is noise
    ],
)
def test_smoothing_that_takes_the_corners_away_is_seen(corner_s, cut_off_hz, smoothed):
    _, _, x = measured(corner_s)
    (run,) = less_smoothed([run_of(differentiated(x, cut_off_hz), x)])
    assert derived(run) is smoothed


@pytest.mark.parametrize("cut_off_hz", [None, 50.0])
def test_a_sensor_of_its_own_is_left_as_it_is(cut_off_hz):
    """Also one that is as slow: it has noise of its own, and whose it is nobody knows."""
    _, v, x = measured()
    v = v + SPEED_NOISE_M_S * np.random.default_rng(2).standard_normal(v.size)
    if cut_off_hz:
        v = filtfilt(*butter(2, cut_off_hz, fs=RATE_HZ), v)
    assert made_of_stroke(v, x, 1.0 / RATE_HZ) is False
    own = run_of(v, x)
    assert less_smoothed([own])[0] is own


def test_runs_of_one_program_decide_together():
    """A slow motion alone would keep the smoothed velocity: then its noise would be of another kind."""
    (_, _, sharp), (_, _, slow) = measured(), measured(0.3)
    runs = [run_of(differentiated(x, 50.0), x) for x in (sharp, sharp, slow)]
    assert [derived(run) for run in less_smoothed(runs)] == [True, True, True]
    assert [derived(run) for run in less_smoothed(runs[2:])] == [False]
    _, v, x = measured()
    own = run_of(v + SPEED_NOISE_M_S * np.random.default_rng(2).standard_normal(v.size), x)
    assert not any(derived(run) for run in less_smoothed([runs[0], own, own]))


def test_what_is_derived_anew_is_nearer_to_the_truth_and_said():
    _, v, x = measured()
    column = differentiated(x, 50.0)
    (run,) = less_smoothed([run_of(column, x)])
    assert derived(run)
    assert run.derived == ("velocity_m_s", "acceleration_m_s2")
    inside = slice(20, -20)
    assert np.std((run.velocity_m_s - v)[inside]) < 0.8 * np.std((column - v)[inside])


def test_short_and_still_runs_do_not_tell():
    _, _, x = measured(seconds=0.2)
    assert made_of_stroke(differentiated(x, 50.0), x, 1.0 / RATE_HZ) is None
    still = np.zeros(4000)
    assert made_of_stroke(still, still, 1.0 / RATE_HZ) is None
