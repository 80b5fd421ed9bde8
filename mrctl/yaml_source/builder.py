"""From YAML nodes to plain data: keys as text, scalars by YAML 1.1's rules, its traps as problems."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import yaml

from mrctl.errors import Problem
from mrctl.printable import printable
from mrctl.yaml_source.document import KeyPath

MAX_NODES = 100_000  # after aliases are followed; a large calibration has some thousands
MAX_DIGITS = 40

_TAG = "tag:yaml.org,2002:"
_EXPONENT = re.compile(r"[-+]?(\d[\d_]*\.?\d*|\.\d+)[eE][-+]?\d+")
_SEXAGESIMAL = re.compile(r"[-+]?\d[\d_]*(:[0-5]?\d)+(\.\d*)?")
_OCTAL = re.compile(r"[-+]?0[0-7_]+")
_TRUE = frozenset({"true", "yes", "on"})
_FALSE = frozenset({"false", "no", "off"})


class TooDeep(Exception):  # noqa: N818 - never leaves this package
    """Nesting or alias expansion beyond reason."""

    def __init__(self, line: int) -> None:
        super().__init__(line)
        self.line = line


@dataclass(slots=True)
class Built:
    """What `build` makes of a root mapping."""

    file: str
    data: dict[str, Any] = field(default_factory=dict)
    lines: dict[KeyPath, int] = field(default_factory=dict)
    words: dict[KeyPath, str] = field(default_factory=dict)
    slips: list[tuple[KeyPath, Problem]] = field(default_factory=list)
    nodes: int = 0

    def slip(self, path: KeyPath, line: int, what: str, mend: str) -> None:
        """Note something wrong with the value at a path."""
        self.slips.append((path, Problem(self.file, line, printable(what), printable(mend))))


def build(root: yaml.MappingNode, file: str, max_depth: int) -> Built:
    """Plain data and line marks of a root mapping; raises TooDeep."""
    built = Built(file)
    built.lines[()] = root.start_mark.line + 1
    built.data = _mapping(root, (), built, max_depth)
    return built


def _value(node: yaml.Node, path: KeyPath, built: Built, depth: int) -> Any:  # noqa: ANN401 - YAML's values
    """The node's plain value; depth is what nesting is left."""
    line = node.start_mark.line + 1
    built.nodes += 1
    if depth <= 0 or built.nodes > MAX_NODES:
        raise TooDeep(line)
    plain_tag = node.tag.startswith(_TAG) and node.tag.removeprefix(_TAG) not in {
        "binary",
        "set",
        "omap",
        "pairs",
    }
    if not plain_tag or node.tag.startswith(_TAG + "python/"):
        built.slip(path, line, f"the tag {_short(node.tag)} is not understood", "remove it")
    if isinstance(node, yaml.MappingNode):
        return _mapping(node, path, built, depth - 1)
    if isinstance(node, yaml.SequenceNode):
        items = []
        for index, item in enumerate(node.value):
            built.lines[(*path, index)] = item.start_mark.line + 1
            items.append(_value(item, (*path, index), built, depth - 1))
        return items
    return _scalar(node, path, built)


def _mapping(node: yaml.MappingNode, path: KeyPath, built: Built, depth: int) -> dict[str, Any]:
    """The mapping with its keys as written; merged entries (`<<`) stand behind its own."""
    if depth <= 0:
        raise TooDeep(node.start_mark.line + 1)
    data: dict[str, Any] = {}
    merged: list[yaml.Node] = []
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        if not isinstance(key_node, yaml.ScalarNode):
            built.slip(
                (*path, "?"), line, "a key is a list or a mapping", "write a plain word before the colon"
            )
            continue
        if key_node.tag == _TAG + "merge":
            merged += value_node.value if isinstance(value_node, yaml.SequenceNode) else [value_node]
            continue
        key = str(key_node.value)
        if key in data:
            first = built.lines[(*path, key)]
            built.slip(
                (*path, key), line, f"`{key}` stands twice, here and in line {first}", "keep one of the two"
            )
            continue
        built.lines[(*path, key)] = line
        data[key] = _value(value_node, (*path, key), built, depth)
    for source in merged:
        built.nodes += 1
        if not isinstance(source, yaml.MappingNode):
            line = source.start_mark.line + 1
            built.slip((*path, "<<"), line, "only a mapping can be merged with <<", "name a mapping's anchor")
            continue
        inner = Built(built.file, nodes=built.nodes)
        extra = _mapping(source, path, inner, depth - 1)
        built.nodes = inner.nodes
        _merge(data, extra, path, built, inner)
    return data


def _merge(data: dict[str, Any], extra: dict[str, Any], path: KeyPath, built: Built, inner: Built) -> None:
    """Add what a merged mapping has and the mapping itself has not, with its marks and slips."""
    new = [key for key in extra if key not in data]
    for key in new:
        data[key] = extra[key]
    depth, taken = len(path), {(key,) for key in new}
    built.lines |= {place: line for place, line in inner.lines.items() if place[depth : depth + 1] in taken}
    built.words |= {place: word for place, word in inner.words.items() if place[depth : depth + 1] in taken}
    built.slips += [(place, slip) for place, slip in inner.slips if place[depth : depth + 1] in taken]


def _scalar(node: yaml.Node, path: KeyPath, built: Built) -> Any:  # noqa: ANN401 - YAML's values
    """The scalar's value: text, number, truth value or None."""
    text, line = str(node.value), node.start_mark.line + 1
    kind = node.tag.removeprefix(_TAG)
    plain = getattr(node, "style", None) is None
    if plain:
        built.words[path] = text
    if kind in {"int", "float"}:
        return _number(text, kind, path, line, built)
    if kind == "bool":
        if text.lower() not in _TRUE | _FALSE:
            built.slip(path, line, f"{_short(text)} is neither true nor false", "remove the tag before it")
        return text.lower() in _TRUE
    if kind == "null":
        return None
    if plain and kind == "str" and _EXPONENT.fullmatch(text):
        number = float(text.replace("_", ""))
        built.slip(
            path,
            line,
            f"YAML reads {text} as text, not as a number",
            f"write {_dotted_exponent(text)} (or quote it if text is meant)",
        )
        return number
    return text


def _number(text: str, kind: str, path: KeyPath, line: int, built: Built) -> float | str:
    """A number as YAML 1.1 reads it; what a person would read differently is a slip."""
    if len(text) > MAX_DIGITS:
        built.slip(path, line, f"a number of {len(text)} characters", "17 digits are all that count")
        return 0.0
    if _SEXAGESIMAL.fullmatch(text):
        built.slip(
            path,
            line,
            f"YAML reads {text} as a number to base 60",
            "write the plain number, or quote it if text is meant",
        )
        return text
    if _OCTAL.fullmatch(text):
        built.slip(
            path,
            line,
            f"YAML reads {text} as an octal number",
            "write it without the leading zero, or quote it",
        )
        return text
    word = text.replace("_", "").lower()
    special = {".nan": "nan", ".inf": "inf", "+.inf": "inf", "-.inf": "-inf"}
    try:
        return int(word, 0) if kind == "int" else float(special.get(word, word))
    except ValueError:
        built.slip(path, line, f"{_short(text)} is not a number", "remove the tag before it")
        return text


def _dotted_exponent(text: str) -> str:
    """The number as YAML 1.1 wants it: a point in the mantissa, a sign in the exponent."""
    mantissa, _, exponent = text.lower().replace("_", "").partition("e")
    sign = "-" if exponent.startswith("-") else "+"
    mantissa = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}e{sign}{exponent.lstrip('+-')}"


def _short(text: str) -> str:
    """Text that fits on a line of output."""
    return text if len(text) <= 40 else text[:37] + "..."
