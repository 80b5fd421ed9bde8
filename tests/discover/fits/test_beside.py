"""A fit that ended at one of two stops goes on to both."""

from __future__ import annotations

from dataclasses import replace

from hidden import few, rich

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.settle import settled
from mrctl.model.effects.registry import effects

STOPS = {
    "clearance_m": 0.0275,
    "force_at_1mm_n": 250.0,
    "exponent": 1.5,
    "damping_n_s_m": 300.0,
    "middle_m": -0.0005,
    "lag_s": 0.0,
    "compression_change": 0.0,
}


def test_the_other_stop_is_found_from_a_fit_that_knows_of_one():
    campaign = few(rich({"end_stop": STOPS}))
    sines = tuple(run for run in campaign.runs if "Hz" in run.name)
    evidence = Evidence.of(replace(campaign, runs=sines))
    stop = effects()["end_stop"]
    # At the outer end as it is, at the other beyond what any run reaches.
    one = STOPS | {"clearance_m": 0.06, "middle_m": -0.033}
    before = evidence.base([stop], {"end_stop": tuple(one.values())})
    after = settled(before, evidence.folds)
    assert after.mean_square < 0.02 * before.mean_square  # which it is on the way from
    values = dict(zip(STOPS, after.fit.effect_values["end_stop"], strict=True))
    assert abs(values["middle_m"] - STOPS["middle_m"]) < 1e-3
    assert abs(values["clearance_m"] - STOPS["clearance_m"]) < 1e-3
