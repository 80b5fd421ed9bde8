"""A fit's effects as JSON-ready figures: parameters with units and intervals, and what they come to."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrctl.discover.verdict.own_delay import with_hold
from mrctl.identify.joint_fit import JointFit, half_width_95


def parameters_of(fit: JointFit, name: str) -> dict[str, dict[str, Any]]:
    """An effect's parameters in a fit: value, unit and 95 % interval; None where the data did not move it.

    An interval has the doubt about the model's form in it, which no noise shows: it is wider than twice a
    calibration's standard deviation, by which noise alone would move a value.
    """
    effect = next(e for e in fit.model.effects.chosen if e.name == name)
    values = fit.effect_values[name]
    spread = with_hold(fit, name, fit.effect_std()[name])
    at = fit.model.layout.size
    for other in fit.model.effects.chosen:
        if other.name == name:
            break
        at += len(other.parameters)
    result = {}
    for k, (p, value, std) in enumerate(zip(effect.parameters, values, spread, strict=True)):
        held = bool(fit.solution.held[at + k])
        reach = half_width_95(std)
        low, high = max(p.low, value - reach), min(p.high, value + reach)
        result[p.name] = {
            "value": value,
            "unit": p.unit,
            "ci95": None if held or std == 0.0 else [low, high],  # nothing was seen of it
        }
    return result


def derived_of(fit: JointFit, name: str) -> dict[str, dict[str, Any]]:
    """What an effect's parameters in a fit come to in words of the field: value and unit of each."""
    effect = next(e for e in fit.model.effects.chosen if e.name == name)
    found = {} if effect.derived is None else effect.derived(fit.effect_values[name])
    return {words: {"value": value, "unit": unit} for words, (value, unit) in found.items()}


def root(mean_square: float) -> float:
    """RMS in N."""
    return float(np.sqrt(max(mean_square, 0.0)))
