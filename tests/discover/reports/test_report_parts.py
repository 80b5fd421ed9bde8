"""What the reports say of a model is said at the samples measured, and of steps as they were taken."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.reports import report_parts as parts
from mrctl.discover.reports.report_parts import falling_error
from mrctl.model.effects.registry import effects
from mrctl.report.page import Page


def test_the_spectrum_of_what_is_left_is_of_the_samples_not_of_what_lies_between(monkeypatch):
    rng = np.random.default_rng(3)
    noise = 5.0 * rng.standard_normal(4000)
    between = np.interp(np.arange(8000) / 2.0, np.arange(4000), noise)
    zeros = np.zeros(8000)
    record = SimpleNamespace(
        force_n=between,
        rate_hz=1000.0,
        finer=2,
        run=0,
    )
    drawn = []
    monkeypatch.setattr(parts, "line_plot", lambda *_args, **_: drawn.append(_args[3]))
    monkeypatch.setattr(parts, "_run", lambda *_: None)
    monkeypatch.setattr(Page, "figure", lambda *_: None)
    fit = SimpleNamespace(
        model=SimpleNamespace(on=lambda _: SimpleNamespace(predict=lambda _: [zeros])), theta=0
    )
    names = SimpleNamespace(runs=[SimpleNamespace(name="a.csv")])
    parts.what_it_becomes(Page("x", "y"), [((), 5.0)], None, fit, fit, [record], names)
    for series in drawn[0]:
        density = np.asarray(series.y)
        assert np.max(series.x) <= 250.0
        # White noise is level: 5 N over 250 Hz.
        assert np.sqrt(np.mean(density**2)) == pytest.approx(5.0 / np.sqrt(250.0), rel=0.1)


@pytest.mark.parametrize(
    ("steps", "labels"),
    [
        ([(), ("a",), ("a", "b")], ["base model", "+ a", "+ b"]),
        ([("a",), ()], ["a", "- a"]),
        ([("a", "b"), ("b",), ("b", "c")], ["a, b", "- a", "+ c"]),
    ],
)
def test_each_step_says_what_was_added_or_taken_away(monkeypatch, steps, labels):
    told = []
    monkeypatch.setattr(parts, "waterfall", lambda *args, **_: told.extend(label for label, _ in args[2]))
    falling_error([(names, 1.0) for names in steps], None)
    assert told == labels


def test_a_card_shows_what_is_at_a_bound_and_leaves_away_what_is_as_if_not_there():
    def p(value, ci95=None, unit="1"):
        return {"value": value, "unit": unit, "ci95": ci95}

    parameters = {
        "compliance_m_n": p(1e-6, [0.9e-6, 1.1e-6], "m/N"),
        "hardening_per_m2": p(0.0, None, "1/m2"),
    }
    shown = dict(parts.parameter_values("mount_compliance", parameters))
    assert list(shown) == ["compliance_m_n"]
    creep = next(known for known in effects()["preyield_stiffness"].parameters if known.name == "creep")
    shown = parts.parameter_values("preyield_stiffness", {"creep": p(creep.high), "yield_length_m": p(1e-3)})
    assert [text.partition(",")[2] for _, text in shown] == [" not moved by this data", " at its bound"]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ((), "left out of the fits in turn"),
        (("a.csv", "b.csv"), "a.csv, b.csv."),
        ("abcdef", "d and 2 more."),
    ],
)
def test_the_falling_error_says_what_it_is_the_error_on(names, said):
    assert parts._held_out(names).partition(said)[1] == said
