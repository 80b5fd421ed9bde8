"""Text from outside, file names above all, made fit to be shown and to be written into a file."""

from __future__ import annotations


def printable(text: str) -> str:
    """The text on one line: what a terminal would not print is escaped, a name's bytes outside UTF-8 too."""
    return "".join(c if c.isprintable() else _escaped(c) for c in text)


def _escaped(c: str) -> str:
    if "\udc80" <= c <= "\udcff":  # how Python carries a byte of a file name that is not UTF-8
        return f"\\x{ord(c) - 0xDC00:02x}"
    return c.encode("unicode_escape").decode()
