"""A motion without its noise is as good at a record's ends, where the noise has no neighbours, as can be."""

import numpy as np

from mrctl.discover.input_noise import _filtered

RATE_HZ = 250.0


def test_a_record_begins_where_its_motion_does_not_where_its_first_noisy_sample_is():
    random = np.random.default_rng(3)
    t = np.arange(int(4.0 * RATE_HZ)) / RATE_HZ
    passed = np.array([0.0, 3.0, 4.0, 0.5 * RATE_HZ]), np.array([1.0, 1.0, 0.0, 0.0])
    f = np.fft.rfftfreq(t.size, 1.0 / RATE_HZ)
    passed = f, np.interp(f, *passed)
    ends, middle = [], []
    for phase in random.uniform(0.0, 2.0 * np.pi, 200):
        true = np.sin(2.0 * np.pi * 1.1 * t + phase)
        error = _filtered(true + 0.02 * random.standard_normal(t.size), RATE_HZ, passed) - true
        ends += [error[:5], error[-5:]]
        middle.append(error[200:-200])
    assert np.std(np.concatenate(middle)) < 0.2 * 0.02
    assert np.std(np.concatenate(ends)) < 0.6 * 0.02
