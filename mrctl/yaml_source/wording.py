"""A violation of a schema in words: what is wrong and the mend."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from mrctl.yaml_source.document import Document, KeyPath, dotted
from mrctl.yaml_source.model_walk import field_at, model_at
from mrctl.yaml_source.units import unit_mend

Words = tuple[str, str]  # what is wrong, the mend

_WANTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a mapping",
    "mapping_type": "a mapping",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
}
_BOUNDS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}


def explain(  # noqa: PLR0911 - one return a kind of error reads best
    model: type[BaseModel], detail: ErrorDetails, path: KeyPath, document: Document
) -> Words | None:
    """Words for one of pydantic's errors; None for one that only follows from another."""
    kind, given, name = detail["type"], detail["input"], dotted(path)
    context: dict[str, Any] = detail.get("ctx", {})
    if kind in _WANTED:
        return _wrong_type(name, _WANTED[kind], given, document.words.get(path))
    if kind in _BOUNDS:
        limit, words = _BOUNDS[kind]
        return f"`{name}` is {shown(given)}", f"it must be {words} {context[limit]:g}"
    if kind in {"missing", "extra_forbidden"}:
        return _wrong_keys(model, kind, name, detail["loc"])
    if kind == "finite_number":
        return f"`{name}` is {given}", "a finite number is wanted: measure it, or leave out that row"
    if kind == "literal_error":
        expected = str(context["expected"])
        mend = unit_mend(given, expected[1:-1]) if path[-1] == "unit" else f"write {expected}"
        return f"`{name}` is {shown(given)}", mend
    if kind == "too_short":
        if isinstance(given, list | dict) and len(given) >= context["min_length"]:
            return None  # an entry fell out for its own reason
        return f"`{name}` has too few entries", f"at least {context['min_length']} are needed"
    if kind in {"string_too_short", "string_pattern_mismatch"}:
        field = field_at(model, detail["loc"])
        return f"`{name}` is {shown(given)}", (field and field.description) or "give it a value"
    what, _, mend = detail["msg"].removeprefix("Value error, ").partition("; ")
    return f"`{name}`: {what}", mend


def _wrong_keys(model: type[BaseModel], kind: str, name: str, location: tuple[str | int, ...]) -> Words:
    """A key that is missing, with what it is for; or one too many, with the nearest that is known."""
    key = str(location[-1])
    if kind == "missing":
        field = field_at(model, location)
        about = f": {field.description}" if field is not None and field.description else ""
        return f"`{name}` is missing", f"add `{key}`{about}"
    parent = model_at(model, location[:-1])
    known = [f.alias or n for n, f in parent.model_fields.items()] if parent else []
    near = difflib.get_close_matches(key, known, n=1)
    mend = f"did you mean `{near[0]}`?" if near else "remove it; known here: " + ", ".join(known)
    return f"unknown key `{name}`", mend


def _wrong_type(name: str, wanted: str, given: object, word: str | None) -> Words:
    """What to say where a value has the wrong type; `word` is how a plain scalar was written."""
    written = word or str(given)
    what, mend = f"`{name}` is {shown(given)}", f"{wanted} is wanted"
    if isinstance(given, bool):
        what = f"`{name}`: YAML reads {written} as {str(given).lower()}"
    if wanted == "text" and isinstance(given, bool | int | float):
        what = what if isinstance(given, bool) else f"`{name}`: YAML reads {written} as a number"
        mend = f"quote it if text is meant: '{written}'"
    elif wanted.endswith("number") and isinstance(given, str):
        what = f"`{name}` is the text {shown(given)}"
        mend = _number_in(given, wanted)
    elif wanted == "a list" and isinstance(given, int | float | str):
        mend = "a list is wanted: [1.0, 2.0, …]"
    return what, mend


def _number_in(text: str, wanted: str) -> str:
    """The mend for text where a number is wanted."""
    comma = re.fullmatch(r"([-+]?\d+),(\d+)", text)
    if comma:
        return f"write the number with a point: {comma[1]}.{comma[2]}"
    if re.fullmatch(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?", text):
        return "write it without the quotation marks"
    unit = re.fullmatch(r"([-+]?\d+(?:\.\d*)?) *([^\d\s]\S*)", text)
    if unit:
        return f"write the number alone: {unit[1]}; its unit is fixed"
    return f"{wanted} is wanted"


def shown(value: object) -> str:
    """A value as the user may recognise it, short."""
    if isinstance(value, str):
        return repr(value if len(value) <= 40 else value[:37] + "...")
    if isinstance(value, list | tuple):
        return "a list"
    if isinstance(value, Mapping):
        return "a mapping"
    if value is None:
        return "empty"
    return str(value).lower() if isinstance(value, bool) else str(value)[:40]
