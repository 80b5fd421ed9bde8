"""Progress of long work, on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Self, TextIO, TypeVar

from mrctl.report.quantity import format_duration

T = TypeVar("T")


def _speaks_unicode(stream: TextIO | None) -> bool:
    return "utf" in (getattr(stream, "encoding", None) or "").lower()


_REDRAW_S = 0.1
_PLAIN_LINE_S = 10.0


class Progress:
    """A context manager that shows how far a piece of work is and when it will end.

        with Progress("Identifying", total=40) as progress:
            for run in progress.track(runs): ...

    On a terminal one line is redrawn at most ten times a second and leaves a summary; elsewhere a line comes
    every ten seconds and at the end; with `quiet` nothing. Ctrl-C and errors end the line.
    """

    def __init__(
        self,
        label: str,
        total: float | None = None,
        *,
        quiet: bool = False,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.label = label
        self.total = total
        self.done = 0.0
        self._note = ""
        self._stream: TextIO | None = stream or sys.stderr  # None where standard error is closed
        if quiet:
            self._stream = None
        self._tty = self._stream is not None and self._stream.isatty()
        self._clock = clock
        self._began = self._shown = clock()

    def __enter__(self) -> Self:
        self._began = self._shown = self._clock()
        if self._tty:
            self._draw()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        end = "done" if kind is None else "interrupted" if issubclass(kind, KeyboardInterrupt) else "failed"
        took = format_duration(self._clock() - self._began)
        self._write(
            f"{self.label}: {end} after {took}" if end != "done" else f"{self.label}: {took}", final=True
        )

    def advance(self, amount: float = 1.0, note: str = "") -> None:
        """A step is done; `note` says at what it is now."""
        self.update(self.done + amount, note)

    def update(self, done: float, note: str = "") -> None:
        """So much of the total is done."""
        self.done = done
        self._note = note
        now = self._clock()
        if now - self._shown >= (_REDRAW_S if self._tty else _PLAIN_LINE_S):
            self._shown = now
            self._draw()

    def track(self, items: Iterable[T], note: Callable[[T], str] = lambda _: "") -> Iterator[T]:
        """Passes the items on and counts each one as it is finished."""
        for item in items:
            self.update(self.done, note(item))
            yield item
            self.advance(note=self._note)

    def _draw(self) -> None:
        if not self.total or self.total <= 0:
            parts = [self.label, f"{self.done:g}" if self.done else "", self._note]
            self._write("  ".join(part for part in parts if part))
            return
        share = min(max(self.done / self.total, 0.0), 1.0)
        elapsed = self._clock() - self._began
        left = f"{format_duration(elapsed / share * (1 - share))} left" if share > 0 else ""
        if not self._tty:
            parts = [f"{self.label}: {100 * share:.0f} %", left, self._note]
            self._write(", ".join(part for part in parts if part))
            return
        columns = shutil.get_terminal_size().columns
        tail = f" {100 * share:3.0f} %  {left}"
        room = min(30, columns - len(self.label) - len(tail) - 3)
        bar = ""
        if room >= 5:
            full = round(share * room)
            filled, empty = ("━", "╌") if _speaks_unicode(self._stream) else ("#", ".")
            bar = f" {filled * full}{empty * (room - full)}"
        self._write(f"{self.label}{bar}{tail}  {self._note}".rstrip())

    def _write(self, line: str, *, final: bool = False) -> None:
        if self._stream is None:
            return
        line = "".join(c if c.isprintable() else "?" for c in line)
        if self._tty:
            # One column stays free: a full line would wrap on some terminals and could not be redrawn.
            line = f"\r{line[: shutil.get_terminal_size().columns - 1]}\x1b[K"
        self._stream.write(line + ("\n" if final or not self._tty else ""))
        self._stream.flush()
