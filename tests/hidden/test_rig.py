"""The plumbing of the battery's further questions: runs made again, parameters compared, forces tracked."""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import NormalDist
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import follow
import generate
import parameters
import tracking
from fine import fine_signals
from rig import Rig
from spec import make_spec

from mrctl.discover.evidence import Evidence
from mrctl.identify.records import Record
from mrctl.measurements import load_campaign
from mrctl.model.effects.registry import effects

SEED = 11
FORMS = 68  # of family A: every effect in every form


def _case(index):
    spec = make_spec(SEED, "A", index)
    return {
        "effects": spec["effects"],
        "parameters": generate.drawn_parameters(spec),
        "base": generate.drawn_base(spec),
        "sensors": spec["sensors"],
    }


@pytest.mark.parametrize("index", range(FORMS))
def test_every_parameter_of_every_form_is_compared_or_says_why_not(index):
    case = _case(index)
    for true in parameters.truth_of(case["effects"][0], case).values():
        assert isinstance(true, str) or np.isfinite(true)


def test_the_forms_are_of_every_effect():
    drawn = (make_spec(SEED, "A", index)["effects"] for index in range(FORMS))
    assert {name for chosen in drawn for name in chosen} == set(effects())


def test_a_rig_makes_the_force_that_the_campaign_had(tmp_path):
    name, truth = generate.make_case(SEED, "A", 5, tmp_path)
    written = np.loadtxt(tmp_path / name / "run_01.csv", delimiter=",", skiprows=1)
    spec = make_spec(SEED, "A", 5)
    first = fine_signals(spec)[0]
    force = Rig((SEED, "A", 5)).force(first)[first["n_pre"] : -1 : first["os"]]
    assert np.std(written[:, -1] - force) < 1.2 * truth["noise_rms_n"]


def _proposed_record():
    t = np.arange(500) / 500.0
    x = 0.01 * np.clip(t / 0.5, 0, 1) * np.sin(2 * np.pi * 2.0 * t)
    v = np.gradient(x, 1 / 500.0)
    current = np.where(t % 0.5 < 0.25, 1.5, 0.0)
    return Record(0, 500.0, v, current, np.full(t.size, 40.0), np.zeros(t.size), x, np.gradient(v, 1 / 500.0))


def test_a_proposed_run_moves_the_rig_as_its_record_says():
    record = _proposed_record()
    r = Rig((SEED, "A", 5)).followed(record)
    there = np.interp(np.arange(499) / 500.0, r["t"], r["x"])  # the last instant is not on the rig's clock
    assert np.abs(there - record.displacement_m[:-1]).max() < 1e-6
    assert set(np.unique(r["cmd"])) == {0.0, 1.5}
    assert np.abs(r["v"][r["t"] < -0.02]).max() < 1e-3
    assert np.abs(np.gradient(r["x"], r["dt"]) - r["v"]).max() < 1e-3


def test_the_proposed_run_joins_the_campaign_before_the_second_question(tmp_path, monkeypatch):
    name, truth = generate.make_case(SEED, "A", 5, tmp_path)
    proposal = SimpleNamespace(record=_proposed_record(), figures=dict)
    doubtful = SimpleNamespace(verdict="ambiguous", next_run=proposal)
    clear = SimpleNamespace(verdict="found", effects=truth["effects"], found=[])
    asked = []
    monkeypatch.setattr(follow, "diagnose", lambda campaign: asked.append(campaign) or clear)
    answers = follow.followed(doubtful, tmp_path / name, (SEED, "A", 5), rounds=2)
    assert [len(campaign) for campaign in asked] == [truth["runs"] + 1]
    assert np.ptp(asked[0].runs[-1].current_a) == pytest.approx(1.5)
    assert [follow.right(truth, one) for one in answers] == [True]


def test_what_was_found_is_set_beside_the_truth_and_tracked_on_new_runs(tmp_path, capsys):
    key = (SEED, "A", 0)
    name, truth = generate.make_case(*key, tmp_path)
    assert truth["effects"] == ["gas_spring"]
    for file in sorted((tmp_path / name).glob("*.csv"))[6:]:
        file.unlink()  # fewer runs go through all of it
    spring = effects()["gas_spring"]
    free = np.array([not p.held for p in spring.parameters])
    trial = SimpleNamespace(effect=spring, look=SimpleNamespace(free=free))
    without = SimpleNamespace(effects=SimpleNamespace(chosen=()))  # no model to begin at
    start = {"gas_spring": spring.typical}
    campaign = load_campaign(tmp_path / name)
    found = SimpleNamespace(
        verdict="found",
        found=[SimpleNamespace(trial=trial, rivals=[])],
        final=SimpleNamespace(fit=SimpleNamespace(effect_values=start, model=without)),
        evidence=Evidence.of(campaign),
    )
    tracked, stated = tracking.tracked(found, campaign, key)
    answer = stated | {
        "verdict": "found",
        "effects": ["gas_spring"],
        "tracked": tracked,
        "extended": stated,
    }
    compared = {parameter: rest for _, parameter, *rest in parameters.compared(truth, answer)}
    for parameter, near in (("preload_n", 0.01), ("stiffness_n_m", 0.02)):
        true, value, (low, high), why = compared[parameter]
        assert why is None
        assert low < true < high
        assert value == pytest.approx(true, rel=near)
    forward, inverse = tracked["forward"], tracked["inverse"]
    assert forward["noise_n"] < forward["extended_n"] < 1.1 * forward["perfect_n"] < 0.5 * forward["base_n"]
    assert inverse["extended_n"] < 0.5 * inverse["base_n"] < 0.1 * inverse["wish_n"]
    for table in (parameters.table, tracking.table, follow.table):
        table({name: answer}, {name: truth})
    assert "gas_spring.preload_n" in capsys.readouterr().out


def test_the_true_set_alone_is_the_right_answer():
    one = {"family": "D", "effects": ["gas_spring"], "odd": None}
    assert follow.right(one, {"verdict": "found", "effects": ["gas_spring"]})
    assert not follow.right(one, {"verdict": "found", "effects": ["gas_spring", "end_stop"]})
    assert not follow.right(one, {"verdict": "ambiguous", "effects": ["gas_spring"]})
    assert follow.right({"family": "B", "effects": [], "odd": None}, {"verdict": "none", "effects": []})


def test_what_noise_alone_leaves_is_the_median_of_the_intervals_own_scatter():
    spread, half = 0.02, NormalDist().inv_cdf(0.975)
    own = [(5.0, 5.0, (5.0 * (1.0 - half * spread), 5.0 * (1.0 + half * spread)))] * 3
    own.append((0.0, 0.1, (0.0, 1.0)))  # what is truly 0 has no share
    assert parameters.noise_alone(own) == pytest.approx(spread * NormalDist().inv_cdf(0.75), rel=1e-2)
    assert np.isnan(parameters.noise_alone(own[-1:]))
