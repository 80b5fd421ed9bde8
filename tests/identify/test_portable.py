"""Whatever filter a fit has gone to, the one written runs at every rate of the loop."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.identify import hysteresis
from mrctl.identify.inverse_filter import LOOP_RATES_HZ
from mrctl.identify.portable import portable

# As fits have left them: pole parameters, numerator.
DRIFT = np.array([1.219, 0.513, -7.824, 1.173, 1.034, -0.040])
NOISE = np.array([1.119, 3.257, -1.666, -1.440, 1.273, -2.358])


@pytest.mark.parametrize(
    ("theta", "off"),
    [(hysteresis.lag(15.0), 0.01), (DRIFT, 0.03), (NOISE, 1.0)],
    ids=["a lag", "one that follows a drift", "one of noise alone"],
)
def test_every_loop_rate_carries_what_is_written(theta, off):
    written = portable(theta, 1000.0)
    for rate in LOOP_RATES_HZ:
        written.resampled(rate)
    f = np.linspace(0.2, 20.0, 50)
    assert float(np.median(np.abs(written.response(f) - hysteresis.response(theta, f)))) < off
    assert written.dc_gain() == pytest.approx(1.0)
