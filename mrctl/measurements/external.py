"""The libraries behind binary formats: imported when a file needs them, their failures as unusable input."""

from __future__ import annotations

import gc
import importlib
import logging
import struct
import sys
import traceback
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from mrctl.errors import InputError

# What the parsers of binary formats raise on damaged files, found by feeding them such: they check little,
# so that a wrong byte surfaces as whatever breaks first.
DAMAGE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)


def library(name: str, path: Path, kind: str) -> ModuleType:
    """The module `name` to read `path`, a file of `kind`; InputError naming the extra where it is missing."""
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]
        mend = f"install it: pip install 'mrctl[desk]' (or {package} alone), or export the file as CSV"
        raise InputError.at(path, f"reading {kind} needs {package}, which is not installed", mend) from None


@contextmanager
def damage_is_input_error(path: Path, kind: str, *own: type[Exception]) -> Iterator[None]:
    """Failures of a format's parser (DAMAGE, and its `own`) become one InputError: the file is damaged."""
    failures: tuple[type[Exception], ...] = (*DAMAGE, *own)
    try:
        yield
    except InputError:
        raise
    except failures as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        with _unraisable_ignored():
            traceback.clear_frames(error.__traceback__)
            gc.collect()
        what = f"cannot be read as {kind} ({reason if len(reason) < 120 else reason[:117] + '...'})"
        raise InputError.at(path, what, "is it damaged or cut off? export it again") from None


@contextmanager
def _unraisable_ignored() -> Iterator[None]:
    """While it holds, objects that were only half built may fail in their `__del__`, as asammdf's do."""
    before = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        sys.unraisablehook = before


class _Counter(logging.Handler):
    """Counts what a library would only have logged."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Count one record."""
        self.count += record.levelno >= logging.WARNING


@contextmanager
def warnings_of(name: str) -> Iterator[_Counter]:
    """While it holds, warnings of the logger `name` are counted instead of printed."""
    logger, counter = logging.getLogger(name), _Counter()
    before = logger.propagate
    logger.addHandler(counter)
    logger.propagate = False
    try:
        yield counter
    finally:
        logger.removeHandler(counter)
        logger.propagate = before
