"""When records speak for a limited compression force, for which the base is fitted once more without it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.fits import robust
from mrctl.discover.fits.robust import second_opinions

T = np.linspace(0.0, 1.0, 1000)


def _opinions(monkeypatch, compressions, rebounds):
    """The compression forces at which a base is begun anew, of records with these peaks, in N."""
    limits = []
    monkeypatch.setattr(robust, "_below", lambda _, limit: limits.append(limit))
    wave = np.sin(2.0 * np.pi * 3.0 * T)
    records = [
        SimpleNamespace(force_n=np.where(wave > 0.0, rebound * wave, compression * wave))
        for compression, rebound in zip(compressions, rebounds, strict=True)
    ]
    model = SimpleNamespace(records=records, residuals=lambda _: [np.sin(40.0 * T)])
    second_opinions(SimpleNamespace(model=model, theta=None))
    return limits


@pytest.mark.parametrize(
    ("compressions", "rebounds"),
    [
        ((2000.0, 2000.0, 2000.0, 900.0), (2100.0, 2900.0, 4000.0, 900.0)),
        # Two of the largest rebounds are alike, though not all of those that stop in compression.
        ((3980.0, 3950.0, 3990.0, 3940.0, 3880.0, 2200.0), (5100.0, 5130.0, 5040.0, 4600.0, 4300.0, 2250.0)),
    ],
)
def test_records_that_stop_alike_in_compression_but_not_in_rebound_speak_for_a_limit(
    monkeypatch, compressions, rebounds
):
    (limit,) = _opinions(monkeypatch, compressions, rebounds)
    assert limit == pytest.approx(max(compressions), rel=1e-2)


@pytest.mark.parametrize(
    ("compressions", "rebounds"),
    [
        ((2000.0, 2000.0, 2000.0, 900.0), (2400.0, 2400.0, 2400.0, 1000.0)),  # three runs of one amplitude
        ((2000.0, 2000.0, 1500.0), (2400.0, 3000.0, 1800.0)),  # too few
        ((-5.0, -5.0, -5.0), (2400.0, 3000.0, 1800.0)),  # a damper that only pulls
        ((1500.0, 1500.0, 1500.0), (-500.0, -500.0, -500.0)),  # one that only pushes, alike in all runs
    ],
)
def test_others_do_not(monkeypatch, compressions, rebounds):
    assert _opinions(monkeypatch, compressions, rebounds) == []
