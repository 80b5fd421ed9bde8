"""Reading YAML with line marks; refuses what is not one plain mapping, and names YAML 1.1's traps.

PyYAML takes the last of two equal keys, reads `1e-3` as text, `on` as true, `12:30` as 750 and `010` as 8,
all without a word. Here each of them is a problem with its line.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import yaml

from mrctl.errors import InputError
from mrctl.printable import printable
from mrctl.yaml_source.builder import TooDeep, build
from mrctl.yaml_source.document import Document

MAX_BYTES = 4_000_000
MAX_DEPTH = 32

# From what PyYAML says to what a person can do about it; the first that fits counts.
_MENDS = (
    ("'\\t'", "indent with spaces, not tabs"),
    ("mapping values are not allowed", "check the indentation above, and quote text that holds a colon"),
    ("could not find expected ':'", "write `key: value`, with a space after the colon"),
    ("expected ',' or ']'", "separate list items by commas and close the list with ]"),
    ("expected ',' or '}'", "separate entries by commas and close the mapping with }"),
    ("expected <block end>", "check the indentation: entries of one block start in the same column"),
    ("undefined alias", "define it with &name before it is used as *name"),
    ("while scanning a quoted scalar", "close the quotation mark"),
    ("cannot start any token", "put text with special characters in quotes"),
)


class _Loader(yaml.SafeLoader):
    """Composes nodes as PyYAML does, but refuses nesting that would exhaust the stack."""

    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """One node; raises TooDeep."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise TooDeep(self.peek_event().start_mark.line + 1)  # type: ignore[no-untyped-call]
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


def read_document(path: Path | str) -> Document:
    """The YAML file as data with line marks; raises InputError when it is no single mapping in UTF-8."""
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise InputError.at(file, "there is no such file", "check the path") from None
    except IsADirectoryError:
        raise InputError.at(file, "this is a folder", "name a file in it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError.at(
            file, f"cannot be read ({reason})", "check the path and its permissions"
        ) from None
    return parse_document(raw, file)


def parse_document(raw: bytes, file: str) -> Document:
    """The bytes of a YAML file as data with line marks; `file` is the name that problems carry."""
    if len(raw) > MAX_BYTES:
        raise InputError.at(
            file, f"larger than {MAX_BYTES // 1_000_000} MB", "no file of this kind is; check which it is"
        )
    node = _compose(_decode(raw, file), file)
    if node is None:
        raise InputError.at(file, "the file is empty", "begin it with `schema: mrctl/…`", 1)
    if not isinstance(node, yaml.MappingNode):
        raise InputError.at(
            file,
            "the file is not a mapping",
            "write `key: value` lines, beginning with `schema: mrctl/…`",
            node.start_mark.line + 1,
        )
    try:
        built = build(node, file, MAX_DEPTH)
    except TooDeep as error:
        raise _too_deep(file, error) from None
    return Document(
        file, built.data, built.lines, built.words, hashlib.sha256(raw).hexdigest(), tuple(built.slips)
    )


def _decode(raw: bytes, file: str) -> str:
    """The text; raises InputError at the first byte that is not UTF-8."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        what = f"byte 0x{raw[error.start]:02x} is not UTF-8"
        raise InputError.at(file, what, "save the file as UTF-8", line) from None


def _compose(text: str, file: str) -> yaml.Node | None:
    """The root node, None of an empty file; raises InputError on what is not one YAML document."""
    try:
        loader = _Loader(text)
        try:
            if not loader.check_node():
                return None
            root: yaml.Node | None = loader.get_node()
            if loader.check_node():
                second = loader.peek_event().start_mark  # type: ignore[no-untyped-call]
                raise InputError.at(
                    file,
                    "a second document begins here",
                    "keep one document a file: remove the line `---`",
                    second.line + 1,
                )
        finally:
            loader.dispose()
    except TooDeep as error:
        raise _too_deep(file, error) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        said = f"{error.context or ''} {error.problem or ''}"
        mend = next((mend for sign, mend in _MENDS if sign in said), "check the line and the one above it")
        what = printable(f"not valid YAML: {error.problem or error.context}")
        raise InputError.at(file, what, mend, mark.line + 1 if mark else None) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        what = f"the control character U+{int(error.character):04X} is not allowed in YAML"
        raise InputError.at(file, what, "remove it", line) from None
    except yaml.YAMLError as error:
        raise InputError.at(file, printable(f"not valid YAML: {error}"), "check the syntax") from None
    except (ValueError, OverflowError) as error:  # PyYAML lets an escape above U+10FFFF through to chr()
        raise InputError.at(file, f"not valid YAML: {error}", "check the escapes in quoted text") from None
    return root


def _too_deep(file: str, error: TooDeep) -> InputError:
    return InputError.at(
        file, "nested too deeply, or aliases multiply too far", "write it out flat", error.line
    )
