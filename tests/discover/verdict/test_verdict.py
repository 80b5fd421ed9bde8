"""What a verdict asks for beyond a good fit, and how long the runs are that it stands on."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.searched import FEWEST_CYCLES, shortened
from mrctl.discover.noise.noise_floor import Cycles, NoiseFloor
from mrctl.discover.search.rounds import _hopeless
from mrctl.discover.verdict import judged as module
from mrctl.discover.verdict import rivals
from mrctl.discover.verdict.judged import FORESEEN, _bent, _foreseen, _nearly_as_good
from mrctl.discover.verdict.worth import accepted, is_unsure
from mrctl.identify.records import Record
from mrctl.model.effects.registry import effect


def proof(inside, *held_out):
    """A proof by its mean square, and those of folds of 10 samples."""
    squares = 10.0 * np.array(held_out)
    return SimpleNamespace(mean_square=inside, held_out=squares, fold_counts=np.full(squares.size, 10))


def test_what_a_fit_cannot_foresee_is_no_explanation():
    assert _foreseen(proof(1000.0, 1050.0), proof(100.0, 108.0)) == 1.0
    assert _foreseen(proof(1500.0, 2400.0), proof(700.0, 1700.0)) < FORESEEN
    assert _foreseen(proof(1000.0, 1050.0), proof(100.0, 1100.0)) == 0.0
    # A campaign whose runs hardly cover each other costs any model as much.
    assert _foreseen(proof(46.0, 74.0), proof(36.0, 47.0)) > FORESEEN


def test_a_run_that_is_alone_where_it_goes_does_not_speak_for_all():
    before, after = (105.0, 98.0, 102.0, 84.0, 115.0, 173.0), (84.0, 75.0, 79.0, 74.0, 72.0, 336.0)
    assert _foreseen(proof(88.0, *before), proof(76.0, *after)) > FORESEEN
    assert _foreseen(proof(88.0, *before[3:]), proof(76.0, *after[3:])) == 0.0  # of few folds all are asked
    assert _foreseen(proof(88.0, *before, 90.0), proof(76.0, *after, 300.0)) < FORESEEN


@pytest.mark.parametrize(("std", "unsure"), [((0.005, 0.0, 0.0, 9.0), False), ((0.02, 0.0, 0.0, 9.0), True)])
def test_an_effect_of_no_size_that_the_runs_agree_on_imitates_something_else(std, unsure):
    heats = effect("self_heating")
    fit = SimpleNamespace(effect_values={heats.name: (0.03, 200.0, 2.0, 4.0)})
    assert is_unsure(heats, fit, {heats.name: std}) is unsure


def test_an_effect_s_sizes_are_asked_and_not_its_shapes():
    off = effect("off_state_backbone")
    fit = SimpleNamespace(effect_values={off.name: (3.0, 7.27, 0.237, 0.463)})
    sure_of_its_shape = {off.name: (0.0, 3.86, 0.01, 0.008)}
    assert is_unsure(off, fit, sure_of_its_shape)
    assert not is_unsure(off, fit, {off.name: (0.0, 1.0, 0.01, 0.008)})


def test_linear_parameters_may_be_shapes_too():
    turns = effect("preyield_stiffness")
    fit = SimpleNamespace(effect_values={turns.name: (7.8e-4, 0.0, 0.67, 0.92, 0.16, 0.0, 1.0, 0.0)})
    unsure_of_its_plastic_part = (0.0, 0.1, 0.04, 0.15, 9.0, 0.0)
    assert not is_unsure(turns, fit, {turns.name: (3.1e-5, *unsure_of_its_plastic_part)})
    assert is_unsure(turns, fit, {turns.name: (4.0e-4, *unsure_of_its_plastic_part)})


@pytest.mark.parametrize(
    ("values", "bent"),
    [
        ((0.03, 2.0, 2.0, 41.0), True),  # cools as fast as may be
        ((0.03, 20.0, 2.0, 4.0), False),
        ((0.0, 20.0, 2.0, 4.0), False),  # a bound that is neutral
    ],
)
def test_what_is_pushed_to_the_end_of_physics_imitates_something_else(values, bent):
    heats = effect("self_heating")
    assert _bent(heats, SimpleNamespace(fit=SimpleNamespace(effect_values={heats.name: values}))) is bent


def test_a_mount_without_damping_is_not_at_the_end_of_physics():
    mount = effect("mount_compliance")
    fit = SimpleNamespace(effect_values={mount.name: (9e-7, 0.0, 0.0, 1.0, 0.0, 0.02, 0.0)})
    assert not _bent(mount, SimpleNamespace(fit=fit))


@pytest.mark.parametrize(
    ("count", "left", "verdict"),
    [(2, 30.0, "found"), (3, 30.0, "unexplained"), (3, 15.0, "found"), (2, 120.0, "unexplained")],
)
def test_more_effects_must_explain_more_than_two(monkeypatch, count, left, verdict):
    """left: of 1000 N² that could be removed, more than the noise."""
    monkeypatch.setattr(module, "_imitates", lambda *_: False)
    monkeypatch.setattr(module, "_relaxes", lambda *_: False)
    named = [
        SimpleNamespace(trial=SimpleNamespace(effect=SimpleNamespace(name=f"e{k}")), rivals=[])
        for k in range(count)
    ]
    base, final = proof(1010.0, 1020.0), proof(10.0 + left, 12.0 + left)
    assert module._verdict(base, final, named, 1000.0, cleared=False)[0] == verdict


@pytest.mark.parametrize(("lag_s", "verdict"), [(0.002, "found"), (0.05, "unexplained")])
def test_what_comes_as_late_as_any_force_may_is_no_damping_however_little_is_left(lag_s, verdict):
    """A rubber bushing beside the damper: in a band it looks like a spring and a dashpot of 50 ms."""
    dashpot = effect("viscous_damping")
    values = dashpot.vector({"damping_n_s_m": 300.0, "lag_s": lag_s})
    named = [SimpleNamespace(trial=SimpleNamespace(effect=dashpot), rivals=[])]
    base, final = proof(1010.0, 1020.0), proof(10.0, 12.0)
    final.fit = SimpleNamespace(effect_values={dashpot.name: values})
    assert module._verdict(base, final, named, 1000.0, cleared=True)[0] == verdict


def test_what_took_nearly_as_much_and_was_true_held_out_may_stand_in_its_place():
    def trial(name, gain, *, true=True):
        proof = SimpleNamespace(predicts_better_than=lambda _: true)
        return SimpleNamespace(effect=SimpleNamespace(name=name), gain=gain, proof=proof)

    chosen = trial("chosen", 100.0)
    near = [trial("a", 99.0), trial("b", 95.0, true=False), trial("c", 80.0), trial("d", 75.0)]
    level = SimpleNamespace(trials=[*near[:2], chosen, *near[2:], trial("e", 60.0)], before=None)
    assert [one.name for one in _nearly_as_good(chosen, level)] == ["a", "c"]


def test_a_form_that_ends_where_another_begins_is_not_bent():
    turns = effect("preyield_stiffness")
    one_s = turns.vector({"yield_length_m": 1e-3, "compliance_m_n": 0.0, "creep": 1.0, "rounded": 1.0})
    assert not _bent(turns, SimpleNamespace(fit=SimpleNamespace(effect_values={turns.name: one_s})))


def _still_record(n=4000, rate_hz=1000.0):
    still = np.zeros(n)
    return Record(0, rate_hz, np.sin(np.arange(n) / 50.0), still, still, still, still, still)


@pytest.mark.parametrize("drift_n", [0.0, 2.0, 40.0])
def test_a_run_that_drifts_is_searched_whole(drift_n):
    record = _still_record()
    cycles = Cycles(start=300.0, period=300.0, count=12, samples=len(record))
    floor = NoiseFloor(8.0, "cycles", 8.0, cycles=12, drift_n=drift_n, steady=cycles)
    found = shortened(record, floor, share=0.1)
    assert len(found) == (len(record) if drift_n > 8.0 else 300 + FEWEST_CYCLES * 300)
    assert shortened(record, floor, share=1.0) is record
    assert len(shortened(record, floor, share=0.6)) == (len(record) if drift_n > 8.0 else 2400)


@pytest.mark.parametrize(("count", "whole"), [(12, False), (11, False), (9, True), (5, True)])
def test_a_run_in_which_another_motion_follows_is_searched_whole(count, whole):
    record = _still_record()
    cycles = Cycles(start=300.0, period=300.0, count=count, samples=len(record))
    floor = NoiseFloor(8.0, "cycles", 8.0, cycles=count, drift_n=0.0, steady=cycles)
    assert (shortened(record, floor, share=0.1) is record) == whole


def test_another_motion_before_the_one_that_repeats_is_searched_too():
    record = _still_record()
    cycles = Cycles(start=2000.0, period=200.0, count=10, samples=len(record))
    floor = NoiseFloor(8.0, "cycles", 8.0, cycles=10, drift_n=0.0, steady=cycles)
    assert len(shortened(record, floor, share=0.1)) == 2000 + FEWEST_CYCLES * 200


def trial(taken, of_ms, **others):
    return SimpleNamespace(
        chance=0.0,
        score=1e3,
        proof=SimpleNamespace(mean_square=of_ms - taken, predicts_better_than=lambda _: True),
        **others,
    )


@pytest.mark.parametrize(
    ("taken_n", "noise_n", "real"),
    [
        (3.0, 10.0, True),  # a good share of what is left
        (0.5, 1.0, False),  # that, but hardly any of the force
        (2.5, 20.0, True),  # a small share, but well seen in the force
        (1.5, 20.0, False),  # a small share that tables may leave
        (2.5, 40.0, False),  # lost in the noise
    ],
)
def test_an_effect_must_be_worth_naming(taken_n, noise_n, real):
    total = noise_n**2 + taken_n**2
    records = [SimpleNamespace(force_n=np.full(10, 1000.0))]
    fit = SimpleNamespace(model=SimpleNamespace(records=records))
    assert accepted(trial(taken_n**2, total), SimpleNamespace(mean_square=total, fit=fit), 15) is real


@pytest.mark.parametrize(
    ("searched_s", "better_n", "borne_out"), [(10.0, 5.0, True), (4.0, 3.0, True), (4.0, 5.0, False)]
)
def test_an_effect_that_does_worse_on_the_runs_whole_is_not_borne_out(searched_s, better_n, borne_out):
    searched, full = ([_still_record(int(1000 * s))] for s in (searched_s, 10.0))
    left = {"better": [np.full(9, better_n)], "plain": [np.full(9, 4.0)]}
    evidence = SimpleNamespace(records=searched, full=full, steady_errors=left.get)
    assert Evidence.bears_out(evidence, "better", "plain") is borne_out


@pytest.mark.parametrize(
    ("before", "here", "excess", "found", "hopeless"),
    [
        (100.0, 97.0, 90.0, 1, True),  # 3 taken, at most 36 to come, of 93
        (100.0, 80.0, 75.0, 1, False),
        (100.0, 97.0, 0.0, 1, False),  # nothing is left
        (60.0, 55.0, 60.0, 2, True),  # 45 taken, at most 40 to come, of 105
        (53.0, 50.0, 26.0, 1, False),  # 50 taken, at most 36 to come, of 76, ...
        (53.0, 50.0, 26.0, 2, True),  # ... 24 by two more, and 98 % must be explained
    ],
)
def test_a_search_ends_where_no_more_effects_can_explain_what_is_missing(
    before, here, excess, found, hopeless
):
    evidence = SimpleNamespace(budget=lambda _: SimpleNamespace(excess=excess))
    proofs = (SimpleNamespace(mean_square=m, fit=None) for m in (100.0, before, here))
    assert _hopeless(evidence, *proofs, found) is hopeless


@pytest.mark.parametrize(
    ("gain", "moves", "reaches"), [(99.0, 2, True), (50.0, 2, False), (99.0, 1, False), (120.0, 3, True)]
)
def test_a_larger_effect_that_comes_to_the_same_force_has_the_smaller_as_a_special_case(gain, moves, reaches):
    """50: its bounds keep it from the force."""
    screen = SimpleNamespace(climb=lambda _effect, _start: SimpleNamespace(gain=gain))
    own = SimpleNamespace(free=np.array([True]), gain=100.0)
    other = SimpleNamespace(free=np.ones(moves, bool), effect=SimpleNamespace(neutral=(0.0,) * moves))
    assert rivals._reaches(screen, own, other) is reaches
