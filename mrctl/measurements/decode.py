"""Bytes to text: encodings that are named, marked or guessed; what is no text at all."""

from __future__ import annotations

import re
from pathlib import Path

from mrctl.errors import InputError

_MAGIC = {
    b"MATLAB 5.0": "a MATLAB file",
    b"\x89HDF": "an HDF5 file (MATLAB 7.3)",
    b"MDF ": "an MDF file",
    b"PK\x03\x04": "a zip archive or an Excel workbook",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook",
    b"\x1f\x8b": "a gzip archive",
    b"LOGG": "a BLF log",
}
_BOMS = (
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
_CONTROL = re.compile("[\x00-\x08\x0e-\x1f\x7f]")


def decode(path: Path, data: bytes, encoding: str | None, notes: list[str]) -> str:
    """The text of a file; InputError for what is no text. A reading other than UTF-8 is noted."""
    for magic, kind in _MAGIC.items():
        if data.startswith(magic):
            raise InputError.at(
                path, f"is {kind}, not a text table", "export it as CSV, or give its real extension"
            )
    named = encoding or next((name for bom, name in _BOMS if data.startswith(bom)), None)
    if named is None and b"\x00" in data[:1000]:
        even, odd = data[0:1000:2].count(0), data[1:1000:2].count(0)
        half = len(data[:1000]) // 4
        named = "utf-16-be" if even > half > odd else "utf-16-le" if odd > half > even else None
    try:
        text = data.decode(named or "utf-8")
    except LookupError:
        raise InputError.at(
            path, f"unknown encoding {named}", "name one as Python does: utf-8, utf-16, latin-1"
        ) from None
    except UnicodeDecodeError as error:
        if named is not None:
            raise InputError.at(
                path, f"is not {named} as it claims: {error.reason}", "export it again as UTF-8"
            ) from None
        text, named = data.decode("latin-1"), "latin-1"
    if _CONTROL.search(text[:100_000]):
        raise InputError.at(path, "is not text (binary data)", "export it as CSV, or give its real extension")
    if named not in {None, "utf-8", "utf-8-sig"}:
        notes.append(f"read as {named}")
    return text.removeprefix("\ufeff")
