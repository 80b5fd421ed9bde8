"""A gzipped file as far as it goes: where it is cut off or damaged, what came before is still read."""

from __future__ import annotations

import io
import zlib
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Buffer  # collections.abc has it from Python 3.12 on

_CHUNK = 1 << 16
_GZIP = 31  # zlib's word for gzip's header and the largest window


class Gunzip(io.RawIOBase):
    """Reads a gzipped binary file; `damaged` tells whether it ended before its end."""

    def __init__(self, packed: IO[bytes]) -> None:
        self.damaged = False
        self._packed = packed
        self._unpack = zlib.decompressobj(_GZIP)
        self._ready = b""
        self._begun = False

    def readable(self) -> bool:
        """Yes."""
        return True

    def readinto(self, buffer: Buffer, /) -> int:
        """Fill the buffer; 0 at the end."""
        room = memoryview(buffer)
        while not self._ready and not self.damaged:
            chunk = self._unpack.unused_data or self._packed.read(_CHUNK)
            if not chunk:
                self.damaged = self._begun and not self._unpack.eof
                break
            if self._unpack.eof:  # another member follows
                self._unpack = zlib.decompressobj(_GZIP)
            self._begun = True
            try:
                self._ready = self._unpack.decompress(chunk)
            except zlib.error:
                self.damaged = True
        taken = self._ready[: len(room)]
        self._ready = self._ready[len(room) :]
        room[: len(taken)] = taken
        return len(taken)
