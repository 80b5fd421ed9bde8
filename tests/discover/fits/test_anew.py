"""What a base has made up for is found from a base that never met it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from discover.hidden import NOISE_N, RATE_HZ, bench_of

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.anew import ENOUGH, _shortest, begun_anew
from mrctl.discover.fits.screen import ranges_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.levels import tried
from mrctl.discover.search.looks import looks
from mrctl.identify.effects_fit import Effects
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign
from mrctl.model.effects.registry import effect

PREYIELD = effect("preyield_stiffness")
NAMES = "yield_length_m", "compliance_m_n", "creep"
LENGTH_M = 2e-3


def _published() -> Campaign:
    """Sines of one frequency and stroke at steady currents and temperatures, as in the published protocol."""
    bench = bench_of({"preyield_stiffness": dict(zip(NAMES, (LENGTH_M, 0.0, 0.0), strict=True))}, 3)
    runs = [
        bench.sine(f"{i:g}A_{c:g}C", RATE_HZ, 2.387, 0.0127, 6, i, c)
        for i in (0.0, 1.0, 2.0, 3.0)
        for c in (30.0, 80.0)
    ]
    return Campaign(Path("published"), tuple(runs), "0" * 64)


@pytest.fixture(scope="module")
def published():
    """The evidence of such a campaign, and the base beside it."""
    evidence = Evidence.of(_published())
    return evidence, evidence.base()


@pytest.mark.long
def test_a_long_elastic_start_is_found_at_one_frequency(published):
    """There the base's filter and shape make up for much of it, and no step leads back from there."""
    evidence, base = published
    tangent = Tangent.of(base.fit)
    (look,) = looks(tangent, [PREYIELD])
    found = tried(base, tangent, evidence.folds, look)
    assert look.gain > 0.9 * float(tangent.residual @ tangent.residual)
    assert found.proof.mean_square < (1.05 * NOISE_N) ** 2 < 0.1 * base.mean_square
    assert abs(found.fit.effect_values[PREYIELD.name][0] / LENGTH_M - 1.0) < 0.05


def test_begun_anew_it_is_near_the_end_before_all_records_are_asked(published):
    _, base = published
    model = base.fit.model.with_effects(Effects((PREYIELD,)))
    points = PREYIELD.starting_points(ranges_of(model.records))
    (theta,) = begun_anew(base.fit, PREYIELD, points[:1])
    assert theta.size == model.size
    assert model.rmse_n(theta) < 0.5 * base.mean_square**0.5


@pytest.mark.parametrize(("busy_from_s", "from_the_beginning"), [(0.0, True), (30.0, False)])
def test_a_long_run_is_asked_where_it_says_most_and_never_from_a_turn(busy_from_s, from_the_beginning):
    """What went before a part is not known; while the damper turns it says most."""
    rate = 500.0
    t = np.arange(0.0, 50.0, 1.0 / rate)
    busy = np.where(t >= busy_from_s, 1.0, 0.2)
    zeros = np.zeros(t.size)
    velocity = 0.3 * busy * np.sin(2 * np.pi * 1.3 * t)
    record = Record(0, rate, velocity, 2.0 * busy, zeros + 30.0, 900.0 * velocity, zeros, zeros)
    (part,) = _shortest([record])
    assert len(part) == ENOUGH
    if from_the_beginning:
        assert np.array_equal(part.velocity_m_s, velocity[:ENOUGH])
    else:
        assert abs(part.velocity_m_s[0]) > 0.3 * np.abs(velocity).max()
    assert np.ptp(part.velocity_m_s) > 0.95 * np.ptp(velocity)
