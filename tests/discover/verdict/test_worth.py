"""What makes a later effect more than a patch on the form of the first: its size, or that it has one size."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.noise.budget import Budget
from mrctl.discover.verdict import worth
from mrctl.discover.verdict.constancy import Change
from mrctl.discover.verdict.worth import are_steady, is_nothing, is_pushed, is_stretched, matters
from mrctl.model.effects.registry import effect, effects

SIGNALS = ("current", "velocity", "stroke", "temperature", "frequency")


def _changes(size, error=0.01):
    return [Change("viscous_damping", name, 1.0 + size, error) for name in SIGNALS]


def _proof(mean_square, held_out=None):
    records = [SimpleNamespace(force_n=np.full(10, 500.0))]
    model = SimpleNamespace(records=records, effects=SimpleNamespace(chosen=()))
    held_out = mean_square if held_out is None else held_out
    fit = SimpleNamespace(model=model)
    return SimpleNamespace(mean_square=mean_square, held_out_mean_square=held_out, fit=fit)


def _asked(
    monkeypatch,
    changes,
    before_n2,
    after_n2,
    noise_n2=25.0,
    values=(5e-7, 1e3, 0.0, 1.0, 0.0, 0.02, 0.0),
    std=1e-8,
    held_out=(),
    doubt=1.25,
    **alike,
):
    """Whether an effect matters that takes a first one's rest from one mean square to another; base: 1e4."""
    monkeypatch.setattr(worth, "changes_of", lambda _fit, _chosen: changes)
    monkeypatch.setattr(worth, "elsewhere", lambda *_: None)

    def budget(fit):
        left = before_n2 if fit is here.fit else after_n2
        return Budget(left, left, noise_n2, measured=True, most_noise=doubt * noise_n2)

    here = _proof(before_n2, *held_out[:1])
    best = SimpleNamespace(effect=effect("mount_compliance"), proof=_proof(after_n2, *held_out[1:]), fit=None)
    best.fit = best.proof.fit
    best.fit.effect_values = {"mount_compliance": values}
    best.fit.effect_std = lambda: {"mount_compliance": (std, *(0.0,) * 6)}
    return matters(SimpleNamespace(budget=budget), _proof(1e4), here, best, **alike)


def test_a_percent_of_all_counts_where_it_has_one_size_everywhere(monkeypatch):
    assert _asked(monkeypatch, _changes(0.02), 200.0, 90.0)


def test_but_not_of_one_that_alone_took_nearly_all_that_another_did(monkeypatch):
    """Steady, and a percent of all: a rival's that may be the other's form; a twentieth of all is more."""
    assert not _asked(monkeypatch, _changes(0.02), 200.0, 90.0, stands_in=True)
    assert _asked(monkeypatch, _changes(0.02), 600.0, 26.0, stands_in=True)


@pytest.mark.parametrize(
    ("alone_n2", "found", "does"),
    [
        (500.0, ["mount_compliance"], True),  # 9500 N² of 9900
        (900.0, ["mount_compliance"], False),
        (500.0, ["viscous_damping", "mount_compliance"], True),
        (5000.0, ["viscous_damping", "mount_compliance"], False),  # the larger of them took more
        (500.0, ["gas_spring"], False),  # found later: it was not tried in the first round
    ],
)
def test_an_effect_stands_in_for_one_that_took_hardly_more_alone(alone_n2, found, does):
    def trial(name: str, left_n2: float = 0.0) -> SimpleNamespace:
        return SimpleNamespace(effect=effect(name), proof=_proof(left_n2))

    tried = [("mount_compliance", 100.0), ("viscous_damping", 6000.0), ("preyield_stiffness", alone_n2)]
    first = SimpleNamespace(before=_proof(1e4), trials=[trial(*one) for one in tried])
    assert worth.stands_in(trial("preyield_stiffness"), first, [trial(name) for name in found]) is does


@pytest.mark.parametrize("changes", [_changes(0.12), _changes(0.02, error=0.06), _changes(0.02)[:3], []])
def test_nor_where_it_changes_or_that_is_not_known(monkeypatch, changes):
    assert not _asked(monkeypatch, changes, 200.0, 90.0)


@pytest.mark.parametrize(
    ("after_n2", "held_out", "counts"),
    [(60.0, (900.0, 80.0), True), (60.0, (240.0, 80.0), False), (120.0, (900.0, 80.0), False)],
)
def test_a_small_one_counts_where_data_left_out_are_foretold_far_better(
    monkeypatch, after_n2, held_out, counts
):
    """It takes 1.4 % of all: most of what is left, or half of it."""
    assert _asked(monkeypatch, _changes(0.2), 200.0, after_n2, held_out=held_out) is counts


@pytest.mark.parametrize(
    ("after_n2", "held_out", "counts"),
    [
        (27.0, (170.0, 55.0), True),  # a ninth of the excess, though a third of all
        (27.0, (170.0, 90.0), False),
        (27.0, (50.0, 26.0), False),  # nearly noise before: whether it is less over it is not known
        (45.0, (170.0, 42.0), False),  # not all that is left
    ],
)
def test_a_smaller_one_where_with_it_nothing_but_noise_is_left(monkeypatch, after_n2, held_out, counts):
    """It takes 0.7 % of all."""
    before_n2 = after_n2 + 70.0
    assert _asked(monkeypatch, _changes(0.2), before_n2, after_n2, held_out=held_out) is counts


def test_little_of_what_is_left_is_little_whatever_its_size(monkeypatch):
    assert not _asked(monkeypatch, _changes(0.0), 200.0, 170.0)


def test_next_to_nothing_of_all_counts_only_where_it_is_a_fair_part_of_what_is_left(monkeypatch):
    """It takes 0.4 % of all, and a third of what is left over the noise, at one size everywhere."""
    assert _asked(monkeypatch, _changes(0.0), 200.0, 165.0, noise_n2=120.0)
    assert not _asked(monkeypatch, _changes(0.0), 1200.0, 1165.0, noise_n2=1100.0, doubt=1.01)


def test_where_nothing_but_noise_may_be_left_what_changes_is_a_patch(monkeypatch):
    assert _asked(monkeypatch, _changes(0.02), 1000.0, 26.0)
    assert _asked(monkeypatch, _changes(0.3), 1000.0, 26.0)  # it takes far more than noise can be
    assert not _asked(monkeypatch, _changes(0.3), 1000.0, 26.0, noise_n2=900.0)


def test_steady_is_what_all_of_several_signals_say():
    assert are_steady(_changes(0.05))
    assert not are_steady([*_changes(0.01), Change("viscous_damping", "time", 0.8, 0.01)])


def test_a_small_one_at_the_end_of_what_is_physical_is_a_patch(monkeypatch):
    end = effect("mount_compliance").parameters[1].high
    assert not _asked(monkeypatch, _changes(0.02), 200.0, 90.0, values=(5e-7, end, 0.0, 1.0, 0.0, 0.02, 0.0))
    assert _asked(monkeypatch, _changes(0.02), 4000.0, 26.0, values=(5e-7, end, 0.0, 1.0, 0.0, 0.02, 0.0))


def test_a_small_one_of_a_size_that_may_as_well_be_none_is_a_patch(monkeypatch):
    assert not _asked(monkeypatch, _changes(0.02), 200.0, 90.0, std=3e-7)
    assert _asked(monkeypatch, _changes(0.02), 4000.0, 26.0, std=3e-7)


def test_a_size_that_the_runs_leave_open_is_one_where_data_left_out_are_foretold_far_better(monkeypatch):
    assert _asked(monkeypatch, _changes(0.2), 200.0, 60.0, std=3e-7, held_out=(900.0, 80.0))
    assert not _asked(monkeypatch, _changes(0.2), 200.0, 60.0, std=3e-7, held_out=(240.0, 80.0))


def _at_the_end(one, name):
    return tuple(p.high if p.name == name else p.typical for p in one.parameters)


def test_only_upper_ends_that_mean_something_are_ends():
    heats, stops = effect("self_heating"), effect("cavitation")
    assert not is_pushed(heats, (0.03, 2e4, 2.0, 4.0))  # no cooling that could be seen
    assert not is_pushed(heats, (0.03, 2.0, 2.0, 4.0))
    assert is_pushed(heats, (0.3, 200.0, 2.0, 4.0))
    assert not is_pushed(stops, tuple(p.neutral for p in stops.parameters))
    rubs = effect("coulomb_friction")
    assert not is_pushed(rubs, _at_the_end(rubs, "slow_m_s"))  # an option of its form
    assert is_pushed(rubs, _at_the_end(rubs, "presliding_m"))


def test_a_form_is_stretched_where_it_ends_of_what_could_go_both_ways():
    backbone, fluid = effect("off_state_backbone"), effect("preyield_stiffness")
    usual = {p.name: p.typical for p in backbone.parameters}
    for name, value, ends in (("power", 0.3, True), ("low_speed_change", 3.0, True), ("power", 0.31, False)):
        assert is_stretched(backbone, tuple((usual | {name: value}).values())) is ends
    # Wholly elastic and wholly rounded are forms, not ends.
    formed = {p.name: p.typical for p in fluid.parameters} | {"share": 1.0, "rounded": 1.0}
    assert not is_stretched(fluid, tuple(formed.values()))


@pytest.mark.parametrize("name", sorted(effects()))
def test_an_effect_whose_sizes_are_those_without_it_is_none_whatever_its_shapes(name):
    one = effect(name)
    sizes = [p for p in one.parameters if p.typical != p.neutral or (p.linear and not p.optional)]
    shapes = [p.low if p.neutral == p.high else p.high for p in one.parameters]
    of_no_size = tuple(p.neutral if p in sizes else x for p, x in zip(one.parameters, shapes, strict=True))
    assert sizes
    assert is_nothing(one, of_no_size)
    assert is_nothing(one, one.neutral)
    assert not is_nothing(one, one.typical)


def test_an_asymmetry_that_the_current_alone_makes_is_something():
    assert not is_nothing(effect("rebound_asymmetry"), (0.0, -0.48, 2.4, 0.0, 2.5, 0.0))


@pytest.mark.parametrize(("alike", "told"), [(-0.99, True), (0.0, False), (0.99, False)])
def test_sizes_that_trade_with_each_other_are_asked_together(alike, told):
    """Each is a third of its interval from none: together they may be far from it."""
    asymmetry = effect("rebound_asymmetry")
    size = [1, 2]  # the change of the force's scale with the current, and of its bend
    values, spread, correlation = list(asymmetry.neutral), [0.0] * len(asymmetry.parameters), np.eye(4)
    for k in size:
        spread[k] = 0.1
        values[k] += worth.half_width_95(0.1) / 3.0
    correlation[size[0], size[1]] = correlation[size[1], size[0]] = alike
    fit = SimpleNamespace(
        effect_values={asymmetry.name: tuple(values)}, effect_correlation=lambda _: correlation
    )
    assert worth.is_unsure(asymmetry, fit, {asymmetry.name: tuple(spread)})
    assert worth._told_together(asymmetry, fit, tuple(spread)) is told
