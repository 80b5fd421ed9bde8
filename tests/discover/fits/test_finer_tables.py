"""What finer tables would take is told apart from what an effect does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.campaigns import campaign, shipped, sine

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.finer_tables import finer, finer_score
from mrctl.discover.fits.proof import Proof

MOTIONS = ((1.0, 0.0, 0.04), (2.0, 0.0, 0.02), (2.0, 1.0, 0.03), (3.0, 1.0, 0.02), (1.0, 2.0, 0.06))
BUMP_N = 6.0


def quiet(rng, n):
    return rng.normal(0.0, 3.0, n)


@pytest.fixture(scope="module")
def base() -> Proof:
    runs = [
        sine(shipped(), frequency_hz=hz, amplitude_m=m, current_a=i, noise=quiet, name=f"{k}.csv", seed=k)
        for k, (hz, i, m) in enumerate(MOTIONS)
    ]
    return Evidence.of(campaign(*runs)).base()


def test_finer_tables_are_the_same_model(base):
    model, theta = finer(base.fit)
    assert model.layout.velocity_m_s.size == 2 * base.fit.model.layout.velocity_m_s.size - 1
    assert model.tables(theta).g[model.layout.zero] == 0.0
    for ours, theirs in zip(model.predict(theta), base.fit.model.predict(base.fit.theta), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-6)


def test_they_are_worth_nothing_beside_noise(base):
    assert finer_score(base, base.colour) < 0.0


def test_they_are_worth_much_where_g_is_bent_between_knots(base):
    knots = base.fit.model.layout.velocity_m_s
    bent = [
        replace(r, force_n=r.force_n + BUMP_N * _between(knots, r.velocity_m_s))
        for r in base.fit.model.records
    ]
    fit = replace(base.fit, model=base.fit.model.on(bent))
    fit.model.weigh_as(base.fit.model)
    assert finer_score(replace(base, fit=fit), base.colour) > 200.0


def _between(knots, velocity_m_s):
    """1 halfway between knots, 0 at them."""
    place = np.interp(velocity_m_s, knots, np.arange(knots.size))
    return 1.0 - 2.0 * np.abs(place % 1.0 - 0.5)
