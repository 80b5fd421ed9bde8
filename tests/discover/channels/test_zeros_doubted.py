"""What is missing may have seemed to be runs' own zeros, or a smoothing: then runs as measured count too."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from discover.hidden import one_frequency, rich

from mrctl.discover import diagnose as module
from mrctl.discover import taken_anew
from mrctl.discover.diagnose import Diagnosis
from mrctl.discover.evidence import Evidence


class _Evidence:
    """Evidence in whose runs a base sees zeros, or that their velocities were smoothed, or neither."""

    def __init__(self, *, zeros: bool = False, smoothed: bool = False):
        self.taken = _Evidence() if zeros else self
        self.sharp = _Evidence() if smoothed else self

    def sized(self, known):
        return known

    def base(self, *_):
        return SimpleNamespace(fit=SimpleNamespace(effect_values={}))

    def steadied(self, _):
        return self

    def resolved(self, _):
        return self

    def sharpened(self, _):
        return self.sharp

    def zeroed(self, _):
        return self.taken

    def synchronised(self, _):
        return self


def _diagnosis(verdict, found, total):
    given = dict.fromkeys(Diagnosis.__dataclass_fields__)
    return Diagnosis(
        **given | {"verdict": verdict, "found": ["one"] * found, "balance": SimpleNamespace(total=total)}
    )


ZEROED = {"unexplained": ("unexplained", 1, 11.0), "found": ("found", 2, 11.0), "none": ("none", 0, 11.0)}


@pytest.mark.parametrize(
    ("zeroed", "plain", "better"),
    [
        ("unexplained", ("found", 1, 10.0), True),
        ("unexplained", ("found", 3, 10.0), True),
        ("unexplained", ("found", 1, 12.0), False),  # zeros explain more
        ("unexplained", ("unexplained", 1, 10.0), False),
        ("unexplained", ("none", 0, 10.0), False),
        ("found", ("found", 1, 10.0), True),
        ("found", ("found", 3, 10.0), False),  # an effect in the zeros' place
        ("found", ("found", 1, 11.5), True),  # as well with fewer
        ("found", ("found", 1, 12.0), False),
        ("found", ("found", 2, 10.0), True),
        ("found", ("found", 2, 11.5), False),
        ("found", ("none", 0, 11.5), True),
        ("found", ("unexplained", 1, 10.0), False),
        ("none", None, False),  # nothing to doubt
    ],
)
def test_the_better_explanation_counts(monkeypatch, zeroed, plain, better):
    evidence = _Evidence(zeros=True)
    said = {evidence.taken: _diagnosis(*ZEROED[zeroed])}
    if plain is not None:
        said[evidence] = _diagnosis(*plain)
    monkeypatch.setattr(module.Evidence, "of", lambda _: evidence)
    shares = []

    def diagnosed(e, report, **_):
        report(0.3, "candidates")
        report(0.9, "one effect")
        return said[e]

    monkeypatch.setattr(module, "_diagnosed", diagnosed)
    told = module.diagnose(None, report=lambda share, _: shares.append(share))
    assert told.balance is said[evidence if better else evidence.taken].balance
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


@pytest.mark.parametrize(
    ("sharp", "plain", "better"),
    [
        (("none", 0, 11.0), None, False),  # all that is missing was smoothed away
        (("found", 2, 11.0), ("found", 1, 10.0), True),
        (("found", 1, 11.0), ("unexplained", 1, 15.0), False),
        (("unexplained", 1, 11.0), ("found", 1, 10.0), True),
        (("unexplained", 1, 11.0), ("unexplained", 1, 10.0), False),
    ],
)
def test_runs_that_are_not_sharpened_count_where_something_is_missing(monkeypatch, sharp, plain, better):
    evidence = _Evidence(smoothed=True)
    said = {evidence.sharp: _diagnosis(*sharp)}
    if plain is not None:
        said[evidence] = _diagnosis(*plain)
    monkeypatch.setattr(module.Evidence, "of", lambda _: evidence)
    monkeypatch.setattr(module, "_diagnosed", lambda e, **_: said[e])
    told = module.diagnose(None)
    assert told.balance is said[evidence if better else evidence.sharp].balance


def test_without_zeros_there_is_one_diagnosis(monkeypatch):
    asked = []
    monkeypatch.setattr(module.Evidence, "of", lambda _: _Evidence())
    monkeypatch.setattr(
        module, "_diagnosed", lambda e, **_: asked.append(e) or _diagnosis("unexplained", 1, 11.0)
    )
    module.diagnose(None)
    assert len(asked) == 1


class _Searched(Exception):  # noqa: N818 - no error
    """A search has begun."""


@pytest.mark.parametrize(("campaign", "fits"), [(one_frequency, 2), (rich, 3)])
def test_a_best_valley_that_was_asked_for_zeros_is_not_fitted_again(monkeypatch, campaign, fits):
    """The first fit and its best valley; where a current stepped, a fit to other times is another."""
    asked, plain = [], Evidence.base

    def searched(*_):
        raise _Searched

    monkeypatch.setattr(Evidence, "base", lambda *given: asked.append(given) or plain(*given))
    monkeypatch.setattr(module, "rounds_of", searched)
    with pytest.raises(_Searched):
        module.diagnose(campaign())
    assert len(asked) == fits


@pytest.mark.parametrize(("left_n2", "taken"), [(40.0, True), (60.0, False)])
def test_zeros_taken_anew_stay_only_where_they_leave_less(monkeypatch, left_n2, taken):
    """A fit to runs without their zeros may end in another valley, of a warmth that foretells nothing."""
    anew = SimpleNamespace(records=(), folds=())
    anew.evened = lambda _: anew
    evidence = SimpleNamespace(zeroed=lambda _: anew)
    before, there = (SimpleNamespace(fit=None, mean_square=n2) for n2 in (50.0, left_n2))
    monkeypatch.setattr(taken_anew, "fitted_to", lambda *_: None)
    monkeypatch.setattr(taken_anew, "prove", lambda *_: there)
    expected = (anew, there) if taken else (evidence, before)
    assert taken_anew.rezeroed(evidence, before) == expected
