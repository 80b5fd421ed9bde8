"""A DBC being read: its text, to find lines in, and all that is wrong with it so far."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import textparser  # cantools' parser: its error knows the line

from mrctl.can.quiet_import import cantools
from mrctl.errors import InputError, Problem

# What cantools raises on a file that is not sound: its own errors, and slips of its loader on odd references.
_CANTOOLS_ERRORS = (
    cantools.database.errors.Error,
    KeyError,
    ValueError,
    IndexError,
    TypeError,
    AttributeError,
)


@lru_cache(maxsize=4)
def _parsed(text: str) -> tuple[Any, ...]:
    """The cantools messages of a DBC, in its order. Kept: a start asks for them several times."""
    database = cantools.database.Database(strict=True)
    database.add_dbc_string(text)
    return tuple(database.messages)


@dataclass
class DbcFile:
    """The file's name for messages, its text, and the problems found."""

    name: str
    text: str
    problems: list[Problem] = field(default_factory=list)

    @classmethod
    def read(cls, path: str | Path) -> DbcFile:
        """The file at `path`. Raises InputError where it cannot be read."""
        try:
            return cls(str(path), Path(path).read_text(encoding="cp1252", errors="replace"))
        except OSError as error:
            raise InputError.at(
                path, f"cannot be read: {error.strerror}", "check the path of the DBC"
            ) from error

    def report(self, what: str, mend: str, frame: str = "", signal: str = "") -> None:
        """Note a problem, at the line of the frame or of its signal."""
        self.problems.append(Problem(self.name, self.line_of(frame, signal) if frame else None, what, mend))

    def line_of(self, frame: str, signal: str = "") -> int | None:
        """The line where a frame, or a signal of it, is defined; None where there is no such frame."""
        start = re.search(rf"^[ \t]*BO_\s+\d+\s+{re.escape(frame)}\s*:", self.text, re.MULTILINE)
        if start is None:
            return None
        where = start.start()
        if signal:
            pattern = re.compile(rf"^[ \t]*SG_\s+{re.escape(signal)}\b", re.MULTILINE)
            found = pattern.search(self.text, start.end())
            where = found.start() if found else where
        return self.text.count("\n", 0, where) + 1

    def _line_of_refused(self, said: str) -> int | None:
        if frame := re.search(r"message (\w+)", said):
            return self.line_of(frame.group(1))
        entry = re.search(r"VAL_ \d+ \w+", said)
        where = self.text.find(entry.group()) if entry else -1
        return None if where < 0 else self.text.count("\n", 0, where) + 1

    def messages(self) -> dict[str, Any]:
        """The cantools messages by name. Raises InputError where cantools cannot read the file."""
        try:
            messages = _parsed(self.text)
        except textparser.ParseError as error:
            what = f"is not DBC at column {error.column}"
            raise InputError.at(
                self.name, what, "mend that line or export the file again", error.line
            ) from error
        except _CANTOOLS_ERRORS as error:
            what = f"cantools refuses it: {' '.join(str(error).split()).rstrip('.')}"
            raise InputError.at(
                self.name, what, "mend that entry", self._line_of_refused(str(error))
            ) from error
        by_name: dict[str, Any] = {}
        by_id: dict[tuple[int, bool], str] = {}
        for message in messages:
            key = (message.frame_id, message.is_extended_frame)
            if message.name in by_name:
                self.report(f"frame {message.name} stands there twice", "keep one", message.name)
            elif key in by_id:
                what = f"frames {by_id[key]} and {message.name} have the same ID {key[0]:#x}"
                self.report(what, "give each its own", message.name)
            by_name.setdefault(message.name, message)
            by_id.setdefault(key, message.name)
        return by_name
