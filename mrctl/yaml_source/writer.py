"""Writing YAML that people read: short mappings and lists on one line, comments above each block."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from mrctl.errors import InputError
from mrctl.whole_file import try_place, whole_file

WIDTH = 100


class _Dumper(yaml.SafeDumper):
    """SafeDumper that indents lists and writes no aliases."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: FBT001, FBT002, ARG002 - PyYAML's signature
        super().increase_indent(flow, False)

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ANN401, ARG002 - PyYAML's signature
        return True


class _Block(dict[str, Any]):
    """A mapping that stands on lines of its own, however short."""


def _is_scalar(value: object) -> bool:
    return value is None or isinstance(value, str | int | float)


def _sequence(dumper: yaml.SafeDumper, data: Sequence[Any]) -> yaml.Node:
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=all(map(_is_scalar, data)))


def _mapping(dumper: yaml.SafeDumper, data: Mapping[str, Any]) -> yaml.Node:
    flow = bool(data) and all(
        isinstance(v, int | float) or v is None or (isinstance(v, str) and len(v) < 10) for v in data.values()
    )
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=flow)


def _block(dumper: yaml.SafeDumper, data: _Block) -> yaml.Node:
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=False)


_Dumper.add_representer(_Block, _block)
_Dumper.add_representer(list, _sequence)
_Dumper.add_representer(tuple, _sequence)
_Dumper.add_representer(dict, _mapping)


def render(blocks: Iterable[tuple[str, Mapping[str, Any]]]) -> str:
    """YAML text of top-level blocks in order, each with its comment (may be empty) above it.

    Floats are written with all their digits, so that reading gives the same floats again.
    """
    parts = []
    for comment, block in blocks:
        lines = [f"# {line}".rstrip() for line in comment.splitlines()]
        body = "".join(
            yaml.dump(
                _Block({key: value}),
                Dumper=_Dumper,
                sort_keys=False,
                allow_unicode=True,
                width=WIDTH,
                default_flow_style=False,
            )
            for key, value in block.items()
        )
        parts.append("\n".join([*lines, body]))
    return "\n".join(parts)


def write_atomically(path: Path | str, text: str) -> None:
    """Put the text at the path whole or not at all; raises InputError when it cannot be written there.

    A file name's bytes in the text that are not UTF-8 are escaped.
    """
    target = Path(path)
    try:
        with whole_file(target, encoding="utf-8", errors="backslashreplace") as stream:
            stream.write(text)
    except OSError as error:
        raise _unwritable(target, error) from None


def check_writable(path: Path | str, *, makes_folder: bool = False) -> None:
    """Try a place before the work whose result goes there; raises InputError when nothing can be written.

    makes_folder: who writes makes the folders that are missing.
    """
    target = Path(path)
    try:
        if target.is_dir():
            raise InputError.at(target, "is a folder", "name a file in it")
        folder = target.parent
        while makes_folder and not folder.exists():
            folder = folder.parent
        if not folder.exists():
            mend = f"make it first: mkdir -p {shlex.quote(str(folder))}"
            raise InputError.at(target, f"there is no folder {folder}", mend)
        try_place(folder / target.name)
    except OSError as error:
        raise _unwritable(target, error) from None


def _unwritable(target: Path, error: OSError) -> InputError:
    reason = error.strerror or str(error)
    return InputError.at(target, f"cannot be written ({reason})", "check the folder and its permissions")
