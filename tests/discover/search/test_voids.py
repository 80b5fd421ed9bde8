"""A cavity that is soon full and must be closed at no force is found where its limit is found."""

from __future__ import annotations

import pytest
from discover.hidden import NOISE_N, few, rich

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.levels import tried
from mrctl.discover.search.looks import looks
from mrctl.model.effects.registry import effects

CAVITY = {
    "limit_n": 430.0,
    "knee_n": 40.0,
    "loss": 1.0,
    "closing_m": 1.2e-4,
    "refilled": 0.4,
    "most_m": 1e-3,
}


@pytest.mark.long
def test_the_first_fit_leaves_its_noise_and_knows_how_large_it_gets():
    """From a cavity without end the fit ends in one that fills by itself, and leaves a third more."""
    evidence = Evidence.of(few(rich({"cavitation": CAVITY})))
    base = evidence.base()
    tangent = Tangent.of(base.fit)
    (look,) = looks(tangent, [effects()["cavitation"]])
    found = tried(base, tangent, evidence.folds, look)
    assert found.proof.mean_square < (1.05 * NOISE_N) ** 2 < 0.03 * base.mean_square
    values = effects()["cavitation"].mapping(found.fit.effect_values["cavitation"])
    assert abs(values["most_m"] / CAVITY["most_m"] - 1.0) < 0.15
    assert abs(values["limit_n"] / CAVITY["limit_n"] - 1.0) < 0.01
