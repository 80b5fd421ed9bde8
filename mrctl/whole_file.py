"""Files that are whole or not there: written aside, renamed when done."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any


@contextmanager
def whole_file(
    path: Path | str,
    mode: str = "w",
    *,
    encoding: str | None = None,
    errors: str | None = None,
    newline: str | None = None,
) -> Iterator[IO[Any]]:
    """A file to write that takes its place when the block ends well, and leaves nothing behind otherwise.

    What is no regular file (a pipe, /dev/null) is written to as it is: a rename would replace it.
    A replaced file keeps its permissions. The arguments are those of `open`. Raises OSError.
    """
    target = Path(path)
    if _is_special(target):
        with target.open(mode, encoding=encoding, errors=errors, newline=newline) as stream:
            yield stream
        return
    if target.is_symlink():
        target = target.resolve()
    handle, aside = _aside(target)
    try:
        with os.fdopen(handle, mode, encoding=encoding, errors=errors, newline=newline) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        aside.chmod(target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask())
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def try_place(path: Path | str) -> None:
    """Find out whether `whole_file` can write there, by beginning to and undoing it. Raises OSError."""
    target = Path(path)
    if _is_special(target):
        if not os.access(target, os.W_OK):  # opened, a pipe would wait for its reader
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return
    handle, aside = _aside(target.resolve() if target.is_symlink() else target)
    os.close(handle)
    aside.unlink()


def _is_special(target: Path) -> bool:
    return target.exists() and not target.is_file()


def _aside(target: Path) -> tuple[int, Path]:
    """A new file beside the target, open to write."""
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    return handle, Path(name)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
