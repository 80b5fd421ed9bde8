"""Files that are whole or not there: written aside, renamed when done."""

from __future__ import annotations

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
    if target.exists() and not target.is_file():
        with target.open(mode, encoding=encoding, errors=errors, newline=newline) as stream:
            yield stream
        return
    if target.is_symlink():
        target = target.resolve()
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    aside = Path(name)
    try:
        with os.fdopen(handle, mode, encoding=encoding, errors=errors, newline=newline) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        aside.chmod(target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask())
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
