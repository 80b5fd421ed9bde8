"""A line in what is left over is told from noise of any colour."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrctl.discover.lines import line_of

RATE_HZ = 500.0


def noise(random, seconds, colour=0.0):
    white = random.normal(size=int(seconds * RATE_HZ))
    return 10.0 * np.sqrt(1.0 - colour**2) * lfilter([1.0], [1.0, -colour], white)


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
