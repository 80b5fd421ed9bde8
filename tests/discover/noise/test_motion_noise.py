"""The noise of a velocity is what its stroke's own sensor does not see; a road's tail is motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from mrctl.discover.noise.motion_noise import noise_spectrum
from mrctl.identify.records import Record

RATE_HZ, SECONDS = 1000.0, 20.0
SIGMA_M_S = 1e-3
DENSITY = 2.0 * SIGMA_M_S**2 / RATE_HZ


def road(noise_m: float, *, derived: str = "", seed: int = 0) -> Record:
    """White noise through a lag of 5 Hz, whose tail at 40 Hz is far above the velocity sensor's noise."""
    rng = np.random.default_rng(seed)
    n = int(RATE_HZ * SECONDS)
    f = np.fft.rfftfreq(n, 1.0 / RATE_HZ)
    lines = (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)) / (1.0 + (f / 5.0) ** 2)
    lines[0] = 0.0
    v = np.fft.irfft(lines, n)
    v *= 0.3 / v.std()
    lines[1:] /= 2j * np.pi * f[1:]
    x = np.fft.irfft(lines, n) * (0.3 / np.fft.irfft(lines * 2j * np.pi * f, n).std())
    x = x + noise_m * rng.normal(size=n)
    velocity = v + SIGMA_M_S * rng.normal(size=n)
    if derived == "displacement":
        x = np.cumsum(velocity) / RATE_HZ
    if derived == "velocity":
        velocity = np.gradient(x, 1.0 / RATE_HZ)
    still = np.zeros(n)
    return Record(0, RATE_HZ, velocity, still, still, still, x, still)


def level(record: Record) -> np.ndarray:
    found = noise_spectrum([record])
    assert found is not None
    return found.density


def test_what_another_sensor_of_the_stroke_sees_too_is_motion():
    found = level(road(1e-6)) / DENSITY
    assert found[0] == pytest.approx(1.0, abs=0.3)
    assert np.all(
        (found > 0.7) & (found < 3.0)
    )  # where the stroke's noise is as large as the motion, some stays


@pytest.mark.parametrize("derived", ["displacement", "velocity"])
def test_a_channel_made_from_the_other_says_nothing(derived):
    assert level(road(1e-6, derived=derived))[0] > 10.0 * DENSITY


def test_a_stroke_too_coarse_to_see_it_says_nothing():
    assert level(road(2e-3))[0] > 10.0 * DENSITY


def triangle(hz: float, noise_m: float = 8e-6, seed: int = 0) -> Record:
    """A velocity that jumps, as under a triangle of the stroke, in overtones that reach the noise's bands."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
    rise = np.clip(np.abs((2.0 * hz * t) % 2.0 - 1.0) * 2.0 - 1.0, -1.0, 1.0)
    x = 0.2 / (4.0 * hz) * rise
    v = np.gradient(x, 1.0 / RATE_HZ)
    still = np.zeros(t.size)
    velocity = v + SIGMA_M_S * rng.normal(size=t.size)
    return Record(0, RATE_HZ, velocity, still, still, still, x + noise_m * rng.normal(size=t.size), still)


@pytest.mark.parametrize("hz", [3.0, 5.0])
def test_between_the_lines_of_a_motion_its_noise_is_told_too(hz):
    """A coherence of short pieces is high wherever a line is near; a fine spectrum is noise between them."""
    found = level(triangle(hz)) / DENSITY
    assert np.all((found > 0.5) & (found < 3.0))


def swaying(noise: np.ndarray) -> Record:
    """A slow sine, and a velocity sensor's noise (n, m/s)."""
    still = np.zeros(noise.size)
    velocity = 0.3 * np.sin(2.0 * np.pi * 1.3 * np.arange(noise.size) / RATE_HZ) + noise
    return Record(0, RATE_HZ, velocity, still, still, still, still, still)


@pytest.mark.parametrize(
    ("order", "apply", "corner_hz"), [(1, sosfilt, 60.0), (1, sosfiltfilt, 80.0), (2, sosfilt, 50.0)]
)
def test_noise_behind_a_low_pass_is_as_loud_at_the_motion_as_it_was_before_it(order, apply, corner_hz):
    white = SIGMA_M_S * np.random.default_rng(3).normal(size=int(RATE_HZ * SECONDS))
    noise = apply(butter(order, corner_hz, fs=RATE_HZ, output="sos"), white)
    spectrum = noise_spectrum([swaying(noise)])
    assert spectrum is not None
    assert spectrum.density[-6] < 0.85 * DENSITY  # in the lowest of the bands it is less
    found = spectrum.at(np.array([0.0, 5.0, 10.0, 20.0]))[1:]
    assert found == pytest.approx(DENSITY, rel=0.3)


def test_the_tail_of_a_road_is_not_continued_to_more():
    spectrum = noise_spectrum([road(2e-3)])
    assert spectrum is not None
    assert spectrum.at(np.array([0.0, 5.0]))[1] == spectrum.density[0]
    assert spectrum.density.size == 6


def on_a_rig_and(other: Record) -> tuple[Record, ...]:
    """Runs of slow sines on a rig, and another as the last."""
    rng = np.random.default_rng(11)
    sines = (swaying(SIGMA_M_S * rng.normal(size=other.velocity_m_s.size)) for _ in range(5))
    return *(replace(one, run=n) for n, one in enumerate(sines)), replace(other, run=5)


@pytest.mark.parametrize("times", [2.0, 3.0])
def test_a_sensor_that_is_louder_on_the_road_is_told_so(times):
    louder = road(2e-3)
    more = (
        np.sqrt(times**2 - 1.0) * SIGMA_M_S * np.random.default_rng(5).normal(size=louder.velocity_m_s.size)
    )
    found = noise_spectrum(on_a_rig_and(replace(louder, velocity_m_s=louder.velocity_m_s + more)))
    assert found is not None
    assert list(found.louder) == [5]
    assert found.louder[5] == pytest.approx(times**2, rel=0.2)
    f = np.array([0.0, 100.0])
    assert found.at(f, 5)[1] == found.louder[5] * found.at(f, 0)[1]


@pytest.mark.parametrize("corner_hz", [30.0, 60.0, 120.0])
def test_a_motion_that_reaches_far_is_no_louder_noise(corner_hz):
    rng = np.random.default_rng(6)
    n = int(RATE_HZ * SECONDS)
    fast = sosfilt(butter(2, corner_hz, fs=RATE_HZ, output="sos"), 0.3 * rng.normal(size=n))
    record = swaying(SIGMA_M_S * rng.normal(size=n))
    found = noise_spectrum(on_a_rig_and(replace(record, velocity_m_s=record.velocity_m_s + fast)))
    assert found is not None
    assert not found.louder
