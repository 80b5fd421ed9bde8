"""What is wrong with an effect's description, in words, before anything depends on it.

A slip in a user's own file, such as a comma that is missing, must not come out as a traceback. So it is asked
first whether every part is of its kind, and what the parts say only where all are.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from enum import StrEnum
from numbers import Real

from mrctl.model.effects.base import (
    ARGUMENTS,
    CONDITIONS,
    SIGNALS,
    UNDONE_BY,
    WITH_UNDO,
    Effect,
    GivesWay,
    Parameter,
    Stage,
    Step,
    Undo,
    force_power,
)

TEXTS = "name", "summary", "equation", "source", "inverse_note"
# Each with an example of what may be in it.
SETS = {"needs": "displacement", "shape_over": "velocity", "alike_at_one_level": "gas_spring"}
COMPILED = "step", "undo"  # so that nothing but a plain function will do
CALLED = "start", "guesses", "far", "derived", "plausible", "rescaled"
WORDS = "name", "unit", "help"
NUMBERS = "neutral", "low", "high", "typical", "scale"


def faults(effect: Effect) -> list[str]:
    """What is wrong with an effect's description, in words; empty when it is sound."""
    return list(_of_another_kind(effect)) or list(_unsound(effect))


def _of_another_kind(effect: Effect) -> Iterator[str]:
    """The parts that are not what `Effect` declares, for which nobody has checked a user's file."""
    for what in TEXTS:
        if not isinstance(getattr(effect, what), str):
            yield f"{what} is a {_kind(effect, what)}, not a text; write it in quotes"
    yield from _choice_faults(effect, "stage", Stage)
    yield from _choice_faults(effect, "inverse", Undo)
    yield from _tuple_faults(effect, "parameters", Parameter, "Parameter(...)")
    yield from _tuple_faults(effect, "states", str, '"..."')
    for what, example in SETS.items():
        names = getattr(effect, what)
        if not isinstance(names, frozenset) or not all(isinstance(name, str) for name in names):
            yield f'{what} is {names!r}, not a frozenset of names; write frozenset({{"{example}"}})'
    for what in (*COMPILED, *CALLED):
        function = getattr(effect, what)
        fits = inspect.isfunction(function) if what in COMPILED else callable(function)
        if not fits and (function is not None or what == "step"):
            yield f"{what} is a {_kind(effect, what)}, not a plain function; name one that `def` makes"
    others = (
        ("gives_way", GivesWay | None, "GivesWay(step, start, inside, bears)"),
        ("rank", int, "a whole number"),
        ("felt", bool, "True or False"),
    )
    for what, kind, one in others:
        if not isinstance(getattr(effect, what), kind):
            yield f"{what} is a {_kind(effect, what)}; make it {one}"


def _choice_faults(effect: Effect, what: str, choices: type[StrEnum]) -> Iterator[str]:
    if not isinstance(getattr(effect, what), choices):
        known = ", ".join(f"{choices.__name__}.{choice.name}" for choice in choices)
        yield f"{what} is {getattr(effect, what)!r}; take one of {known}"


def _tuple_faults(effect: Effect, what: str, kind: type, one: str) -> Iterator[str]:
    items = getattr(effect, what)
    if isinstance(items, kind):
        yield f"{what} is a {kind.__name__}, not a tuple; a comma is missing behind it: ({one},)"
        return
    if not isinstance(items, tuple):
        yield f"{what} is a {_kind(effect, what)}, not a tuple; write ({one},)"
        return
    for item in items:
        if not isinstance(item, kind):
            yield f"{what} has a {type(item).__name__} in it; each must be {one}"
        elif isinstance(item, Parameter):
            yield from _value_faults(item)


def _value_faults(p: Parameter) -> Iterator[str]:
    for kind, kinds, names in ((str, "text", WORDS), (Real, "number", NUMBERS)):
        for what in names:
            if not isinstance(getattr(p, what), kind):
                yield f"parameter {p.name} has the {what} {getattr(p, what)!r}; make it a {kinds}"


def _kind(effect: Effect, what: str) -> str:
    return type(getattr(effect, what)).__name__


def _unsound(effect: Effect) -> Iterator[str]:
    """What does not hold together in a description whose parts are all of their kinds."""
    for what in TEXTS:
        if not getattr(effect, what).strip():
            yield f"{what} is empty"
    if not effect.parameters:
        yield "it has no parameters"
    names = [parameter.name for parameter in effect.parameters]
    yield from (f"parameter {name} stands twice" for name in sorted({n for n in names if names.count(n) > 1}))
    for parameter in effect.parameters:
        yield from _parameter_faults(parameter)
    yield from (f"needs {signal}: not one of {sorted(SIGNALS)}" for signal in sorted(effect.needs - SIGNALS))
    if effect.linear and effect.stage is not Stage.OUTPUT:
        yield f"linear is of output effects only, not of a {effect.stage} effect"
    unknown = sorted(effect.shape_over - CONDITIONS)
    yield from (f"shape_over {condition}: not one of {sorted(CONDITIONS)}" for condition in unknown)
    yield from _function_faults(effect)


def _parameter_faults(p: Parameter) -> Iterator[str]:
    if not (p.help and p.unit):
        yield f"parameter {p.name} lacks its unit or help (unit 1 where it has none)"
    try:
        force_power(p.unit)
    except ValueError:
        yield f"parameter {p.name} has the unit {p.unit}; write N, kg, J and W in whole powers, as N*s^2/m^2"
    if not all(map(math.isfinite, (p.neutral, p.low, p.high, p.typical, p.scale))) or p.low >= p.high:
        yield f"parameter {p.name} lacks finite bounds, low below high"
    elif not (p.low <= p.neutral <= p.high and p.low <= p.typical <= p.high):
        yield f"parameter {p.name} has its neutral or typical value outside its bounds"


def _function_faults(effect: Effect) -> Iterator[str]:
    expected = ARGUMENTS[effect.stage]
    yield from _signature_faults("step", effect.step, expected)
    if effect.start is not None:
        yield from _signature_faults("start", effect.start, tuple(a for a in expected if a != "s"))
    if bool(effect.states) != (effect.start is not None):
        yield "states and start belong together: words for the state, and what makes it"
    if effect.inverse not in UNDONE_BY[effect.stage] | {Undo.NOT_UNDONE}:
        yield f"a {effect.stage} effect is not undone by {effect.inverse}"
    by_undo = effect.stage in WITH_UNDO and effect.inverse is not Undo.NOT_UNDONE
    if by_undo != (effect.undo is not None):
        yield f"undo is {'missing' if by_undo else 'never called'}: a {effect.stage} effect, {effect.inverse}"
    if effect.undo is not None:
        yield from _signature_faults("undo", effect.undo, expected)


def _signature_faults(what: str, function: Step, expected: tuple[str, ...]) -> Iterator[str]:
    try:
        actual = tuple(inspect.signature(function).parameters)
    except (TypeError, ValueError):  # of a class or a built-in that says nothing of itself
        yield f"{what} is not a plain function"
        return
    if len(actual) != len(expected):
        yield f"{what} takes ({', '.join(actual)}), its stage hands it ({', '.join(expected)})"
