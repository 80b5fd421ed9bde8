"""A look begins again elsewhere where it does not find what a glance promised."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.fits.screen import Look
from mrctl.discover.search import looks as module

PROMISES = [(9.0, (1.0,)), (8.0, (2.0,)), (7.0, (3.0,)), (6.0, (4.0,))]


_EFFECT = SimpleNamespace(name="a", far=None, starting_points=lambda _: [()], parameters=())


def _tangent():
    fit = SimpleNamespace(model=SimpleNamespace(records=[], common=[]))
    few = SimpleNamespace(residual=np.ones(4), fit=fit)
    return SimpleNamespace(residual=np.ones(4), fit=fit, glance=lambda _: few)


class _Screen:
    """Gains by the starting point, which the case sets."""

    gains: dict
    asked: list

    tangent = SimpleNamespace(frozen=True, fit=None)

    def __init__(self, *_):
        pass

    def glance(self, _):
        return PROMISES[::-1]

    def climb(self, effect, start):
        self.asked.append(start)
        return self.at(effect, start)

    def at(self, effect, start):
        return SimpleNamespace(effect=effect, gain=self.gains[start], start=start)


@pytest.mark.parametrize(
    ("gains", "asked", "best"),
    [
        ((9.0, 1.0, 1.0), 1, 9.0),  # as promised
        ((-3.0, 8.0, 1.0), 2, 8.0),  # the first was an illusion
        ((-3.0, 2.0, 1.0), 3, 2.0),  # and so were all: the best of them
    ],
)
def test_a_look_begins_again_where_a_promise_was_not_kept(monkeypatch, gains, asked, best):
    _Screen.gains, _Screen.asked = dict(zip([(1.0,), (2.0,), (3.0,)], gains, strict=True)), []
    monkeypatch.setattr(module, "Screen", _Screen)
    monkeypatch.setattr(module, "reach_of", lambda _: None)
    (look,) = module.looks(_tangent(), [_EFFECT])
    assert look.gain == best
    assert len(_Screen.asked) == asked


@pytest.mark.parametrize(
    ("least", "sure", "asked"), [(30.0, None, 1), (40.0, None, 0), (40.0, _EFFECT.name, 1)]
)
def test_what_at_a_glance_is_of_no_use_is_not_looked_at_closely(monkeypatch, least, sure, asked):
    """It promises 9, and may gain four times as much."""
    _Screen.gains, _Screen.asked = {(1.0,): 9.0, (2.0,): 9.0, (3.0,): 9.0}, []
    monkeypatch.setattr(module, "Screen", _Screen)
    monkeypatch.setattr(module, "reach_of", lambda _: None)
    module.looks(_tangent(), [_EFFECT], least=least, sure=sure)
    assert len(_Screen.asked) == asked


@pytest.mark.parametrize(("least", "asked"), [(0.0, True), (5.0, True), (7.0, False)])
def test_a_promise_too_faint_for_any_use_is_not_gone_on_with(monkeypatch, least, asked):
    """It promises a gain of 3; least: without which a look is of no use, and it may gain twice as much."""
    _Screen.gains, _Screen.asked, far = dict.fromkeys([(1.0,), (2.0,), (3.0,)], 9.0), [], []
    promise = module.Promise(_EFFECT, np.zeros(1), 3.0)
    monkeypatch.setattr(module, "Screen", _Screen)
    monkeypatch.setattr(module, "reach_of", lambda _: None)
    monkeypatch.setattr(module, "far_points", lambda *_: [(_EFFECT, [()])])
    monkeypatch.setattr(module, "promises", lambda *_: [promise])
    monkeypatch.setattr(module, "far_look", lambda _, worth: far.append(worth))
    module.looks(_tangent(), [_EFFECT], least=least)
    assert far == ([[promise]] if asked else [])


@pytest.mark.parametrize(("held", "rarely"), [(1.0, False), (0.9, False), (0.3, True), (0.05, True)])
def test_a_stop_acts_rarely_and_a_spring_does_not(held, rarely):
    """held: the share of the samples in which the force acts."""
    force = np.where(np.arange(1000) < 1000 * held, np.sin(np.arange(1000)), 0.0)
    look = Look(None, 1.0, (), force, np.zeros((0, 1000)), np.zeros(0), True, 1.0, 1.0, np.zeros(0, bool))
    assert look.acts_rarely is rarely
