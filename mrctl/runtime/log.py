"""structlog, set up so that a log line never holds up a tick.

JSON lines for a service, aligned text for a terminal. A line is written only when the stream can take it at
once; otherwise it is dropped and counted, and the next line says how many were lost.
"""

from __future__ import annotations

import os
import select
import sys
from collections.abc import MutableMapping
from typing import Any, TextIO

import structlog

_LINE_MAX = select.PIPE_BUF  # what a pipe that is ready takes without blocking


class NonBlockingStream:
    """Writes whole lines to a stream's descriptor when it is ready, and never waits."""

    def __init__(self, stream: TextIO) -> None:
        self._descriptor = stream.fileno()
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

    def __init__(self, stream: NonBlockingStream) -> None:
        self._stream = stream

    def msg(self, message: str) -> None:
        self._stream.write(message + "\n")

    debug = info = warning = error = critical = msg


def make_logger(level: str = "info", stream: TextIO | None = None) -> Any:  # noqa: ANN401  # structlog's own type
    """A logger on stderr or `stream`: readable on a terminal, else JSON. level: debug, info, warning..."""
    stream = stream or sys.stderr
    out = NonBlockingStream(stream)

    def say_lost(_logger: object, _name: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        if out.dropped:
            event["lines_lost"] = out.dropped
        return event

    readable = stream.isatty()
    renderer = (
        structlog.dev.ConsoleRenderer(colors="NO_COLOR" not in os.environ, pad_event_to=12, sort_keys=False)
        if readable
        else structlog.processors.JSONRenderer(sort_keys=False)
    )
    return structlog.wrap_logger(
        _LineLogger(out),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            say_lost,
            renderer,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(level),
        cache_logger_on_first_use=False,
    )
