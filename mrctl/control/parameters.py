"""Named, bounded parameters: what is wrong with the given ones, and the full set with defaults filled in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import NamedTuple

from mrctl.control.base import Parameter, ParameterValue


class Fault(NamedTuple):
    """One thing wrong with a set of parameters, and its mend."""

    name: str
    what: str
    mend: str

    def __str__(self) -> str:
        """`what is wrong; the mend`."""
        return f"{self.what}; {self.mend}"


def parameter_faults(parameters: Iterable[Parameter], given: Mapping[str, object]) -> list[Fault]:
    """All that is wrong with the names, types and bounds of the given parameters; empty when all is well."""
    known = {parameter.name: parameter for parameter in parameters}
    faults = [
        Fault(name, f"no parameter {name!r} here", _mend_name(name, known)) for name in given.keys() - known
    ]
    faults.sort()
    for name, parameter in known.items():
        if name in given:
            faults.extend(_value_faults(parameter, given[name]))
    return faults


def resolve(
    owner: str, parameters: Iterable[Parameter], given: Mapping[str, object]
) -> dict[str, ParameterValue]:
    """All parameters by name: the given value, else the default. Tables become tuples of floats.

    Raises ValueError, one line with every fault and its mend, beginning with the owner.
    """
    parameters = tuple(parameters)
    faults = parameter_faults(parameters, given)
    if faults:
        raise ValueError(f"{owner}: " + "; also ".join(map(str, faults)))
    values = {parameter.name: given.get(parameter.name, parameter.default) for parameter in parameters}
    return {
        name: tuple(float(x) for x in value) if isinstance(value, Sequence) else float(value)  # type: ignore[arg-type]  # checked above
        for name, value in values.items()
    }


def number(values: Mapping[str, ParameterValue], name: str) -> float:
    """The value of a parameter that is a single number."""
    value = values[name]
    if isinstance(value, Sequence):
        raise TypeError(f"{name} is a table")
    return value


def table(values: Mapping[str, ParameterValue], name: str) -> tuple[float, ...]:
    """The value of a parameter that is a table column."""
    value = values[name]
    if not isinstance(value, Sequence):
        raise TypeError(f"{name} is no table")
    return tuple(value)


def _mend_name(name: str, known: Mapping[str, Parameter]) -> str:
    if not known:
        return "leave it out: there are no parameters"
    close = get_close_matches(name, known, n=1)
    return f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(known)}"


def _value_faults(parameter: Parameter, value: object) -> list[Fault]:
    is_table = isinstance(parameter.default, Sequence)
    given_table = isinstance(value, Sequence) and not isinstance(value, str)
    bounds = f"from {parameter.low:g} to {parameter.high:g} {parameter.unit}"
    if is_table != given_table:
        kind = "a list of numbers" if is_table else "a number"
        return [Fault(parameter.name, f"{parameter.name} is {value!r}", f"give {kind} {bounds}")]
    entries: Sequence[object] = value if isinstance(value, Sequence) and given_table else [value]
    if is_table and not entries:
        return [Fault(parameter.name, f"{parameter.name} is empty", f"give a list of numbers {bounds}")]
    mend = f"give {'numbers' if is_table else 'a number'} {bounds}"
    return [
        Fault(parameter.name, f"{parameter.name} is {entry!r}", mend)
        for entry in entries
        if not _within(entry, parameter)
    ]


def _within(entry: object, parameter: Parameter) -> bool:
    if isinstance(entry, bool) or not isinstance(entry, (int, float)):
        return False
    return math.isfinite(entry) and parameter.low <= entry <= parameter.high
