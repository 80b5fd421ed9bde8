"""A signal without its noise is as good at its ends as samples on one side only let it be."""

import numpy as np
import pytest

from mrctl.discover.noise.smoothing import smoothed


@pytest.mark.parametrize(
    ("rate_hz", "motion_hz", "edge_hz", "noise", "most"),
    [
        (250.0, 1.1, 3.0, 0.02, 0.6),
        (250.0, 8.4, 11.0, 0.02, 0.8),
        (250.0, 8.4, 11.0, 0.002, 2.5),  # cut at a peak, a mirror image is 30 times the noise off
        (2000.0, 1.1, 3.0, 0.02, 0.6),
        (1000.0, 5.0, 30.0, 0.02, 0.7),
    ],
)
def test_the_ends_are_hardly_worse_than_the_middle(rate_hz, motion_hz, edge_hz, noise, most):
    random = np.random.default_rng(3)
    t = np.arange(int(4.0 * rate_hz)) / rate_hz
    f = np.fft.rfftfreq(t.size, 1.0 / rate_hz)
    passed = f, np.interp(f, [0.0, edge_hz, 1.3 * edge_hz], [1.0, 1.0, 0.0])
    ends, middle = [], []
    for phase in random.uniform(0.0, 2.0 * np.pi, 40):
        true = np.sin(2.0 * np.pi * motion_hz * t + phase)
        error = smoothed((true + noise * random.standard_normal(t.size))[None], rate_hz, passed)[0] - true
        ends += [error[:5], error[-5:]]
        middle.append(error[t.size // 4 : -t.size // 4])
    assert np.std(np.concatenate(middle)) < 0.4 * noise
    assert np.std(np.concatenate(ends)) < most * noise


def test_any_length_and_any_share_is_taken():
    random = np.random.default_rng(4)
    for size in (16, 40, 5000):
        x = random.standard_normal((2, size))
        f = np.fft.rfftfreq(size, 1e-3)
        assert np.allclose(smoothed(x, 1000.0, (f, np.ones(f.size))), x, atol=1e-6)
        none = smoothed(x, 1000.0, (f, np.zeros(f.size)))
        assert np.all(np.isfinite(none))
        assert np.ptp(none) < np.ptp(x)
