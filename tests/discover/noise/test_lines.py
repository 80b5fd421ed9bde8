"""A line in what is left over is told from noise of any colour."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrctl.discover.noise.lines import hums_of, line_of, steady_noise
from mrctl.discover.noise.noise_floor import Cycles, NoiseFloor
from mrctl.discover.verdict.balance import repeated_n2

RATE_HZ = 500.0


def noise(random, seconds, colour=0.0):
    white = random.normal(size=int(seconds * RATE_HZ))
    return 10.0 * np.sqrt(1.0 - colour**2) * lfilter([1.0], [1.0, -colour], white)


def moving(runs, hz=1.3):
    """Speeds of the runs, sines."""
    return [np.sin(2 * np.pi * hz * np.arange(r.size) / RATE_HZ) for r in runs]


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9, 0.97])
def test_noise_of_any_colour_has_no_line(colour):
    random = np.random.default_rng(1)
    for _ in range(20):
        runs = [noise(random, 4.0, colour) for _ in range(6)]
        assert line_of(runs, [RATE_HZ] * 6) is None


def test_a_vibration_that_swells_with_the_motion_is_found_with_its_size():
    random = np.random.default_rng(2)
    t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
    runs, made = [], []
    for hz in (1.0, 2.0, 3.0):
        hum = 20.0 * np.abs(np.sin(2 * np.pi * hz * t)) * np.sin(2 * np.pi * 61.3 * t + random.uniform(0, 6))
        runs.append(noise(random, 4.0, 0.6) + hum)
        made.append(np.mean(hum**2))
    line = line_of(runs, [RATE_HZ] * 3)
    assert line is not None
    assert abs(line.frequency_hz - 61.3) < 2.0
    assert line.mean_square_n2 == pytest.approx(np.mean(made), rel=0.3)


def test_a_faint_hum_is_not_worth_a_word():
    random = np.random.default_rng(3)
    t = np.arange(int(8.0 * RATE_HZ)) / RATE_HZ
    runs = [noise(random, 8.0) + 2.0 * np.sin(2 * np.pi * 50.0 * t) for _ in range(4)]
    assert line_of(runs, [RATE_HZ] * 4) is None


def test_a_hum_as_strong_in_all_runs_is_the_measurements_and_is_told_with_its_harmonic():
    random = np.random.default_rng(4)
    made, runs = [], []
    for seconds in (4.0, 6.0, 11.0):
        t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
        hum = 16.0 * np.sin(2 * np.pi * 50.02 * t + random.uniform(0, 6))
        hum += 9.0 * np.sin(2 * np.pi * 150.06 * t + random.uniform(0, 6))
        runs.append(noise(random, seconds) + hum)
        made.append(hum)
    hums, rest = hums_of(runs, [RATE_HZ] * 3, moving(runs))
    assert [round(h.frequency_hz) for h in hums] == [50, 150]
    assert sum(h.mean_square_n2 for h in hums) == pytest.approx(np.mean(np.concatenate(made) ** 2), rel=0.1)
    assert line_of(rest, [RATE_HZ] * 3) is None


def test_what_swells_with_the_motion_or_differs_from_run_to_run_is_no_hum():
    random = np.random.default_rng(5)
    t = np.arange(int(6.0 * RATE_HZ)) / RATE_HZ
    carrier = np.sin(2 * np.pi * 61.0 * t)
    swelling = [noise(random, 6.0) + 25.0 * np.abs(np.sin(2 * np.pi * f * t)) * carrier for f in (1.0, 1.5)]
    louder = [noise(random, 6.0) + size * carrier for size in (8.0, 16.0, 30.0)]
    for runs in (swelling, louder):
        hums, rest = hums_of(runs, [RATE_HZ] * len(runs), moving(runs))
        assert not hums
        assert line_of(rest, [RATE_HZ] * len(runs)) is not None


def test_a_frame_that_rings_alike_in_runs_of_unlike_force_is_noise_and_one_that_the_damper_shakes_is_not():
    random = np.random.default_rng(6)
    pole = 0.985 * np.exp(2j * np.pi * 60.0 / RATE_HZ)
    ring = [1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2]
    sizes = (100.0, 300.0, 500.0, 900.0, 1200.0)
    forces = [size * np.sin(np.arange(int(6.0 * RATE_HZ)) / 80.0) for size in sizes]
    alike = [noise(random, 6.0) + 2.0 * lfilter(*ring, random.normal(size=f.size)) for f in forces]
    shaken = [
        noise(random, 6.0) + size / 300.0 * lfilter(*ring, random.normal(size=f.size))
        for size, f in zip(sizes, forces, strict=True)
    ]
    rates = [RATE_HZ] * len(sizes)
    for runs, steady in ((alike, True), (shaken, False)):
        line = line_of(runs, rates)
        assert line is not None
        assert steady_noise(line, runs, rates, forces, moving(runs)) is steady
    line = line_of(alike, rates)
    assert line is not None
    assert not steady_noise(line, alike, rates, [forces[2]] * len(sizes), moving(alike))  # who can tell


@pytest.mark.parametrize("depth", [0.0, 0.9])
def test_a_hum_that_the_speed_swells_alike_in_all_seconds_of_all_runs_is_none(depth):
    random = np.random.default_rng(7)
    t = np.arange(int(6.0 * RATE_HZ)) / RATE_HZ
    speed = np.sin(2 * np.pi * 2.0 * t)
    carrier = [np.sin(2 * np.pi * 60.0 * t + random.uniform(0, 6)) for _ in range(5)]
    runs = [noise(random, 6.0) + 30.0 * (1.0 - depth + depth * np.abs(speed)) * c for c in carrier]
    hums, _ = hums_of(runs, [RATE_HZ] * 5, [speed] * 5)
    assert bool(hums) is (depth == 0.0)


@pytest.mark.parametrize(("hum_hz", "repeats"), [(50.0, 1.0), (50.5, 0.25), (51.0, 0.0)])
def test_of_a_hum_what_comes_again_in_each_cycle_is_not_in_the_noise_that_cycles_tell(hum_hz, repeats):
    """Cycles of half a second: at 51 Hz every other one has it upside down."""
    t = np.arange(int(8.0 * RATE_HZ)) / RATE_HZ
    hum, rest = 4.0 * np.sin(2 * np.pi * hum_hz * t), noise(np.random.default_rng(8), 8.0)
    floors = [
        NoiseFloor(10.0, "cycles", 9.0, steady=Cycles(0.0, 0.5 * RATE_HZ, 16, t.size)),
        NoiseFloor(None, "lower bound only", 9.0),  # which says nothing of a hum
    ]
    found = repeated_n2(floors, [rest + hum, rest + 9.0 * hum], [rest, rest])
    assert found == pytest.approx(repeats * 8.0, abs=2.0)
