"""The effects that a calibration may name, and whether it names them rightly."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches

from mrctl.calibration.models import Effect
from mrctl.errors import InputError
from mrctl.model.effects.base import Parameter
from mrctl.model.effects.registry import VARIABLE, effects
from mrctl.yaml_source import Findings, KeyPath


def known_effects() -> Mapping[str, Mapping[str, str]]:
    """Each known effect's parameters with their units; raises InputError naming a plug-in that is broken."""
    return {name: {p.name: p.unit for p in effect.parameters} for name, effect in effects().items()}


def check_effects(listed: tuple[Effect, ...], findings: Findings) -> None:
    """Each effect is known, named once, and has exactly its parameters, in their units and bounds."""
    if not listed:
        return  # nothing is to be loaded
    try:
        known = effects()
    except InputError as error:
        findings.problems += error.problems
        return
    seen: set[str] = set()
    for index, effect in enumerate(listed):
        path: KeyPath = ("effects", index)
        if effect.name in seen:
            findings.add(path, f"the effect {effect.name} stands twice", "keep one of the two")
        seen.add(effect.name)
        if effect.name in known:
            _check_parameters(effect, known[effect.name].parameters, (*path, "parameters"), findings)
            continue
        near = get_close_matches(effect.name, known, n=1)
        mend = (
            f"did you mean {near[0]}?"
            if near
            else f"there are: {', '.join(known)}; one of your own is named by {VARIABLE}"
        )
        findings.add((*path, "name"), f"unknown effect {effect.name!r}", mend)


def _check_parameters(
    effect: Effect, wanted: tuple[Parameter, ...], path: KeyPath, findings: Findings
) -> None:
    by_name = {parameter.name: parameter for parameter in wanted}
    for name, parameter in by_name.items():
        if name not in effect.parameters and not parameter.optional:
            add = f"add `{name}: {{value: ..., unit: {parameter.unit}}}`"
            findings.add(path, f"{effect.name} lacks `{name}`, {parameter.help}", add)
    for name, quantity in effect.parameters.items():
        if name not in by_name:
            findings.add((*path, name), f"{effect.name} has no `{name}`", f"it has: {', '.join(by_name)}")
            continue
        parameter = by_name[name]
        if quantity.unit != parameter.unit:
            mend = f"convert the value and write unit: {parameter.unit}"
            findings.add((*path, name, "unit"), f"{effect.name}.{name} is in {quantity.unit!r}", mend)
            continue
        low, high = parameter.reach
        if not low <= quantity.value <= high:
            what = f"{effect.name}.{name} is {quantity.value:g} {parameter.unit}"
            findings.add((*path, name, "value"), what, f"it lies in {low:g} to {high:g}")
