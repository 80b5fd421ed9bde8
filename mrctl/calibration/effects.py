"""The effects that a calibration may name, and whether it names them rightly."""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.calibration.models import Effect
from mrctl.yaml_source import Findings, KeyPath


def known_effects() -> Mapping[str, Mapping[str, str]]:
    """Each known effect's parameters with their units; none yet."""
    return {}


def check_effects(effects: tuple[Effect, ...], findings: Findings) -> None:
    """Each effect is known, named once, and has exactly its parameters, in their units."""
    known = known_effects()
    seen: set[str] = set()
    for index, effect in enumerate(effects):
        path: KeyPath = ("effects", index)
        if effect.name in seen:
            findings.add(path, f"the effect {effect.name} stands twice", "keep one of the two")
        seen.add(effect.name)
        if effect.name not in known:
            names = ", ".join(sorted(known)) or "none yet"
            findings.add((*path, "name"), f"unknown effect {effect.name!r}", f"this mrctl knows: {names}")
            continue
        wanted = known[effect.name]
        for parameter, unit in wanted.items():
            if parameter not in effect.parameters:
                findings.add(path, f"{effect.name} lacks `{parameter}`", f"add `{parameter}` in {unit}")
        for parameter, quantity in effect.parameters.items():
            place = (*path, "parameters", parameter)
            if parameter not in wanted:
                findings.add(
                    place, f"{effect.name} has no parameter `{parameter}`", f"it has: {', '.join(wanted)}"
                )
            elif quantity.unit != wanted[parameter]:
                findings.add(
                    (*place, "unit"),
                    f"{effect.name}.{parameter} is in {quantity.unit!r}",
                    f"convert the value and write unit: {wanted[parameter]}",
                )
