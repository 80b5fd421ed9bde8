"""Extending a model by what a diagnosis found leaves away what runs that were left out speak against."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from discover.campaigns import shipped
from hidden import one_frequency

from mrctl.cli.extend import _doubts
from mrctl.discover import extend as module
from mrctl.discover.evidence import Evidence
from mrctl.discover.extend import WORSE, extend
from mrctl.discover.fits import refit
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.model.damper import Span
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects

FIRST, SECOND = "gas_spring", "force_offset"
SPRING = {"preload_n": 0.0, "stiffness_n_m": 3000.0, "progression_per_m": 0.0}


@cache
def _springy():
    """Runs of a damper with a spring."""
    return one_frequency({FIRST: SPRING})


@cache
def _seen():
    """The same as nothing has been found in them yet: what makes it ready is not asked of each test."""
    return Evidence.of(_springy())


def _key(value):
    """What tells a fit's argument from another's."""
    match value:
        case JointFit():
            return value.theta.tobytes()
        case Record():
            return len(value)
        case Effect():
            return value.name
        case Mapping():
            return tuple((name, _key(one)) for name, one in value.items())
        case list() | tuple():
            return tuple(map(_key, value))
    return repr(value)


_FITS = {}


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch):
    """What is chosen among fits is tested here: the same fit is made once, and no filter of an inverse."""

    def once(name):
        make = getattr(refit, name)

        def made(*arguments, **named):
            key = (name, _key(arguments), _key(named))
            if key not in _FITS:
                _FITS[key] = make(*arguments, **named)
            return _FITS[key]

        return made

    for name in ("fitted", "with_one_more", "with_one_of"):
        monkeypatch.setattr(module, name, once(name))
    monkeypatch.setattr(module, "damper_of", lambda _: None)


@pytest.mark.parametrize(
    ("rise", "falling", "kept", "refused"),
    [
        (0.9, True, (FIRST, SECOND), ()),
        (WORSE * 1.01, True, (FIRST,), (SECOND,)),
        (WORSE * 1.01, False, (FIRST, SECOND), ()),
    ],
)
def test_an_effect_with_which_left_out_runs_are_predicted_worse_is_refused(
    monkeypatch, rise, falling, kept, refused
):
    """rise: of the error on the runs left out, with the second effect."""
    errors = {0: 100.0, 1: 50.0, 2: 50.0 * rise}
    monkeypatch.setattr(module, "error_on", lambda fit, *_, **_scaled: errors[len(fit.model.effects.chosen)])
    monkeypatch.setattr(module, "is_nothing", lambda *_: False)
    added = [effects()[name] for name in (FIRST, SECOND)]
    result = extend(_springy(), (), added, evidence=_seen(), falling=falling)
    assert result.effects == kept
    assert result.refused == refused
    assert [e.name for e in result.fit.model.effects.chosen] == list(kept)
    assert result.rmse_after_n == errors[2 if len(kept) == 2 else 1]


def test_an_effect_that_is_refused_alone_is_asked_again_beside_what_comes_after_it(monkeypatch):
    """Alone it makes up for the other, too, in the runs at hand, and those left out speak against it."""
    errors = {(): 30.0, (FIRST,): 40.0, (SECOND,): 29.0, (SECOND, FIRST): 9.0}

    def error(fit, *_, **_scaled):
        return errors[tuple(e.name for e in fit.model.effects.chosen)]

    monkeypatch.setattr(module, "error_on", error)
    monkeypatch.setattr(module, "is_nothing", lambda *_: False)
    shares = []
    added = [effects()[name] for name in (FIRST, SECOND)]
    result = extend(one_frequency(), (), added, falling=True, report=lambda share, _: shares.append(share))
    assert (result.effects, result.refused) == ((SECOND, FIRST), ())
    assert [error_n for _, error_n in result.steps] == [30.0, 29.0, 9.0]
    assert shares == sorted(shares)


@pytest.mark.parametrize(("falling", "kept"), [(True, (FIRST,)), (False, (FIRST, SECOND))])
def test_an_effect_that_ends_as_nothing_is_added_only_where_it_was_asked_for(monkeypatch, falling, kept):
    monkeypatch.setattr(module, "error_on", lambda fit, *_, **_scaled: 100.0 - len(fit.model.effects.chosen))
    monkeypatch.setattr(module, "is_nothing", lambda effect, _values: effect.name == SECOND)
    added = [effects()[name] for name in (FIRST, SECOND)]
    result = extend(_springy(), (), added, evidence=_seen(), falling=falling)
    assert result.effects == kept
    assert result.refused == ((SECOND,) if falling else ())


class _Motions:
    """Stands for fits without a motion: with `refuses` effects and more they predict it worse."""

    def __init__(self, effects=0, refuses=2):
        self.effects, self.refuses = effects, refuses

    @property
    def level(self):
        return -float(self.effects) if self.effects < self.refuses else float(self.effects)


@pytest.mark.parametrize(
    ("unseen", "refuses", "kept", "refused"),
    [
        ({FIRST, SECOND}, 3, (FIRST, SECOND), ()),
        ({FIRST, SECOND}, 2, (FIRST,), (SECOND,)),
        ({FIRST, SECOND}, 1, (), (FIRST, SECOND)),
        ({SECOND}, 1, (FIRST,), (SECOND,)),
        ((), 1, (FIRST, SECOND), ()),
    ],
)
def test_a_part_of_the_truth_must_help_with_motions_left_out(monkeypatch, unseen, refuses, kept, refused):
    monkeypatch.setattr(module, "error_on", lambda fit, *_, **_scaled: 100.0 - len(fit.model.effects.chosen))
    monkeypatch.setattr(module.Unseen, "of", lambda fit, *_: _Motions(len(fit.model.effects.chosen), refuses))
    monkeypatch.setattr(module, "is_nothing", lambda *_: False)
    added = [effects()[name] for name in (FIRST, SECOND)]
    result = extend(_springy(), (), added, evidence=_seen(), falling=True, unseen=unseen)
    assert result.effects == kept
    assert result.refused == refused


@pytest.mark.parametrize(("unseen", "kept"), [((), (FIRST,)), ({FIRST}, ())])
def test_a_part_of_the_truth_must_help_as_measured_where_runs_differ_in_scale(monkeypatch, unseen, kept):
    """With it, runs left out are predicted better but for their scales, and worse with them."""

    def error_on(fit, *_, scaled=False):
        return (80.0 if scaled else 110.0) if fit.model.effects.chosen else 100.0

    monkeypatch.setattr(module, "error_on", error_on)
    monkeypatch.setattr(module, "scatters", lambda _: True)
    monkeypatch.setattr(module.Unseen, "of", lambda fit, *_: _Motions(len(fit.model.effects.chosen), 3))
    result = extend(_springy(), (), [effects()[FIRST]], evidence=_seen(), falling=True, unseen=unseen)
    assert result.effects == kept


class _Named(_Motions):
    """Stands for fits without a motion: the error on it hangs on the last effect's name."""

    errors: dict

    def __init__(self, fit, *_):
        super().__init__()
        self.error = self.errors[fit.model.effects.chosen[-1].name] if fit.model.effects.size else 10.0

    @property
    def level(self):
        return float(np.log(self.error))


@pytest.mark.parametrize(
    ("errors", "runs", "kept", "refused"),
    [
        ({FIRST: 8.0, SECOND: 9.0}, {}, (FIRST,), ()),
        ({FIRST: 9.0, SECOND: 8.0}, {}, (SECOND,), ()),
        ({FIRST: 11.0, SECOND: 9.0}, {}, (SECOND,), ()),
        ({FIRST: 11.0, SECOND: 12.0}, {}, (), (FIRST,)),
        ({FIRST: 8.0, SECOND: 9.0}, {SECOND: 50.0}, (SECOND,), ()),
        ({FIRST: 8.0, SECOND: 11.0}, {SECOND: 50.0}, (FIRST,), ()),
        ({FIRST: 5.0, SECOND: 9.0}, {SECOND: 70.0}, (FIRST,), ()),
        ({FIRST: 11.0, SECOND: 9.0}, {SECOND: 110.0}, (), (FIRST,)),
    ],
)
def test_of_rivals_the_one_is_taken_that_foretells_best(monkeypatch, errors, runs, kept, refused):
    """errors: on motions left out, 10 without either; runs: on runs left out, 100 without and else 99.

    Ratios of both count alike. The runs fitted are 100 and 99.
    """

    def error_on(fit, _records, begins=None, **_scaled):
        left_out = {} if begins is None else runs
        return next((left_out.get(e.name, 99.0) for e in fit.model.effects.chosen), 100.0)

    monkeypatch.setattr(module, "error_on", error_on)
    monkeypatch.setattr(module.Unseen, "of", _Named)
    monkeypatch.setattr(_Named, "errors", errors, raising=False)
    first, second = (effects()[name] for name in (FIRST, SECOND))
    result = extend(
        _springy(), (), [first], evidence=_seen(), falling=True, unseen={FIRST, SECOND},
        instead={FIRST: [second]},
    )  # fmt: skip
    assert result.effects == kept
    assert result.refused == refused


@pytest.mark.parametrize(("motions", "kept"), [(9.6, ()), (9.4, (FIRST,))])
def test_a_part_of_the_truth_must_take_of_motions_left_out_a_share_of_what_it_takes_of_those_fitted(
    monkeypatch, motions, kept
):
    """motions: the error on those left out, 10 without the effect, which takes a tenth of the runs fitted."""
    monkeypatch.setattr(
        module, "error_on", lambda fit, *_, **_scaled: 90.0 if fit.model.effects.size else 100.0
    )
    monkeypatch.setattr(module.Unseen, "of", _Named)
    monkeypatch.setattr(_Named, "errors", {FIRST: motions}, raising=False)
    added = [effects()[FIRST]]
    result = extend(_springy(), (), added, evidence=_seen(), falling=True, unseen={FIRST})
    assert result.effects == kept


def test_a_rival_that_is_in_the_model_already_is_not_added_twice(monkeypatch):
    monkeypatch.setattr(module, "error_on", lambda fit, *_, **_scaled: 100.0 - len(fit.model.effects.chosen))
    first, second = (effects()[name] for name in (FIRST, SECOND))
    monkeypatch.setattr(module.Unseen, "of", _Named)
    monkeypatch.setattr(_Named, "errors", {FIRST: 9.0, SECOND: 8.0}, raising=False)
    result = extend(
        _springy(), (), [first, second], evidence=_seen(), falling=True, unseen={FIRST, SECOND},
        instead={FIRST: [second]},
    )  # fmt: skip
    assert result.effects == (SECOND,)
    assert result.refused == ()


@pytest.mark.parametrize("given", [True, False])
def test_a_model_that_has_been_found_is_begun_at(monkeypatch, given):
    """A base that has made up for an effect may lead its fit back to none; given, or found by itself."""
    campaign, gas = _springy(), effects()[FIRST]
    found = extend(campaign, (), [gas]).fit if given else None
    monkeypatch.setattr(
        module,
        "with_one_more",
        lambda before, records, effect, *_: module.fitted(
            records,
            (effect,),
            {FIRST: gas.neutral},
            start=before,
            free={FIRST: [False] * len(gas.parameters)},
        ),
    )
    begun = extend(campaign, (), [gas], begin=found)
    assert begun.fit.effect_values[FIRST][1] > 2500.0
    assert begun.rmse_after_n < 0.5 * begun.rmse_before_n


def _result(damper, before_n, after_n):
    return SimpleNamespace(damper=damper, rmse_before_n=before_n, rmse_after_n=after_n)


def test_an_effect_that_the_runs_left_out_do_not_bear_out_is_written_with_a_warning():
    damper = shipped()
    assert _doubts(_result(damper, 30.0, 10.0), damper, [FIRST]) == []
    (said,) = _doubts(_result(damper, 30.0, 29.9), damper, [FIRST])
    assert "does not fall with gas_spring" in said
    assert _doubts(_result(damper, 30.0, 30.0), damper, []) == []  # one that was taken out


def test_a_calibration_that_is_for_less_than_the_one_before_is_told():
    damper = shipped()
    was = damper.temperature_valid_c
    narrow = replace(damper, temperature_valid_c=Span(was.low, 0.5 * (was.low + was.high)))
    (said,) = _doubts(_result(narrow, 30.0, 10.0), damper, [FIRST])
    assert said.startswith("the calibration is for temperatures of ")
    assert _doubts(_result(damper, 30.0, 10.0), narrow, [FIRST]) == []
