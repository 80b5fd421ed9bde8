"""A base that made up for an effect in a way that no small step shows is searched from afar."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import generate

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.levels import Level, further
from mrctl.discover.search.looks import looks
from mrctl.measurements import load_campaign
from mrctl.model.effects.registry import effect


@pytest.mark.long
def test_a_loop_of_the_field_for_which_the_base_bent_f_and_h_is_seen_more_clearly(tmp_path):
    name, hidden = generate.make_case(4242, "A", 41, tmp_path)
    evidence = Evidence.of(load_campaign(tmp_path / name))
    before = evidence.base()
    tangent = Tangent.of(before.fit)
    candidates = [effect("magnetic_hysteresis"), effect("viscous_damping")]
    near = looks(tangent, candidates)
    whole = float(tangent.residual @ tangent.residual)
    level = further(Level(before, whole, near, []), candidates, evidence.folds)
    (best, *_) = level.trials
    assert [best.effect.name] == hidden["effects"]
    removable = before.mean_square - hidden["perfect_rmse_on_measured_inputs_n"] ** 2
    assert before.mean_square - best.proof.mean_square > 0.9 * removable
    assert best.look.gain > max(0.5 * whole, *(1.1 * one.gain for one in near))
    assert {one.effect.name for one in level.looks} == {one.name for one in candidates}
