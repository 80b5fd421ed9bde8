"""Which trial of a round goes first, and how near to it the others must come."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mrctl.discover.search import levels
from mrctl.model.effects.registry import effects

NONE, BEST = 1000.0, 10.0  # total costs


def _look(name: str, gain: float) -> SimpleNamespace:
    return SimpleNamespace(effect=effects()[name], gain=gain)


def _proof(*, true: bool) -> SimpleNamespace:
    return SimpleNamespace(predicts_better_than=lambda _: true)


@pytest.fixture
def asked(monkeypatch):
    """The effects tried, each with what the fit it must come near costs; the first one's costs BEST."""
    seen = []

    def tried(*given, best=None):
        look = given[-1]
        seen.append((look.effect.name, None if best is None else best.total))
        total = BEST if len(seen) == 1 else NONE
        fit = SimpleNamespace(total=total)
        return SimpleNamespace(look=look, effect=look.effect, proof=_proof(true=total < NONE), fit=fit)

    monkeypatch.setattr(levels, "tried", tried)
    monkeypatch.setattr(levels, "in_processes", lambda what, of, _: [what(one) for one in of])
    return seen


def _raced(looks, trials=()):
    model = SimpleNamespace(common=[])
    before = SimpleNamespace(fit=SimpleNamespace(total=NONE, model=model))
    return levels._raced(before, None, (), looks, trials)


def test_of_those_that_promise_as_much_the_cheapest_goes_first_and_the_others_need_come_near_it(asked):
    looks = [_look("preyield_stiffness", 900.0), _look("coulomb_friction", 850.0), _look("gas_spring", 300.0)]
    assert len(_raced(looks)) == 3
    assert [name for name, _ in asked] == ["coulomb_friction", "preyield_stiffness", "gas_spring"]
    assert [best for _, best in asked] == [None, BEST, BEST]


def test_a_trial_that_does_not_foretell_runs_left_out_holds_none_back(asked):
    untrue = SimpleNamespace(fit=SimpleNamespace(total=BEST), proof=_proof(true=False))
    _raced([_look("gas_spring", 300.0)], [untrue])
    assert asked == [("gas_spring", None)]


def test_what_was_ended_early_may_have_gained_as_much_as_it_did_last_with_each_step_left():
    def gain_at_most(solution: SimpleNamespace) -> float:
        proof = SimpleNamespace(fit=SimpleNamespace(solution=solution))
        return levels.Trial(effects()["gas_spring"], _look("gas_spring", 1.0), proof, 20.0, 0.0).gain_at_most

    assert gain_at_most(SimpleNamespace(converged=True, last_gain=3.0)) == 20.0
    assert gain_at_most(SimpleNamespace(converged=False, last_gain=3.0)) == 20.0 + 6.0 * levels.ITERATIONS
