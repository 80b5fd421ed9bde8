"""What a verdict asks for beyond a good fit, and how long the runs are that it stands on."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.diagnose import FORESEEN, _foreseen
from mrctl.discover.evidence import FEWEST_CYCLES, _shortened
from mrctl.discover.noise_floor import NoiseFloor
from mrctl.identify.records import Record


def proof(inside, held_out):
    return SimpleNamespace(mean_square=inside, held_out_mean_square=held_out)


def test_what_a_fit_cannot_foresee_is_no_explanation():
    assert _foreseen(proof(1000.0, 1050.0), proof(100.0, 108.0)) == 1.0
    assert _foreseen(proof(1500.0, 2400.0), proof(700.0, 1700.0)) < FORESEEN
    assert _foreseen(proof(1000.0, 1050.0), proof(100.0, 1100.0)) == 0.0
    # A campaign whose runs hardly cover each other costs any model as much.
    assert _foreseen(proof(46.0, 74.0), proof(36.0, 47.0)) > FORESEEN


@pytest.mark.parametrize("drift_n", [0.0, 2.0, 40.0])
def test_a_run_that_drifts_is_searched_whole(drift_n):
    n, rate_hz = 4000, 1000.0
    still = np.zeros(n)
    record = Record(0, rate_hz, np.sin(np.arange(n) / 50.0), still, still, still, still, still)
    floor = NoiseFloor(8.0, "cycles", 8.0, cycles=12, drift_n=drift_n)
    found = _shortened(record, floor, share=0.1)
    assert len(found) == (n if drift_n > 8.0 else n * FEWEST_CYCLES // 12)
    assert _shortened(record, floor, share=1.0) is record
