"""structlog, set up so that a log line never holds up a tick.

Fields for the journal, JSON lines for a file or pipe, aligned text for a terminal. A line is handed over only
when that takes no waiting; otherwise it is dropped and counted, and the next line says how many were lost. A
file is written by a helper process, for a disk may be slow, or full.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import sys
from collections.abc import Iterator, MutableMapping
from typing import Any, Protocol, TextIO

import structlog

from mrctl.runtime.helper import Helper
from mrctl.runtime.journal import Journal, is_stderr

_LINE_MAX = select.PIPE_BUF  # what a pipe that is ready takes without blocking
_SET_PIPE_SIZE = 1031  # <linux/fcntl.h>, F_SETPIPE_SZ
_PIPE_BYTES = 1 << 20
_READ_BYTES = 1 << 16


class _Out(Protocol):
    """Takes rendered lines."""

    dropped: int

    def write(self, line: str) -> None: ...


class NonBlockingStream:
    """Writes whole lines to a descriptor when it is ready, and never waits."""

    def __init__(self, stream: TextIO | int) -> None:
        self._descriptor = stream if isinstance(stream, int) else stream.fileno()
        self._ready = select.poll()
        self._ready.register(self._descriptor, select.POLLOUT)
        self.dropped = 0

    def write(self, line: str) -> None:
        """Write a line, cut to what the stream takes at once, or count it as dropped."""
        events = self._ready.poll(0)
        if not events or not events[0][1] & select.POLLOUT:
            self.dropped += 1
            return
        data = line.encode(errors="replace")
        if len(data) > _LINE_MAX:
            data = data[: _LINE_MAX - 1] + b"\n"
        try:
            os.write(self._descriptor, data)
        except OSError:  # the disk is full or the reader has gone: the tick goes on
            self.dropped += 1
        else:
            self.dropped = 0


class _LineLogger:
    """The end of structlog's chain: one rendered line a call."""

    def __init__(self, stream: _Out) -> None:
        self._stream = stream

    def msg(self, message: str) -> None:
        self._stream.write(message + "\n")

    debug = info = warning = error = critical = msg


class _FieldLogger:
    """The end of structlog's chain for the journal: one line's fields a call."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal

    def msg(self, event: MutableMapping[str, Any]) -> None:
        self._journal.write(event)

    debug = info = warning = error = critical = msg


def make_logger(level: str = "info", stream: TextIO | None = None) -> Any:  # noqa: ANN401  # structlog's own type
    """A logger on stderr or `stream`: readable on a terminal, else JSON. level: debug, info, warning..."""
    stream = stream or sys.stderr
    return _line_logger(level, NonBlockingStream(stream), readable=stream.isatty())


@contextlib.contextmanager
def daemon_logger(level: str = "info") -> Iterator[Any]:
    """A logger for a daemon: to the journal, a terminal, or through a helper process to where stderr goes.

    At the end it waits a moment for the helper to write what it has. Forks: call it before anything is open
    that a child should not hold, such as a bus.
    """
    journal = _journal()
    if journal is not None:
        with contextlib.closing(journal):
            yield _wrapped(
                level, _FieldLogger(journal), journal, lambda _logger, _name, event: ((event,), {})
            )
        return
    if sys.stderr.isatty():
        yield make_logger(level)
        return
    helper = Helper(lambda lines, _answers: copy_lines(lines, 2))
    try:
        with contextlib.suppress(OSError):
            fcntl.fcntl(helper.to_child, _SET_PIPE_SIZE, _PIPE_BYTES)
        yield _line_logger(level, NonBlockingStream(helper.to_child), readable=False)
    finally:
        helper.close()


def _journal() -> Journal | None:
    """The journal where standard error goes to it."""
    if is_stderr():
        with contextlib.suppress(OSError):
            return Journal()
    return None


def copy_lines(source: int, sink: int) -> None:
    """The helper's work: lines from one descriptor to another until the first ends; a full disk costs lines.

    Once the disk has room again the next line says how many were lost.
    """
    lost, torn = 0, False
    while lines := os.read(source, _READ_BYTES):
        first = b"\n" if torn else b""
        if lost:
            first += b'{"event": "log lines lost", "lines_lost": %d}\n' % lost
        data, written = first + lines, 0
        try:
            while written < len(data):
                written += os.write(sink, data[written:])
        except OSError:
            if written:
                torn = data[written - 1 : written] != b"\n"
            if written >= len(first):
                lost = 0
            lost += data[max(written, len(first)) :].count(b"\n")
        else:
            lost, torn = 0, False


def _line_logger(level: str, out: NonBlockingStream, *, readable: bool) -> Any:  # noqa: ANN401  # structlog's own
    renderer = (
        structlog.dev.ConsoleRenderer(colors="NO_COLOR" not in os.environ, pad_event_to=12, sort_keys=False)
        if readable
        else structlog.processors.JSONRenderer(sort_keys=False)
    )
    return _wrapped(level, _LineLogger(out), out, renderer)


def _wrapped(level: str, end: Any, out: Any, renderer: Any) -> Any:  # noqa: ANN401  # structlog's own types
    def say_lost(_logger: object, _name: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        if out.dropped:
            event["lines_lost"] = out.dropped
        return event

    return structlog.wrap_logger(
        end,
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            say_lost,
            renderer,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        cache_logger_on_first_use=False,
    )
