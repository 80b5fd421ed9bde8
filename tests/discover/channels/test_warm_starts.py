"""Runs made one after the other begin with the fluid as warm as the last one left it, which no file tells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from discover.campaigns import picked
from identify.virtual import Bench, random_damper

from mrctl.discover import taken_anew
from mrctl.discover.base_fit import fitted_to
from mrctl.discover.channels.warm_starts import begin_as_fluids_do, more_than_scales, warm_starts, warmed
from mrctl.discover.evidence import Evidence
from mrctl.discover.extend import extend
from mrctl.discover.fits.grow import grown_by
from mrctl.discover.search.rounds import rounds_of
from mrctl.discover.taken_anew import begun_warm
from mrctl.measurements.run import Campaign
from mrctl.model.damper import EffectSetting
from mrctl.model.effects.registry import effects
from mrctl.simulate import Run, stages, trace

RATE_HZ, SECONDS, NOISE_N = 200.0, 5.0, 5.0
HEAT = {"heating_k_j": 3e-2, "cooling_time_s": 20.0, "resistance_ohm": 2.0, "rise_at_start_k": 0.0}
BEFORE_S = (0, 6, 2, 10, 4, 0, 8, 1, 15, 3, 0, 5)  # s, for which the same went on before each run


def _campaign(before_s=BEFORE_S, heating_k_j=HEAT["heating_k_j"]):
    """Roads cut out of longer ones, and how warm against its case the fluid was as each began."""
    heat = EffectSetting("self_heating", HEAT | {"heating_k_j": heating_k_j})
    damper = replace(random_damper(3), effects=(heat,))
    bench = Bench(damper, np.random.default_rng(3), NOISE_N)
    runs, rises = [], []
    for k, before in enumerate(before_s):
        t, v = bench.road(RATE_HZ, before + SECONDS)
        first = round(before * RATE_HZ)
        run = bench.run(f"{k}", t, v, (0.5, 2.5)[k % 2], (25.0, 55.0)[k // 2 % 2])
        fluid_c = trace(Run.of(1.0 / RATE_HZ, v, run.current_a, run.temperature_c), damper).temperature_c
        rises.append(fluid_c[first] - run.temperature_c[first])
        runs.append(picked(run, slice(first, None)))
    return Campaign(Path("warm"), tuple(runs), "0" * 64), np.array(rises)


def test_a_search_names_a_warmth_and_how_warm_each_run_began():
    """Of which a fit that begins them alike finds next to nothing."""
    campaign, rises = _campaign()
    assert np.ptp(rises) > 10.0
    evidence = Evidence.of(campaign)
    known = [effects()[name] for name in ("self_heating", "viscous_damping", "quadratic_damping")]
    after, _, found, _, final = rounds_of(evidence, evidence.base(), known, lambda *_: None)
    assert [t.effect.name for t in found] == ["self_heating"]
    assert final.mean_square < 1.2 * NOISE_N**2
    assert final.fit.effect_values["self_heating"][1] == pytest.approx(HEAT["cooling_time_s"], rel=0.5)
    told = np.array([r.warmer_k for r in after.measured])
    assert [r.warmer_k for r in after.records] == [r.warmer_k for r in after.full] == told.tolist()
    # What the runs at one current and one temperature have in common, tables make up for.
    differences = (x.reshape(3, 4) - x.reshape(3, 4).mean(axis=0) for x in (told, rises))
    assert np.corrcoef(*(x.ravel() for x in differences))[0, 1] > 0.99


@pytest.mark.long
def test_such_runs_are_made_a_calibration_of_and_foretold():
    """Each held-out one from where its own course says that it began, and the effect is what it was."""
    campaign, _ = _campaign()
    extension = extend(campaign, (), [effects()["self_heating"]])
    before, after = (n**2 - NOISE_N**2 for n in (extension.rmse_before_n, extension.rmse_after_n))
    assert after < 0.05 * before
    assert extension.fit.effect_values["self_heating"][0] == pytest.approx(HEAT["heating_k_j"], rel=0.5)


def test_scales_of_the_runs_are_no_warmth():
    campaign, _ = _campaign([0.0] * len(BEFORE_S), heating_k_j=0.0)
    scales = 1.0 + 0.15 * np.random.default_rng(1).uniform(-1.0, 1.0, len(BEFORE_S))
    runs = [replace(r, force_n=r.force_n * s) for r, s in zip(campaign.runs, scales, strict=True)]
    evidence = Evidence.of(replace(campaign, runs=tuple(runs)))
    base = evidence.base()
    warm = fitted_to(evidence.records, grown_by(base.fit, effects()["self_heating"]))
    _, by_k, _ = warm_starts(warm, warm.theta)
    assert np.abs(by_k).max() > 5.0  # which would serve
    records = warmed(evidence.records, by_k)
    assert not more_than_scales(base.fit, fitted_to(records, warm))


def test_no_fluid_begins_a_run_far_colder_than_its_case():
    """What fades in every run as a force does while a fluid warms, must begin there to be called so."""
    evidence = Evidence.of(_campaign()[0])
    heat = effects()["self_heating"]
    plain = evidence.base([heat], {heat.name: heat.typical}).fit
    first = np.eye(1, len(plain.model.records))[0]
    models = [plain.model.placed(warmed(plain.model.records, k * first)) for k in (0.0, 40.0, -60.0, 200.0)]
    begins = [begin_as_fluids_do(replace(plain, model=model)) for model in models]
    assert begins == [True, True, False, False]


def test_without_warmth_in_the_model_or_anything_left_nothing_is_asked(monkeypatch):
    evidence = Evidence.of(_campaign()[0])
    base = evidence.base()
    assert begun_warm(evidence, base, base) == (evidence, base)
    heat = effects()["self_heating"]
    warm = evidence.base([heat], {heat.name: heat.typical})
    monkeypatch.setattr(taken_anew, "is_quiet", lambda _: True)
    monkeypatch.setattr(taken_anew, "warm_starts", lambda *_: pytest.fail("asked"))
    assert begun_warm(evidence, warm, base) == (evidence, warm)


def test_a_fluid_that_begins_warmer_is_so_and_cools_to_where_it_would_have_been():
    effect, n = effects()["self_heating"], 4000
    damper = random_damper(3)
    inputs = np.full(n, 40.0), np.zeros(n), np.zeros(n)
    p = tuple(HEAT.values())
    as_it_is, warmer = (
        stages.fluid_temperature([(effect, p)], *inputs, damper.static, 0.1, warmer_k=k)
        for k in (None, np.array([8.0]))
    )
    assert warmer[0] - as_it_is[0] == pytest.approx(8.0)
    assert warmer[200] - as_it_is[200] == pytest.approx(8.0 * np.exp(-1.0), rel=1e-3)
    assert warmer[-1] == pytest.approx(as_it_is[-1], abs=0.02)
