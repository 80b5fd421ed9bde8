from dataclasses import replace

import pytest
from discover.hidden import NOISE_N, among, few, one_current, one_frequency, rich

from mrctl.discover import taken_anew
from mrctl.discover.diagnose import diagnose
from mrctl.discover.reports.diagnose_report import draw
from mrctl.discover.reports.figures import diagnosis_figures
from mrctl.discover.verdict.balance import STRANGE
from mrctl.report.page import Page

SPRING = {"gas_spring": {"preload_n": 80.0, "stiffness_n_m": 4000.0, "progression_per_m": 2.0}}


def test_a_hidden_effect_is_named_and_measured():
    name, values = "current_lag", {"rise_time_s": 0.012, "fall_time_s": 0.018}
    result = diagnose(few(rich({name: values})))
    assert (result.verdict, result.effects) == ("found", (name,))
    figures = diagnosis_figures(result)
    top = figures["ranking"][0]
    assert top["effect"] == name
    assert top["significant"]
    assert top["rmse_n"] < 1.1 * NOISE_N < figures["rmse_n"]
    assert top["rmse_n"] == figures["rmse_after_n"]
    assert top["parameters"] == figures["found"][0]["parameters"]
    assert not top["beside"]
    assert "left over the noise" not in figures["words"]
    assert not [c for c in result.balance.courses if c.certain and c.share > STRANGE]
    more = replace(result, balance=replace(result.balance, left=9.0))
    assert "3 N are left over the noise" in diagnosis_figures(more)["words"]
    key = next(iter(values))
    assert figures["found"][0]["parameters"][key]["value"] == pytest.approx(values[key], rel=0.05)


def test_of_two_effects_each_is_ranked_beside_those_found_before_it(monkeypatch, tmp_path):
    among(monkeypatch, "gas_spring", "current_lag", "end_stop")
    lag = {"rise_time_s": 0.012, "fall_time_s": 0.018}
    campaign = few(rich({**SPRING, "current_lag": lag}))
    result = diagnose(campaign)
    assert set(result.effects) == {"gas_spring", "current_lag"}
    figures = diagnosis_figures(result)
    first, second = figures["ranking"][:2]
    assert [first["effect"], second["effect"]] == list(result.effects)
    assert (first["beside"], second["beside"]) == ([], [first["effect"]])
    assert figures["rmse_n"] > first["rmse_n"] > second["rmse_n"] == figures["rmse_after_n"]
    assert first["removed_percent"] + second["removed_percent"] == pytest.approx(100.0, abs=3.0)
    for entry, found in zip((first, second), figures["found"], strict=True):
        assert entry["parameters"] == found["parameters"]  # of both together
    alone = [e for e in figures["ranking"][2:] if e["effect"] in result.effects]
    assert not alone
    assert "With them" in figures["words"]
    page = Page("steps", "")
    draw(page, result, figures, campaign)
    page.write(tmp_path / "steps.html")
    text = (tmp_path / "steps.html").read_text()
    assert all(f">+ {one}<" in text for one in result.effects)
    assert f">+ {', '.join(result.effects)}<" not in text


@pytest.mark.long  # the battery's small part asks it of another damper
def test_nothing_is_found_where_nothing_is_hidden():
    result = diagnose(few(rich(seed=5)))
    assert (result.verdict, result.effects) == ("none", ())


@pytest.mark.long
def test_an_effect_that_does_worse_than_none_once_the_zeros_are_its_own_is_not_kept(monkeypatch):
    def worse(evidence, proof):
        louder = replace(proof, inside=proof.inside * 1e4) if proof.fit.model.effects.size else proof
        return evidence, louder

    among(monkeypatch, "force_offset", "gas_spring", "rebound_asymmetry")
    monkeypatch.setattr(taken_anew, "rezeroed", worse)
    diagnosis = diagnose(few(rich({"force_offset": {"offset_n": 80.0}})))
    assert not diagnosis.effects
    assert diagnosis.final is diagnosis.base


def test_one_frequency_cannot_tell_a_spring_from_a_mass_and_says_what_can(monkeypatch):
    among(monkeypatch, "gas_spring", "fluid_inertia", "end_stop", "sensor_delay", "rebound_asymmetry")
    result = diagnose(one_frequency(SPRING))
    assert result.verdict == "ambiguous"
    assert set(result.effects) >= {"gas_spring", "fluid_inertia"}
    values = result.final.fit.effect_values
    assert values.get("fluid_inertia", (0.0,))[0] >= 0.0
    assert result.next_run is not None
    assert result.next_run.frequency_hz != pytest.approx(2.0)
    assert result.next_run.separation > 5.0


@pytest.mark.long
def test_one_current_cannot_tell_a_mount_from_a_fluid_that_is_elastic(monkeypatch):
    among(
        monkeypatch, "mount_compliance", "preyield_stiffness", "fluid_inertia", "sensor_delay", "gas_spring"
    )
    result = diagnose(one_current({"mount_compliance": {"compliance_m_n": 6e-7, "damping_n_s_m": 500.0}}))
    assert result.verdict == "ambiguous"
    assert set(result.effects) >= {"mount_compliance", "preyield_stiffness"}
    assert result.next_run is not None
    assert result.next_run.record.current_a.min() < 1.4
