"""Work side by side on the processors: numpy's and the compiled loops' own leaves Python's lock alone.

Whoever has several things to do takes those processors along that are idle at that moment, also from within
such work: a fit among fits goes through its own batches with the processors whose fits are done, be it in
this process or in another one that shares them.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import TypeVar

T = TypeVar("T")
S = TypeVar("S")

THREADS = 4  # for each processor: most of them wait for others


def in_parallel(function: Callable[[T], S], over: Iterable[T]) -> list[S]:
    """The function's results, in their order, by this thread and whoever is idle."""
    todo = list(over)
    if len(todo) < 2:
        return [function(one) for one in todo]
    found: dict[int, S] = {}
    places = iter(range(len(todo)))

    def take() -> None:
        for place in places:
            found[place] = function(todo[place])

    crew = _crew()
    helpers = crew.join(take, len(todo) - 1)
    try:
        take()
    except BaseException:
        deque(places, maxlen=0)  # nobody begins another one
        raise
    crew.wait(helpers)
    return [found[place] for place in range(len(todo))]


def workers(most: int = 0) -> int:
    """How many processors this process may use: its share, and what others that are done have left of theirs.

    most: take none of those along beyond so many.
    """
    return _crew().with_spare(most)


@contextmanager
def shared_by(processes: int) -> Iterator[Callable[[], None]]:
    """Meanwhile the processors are those of so many processes, this one and its copies.

    Who is done calls what this gives, and leaves its own to those that are still at work.
    """
    global _here  # noqa: PLW0603 - what a whole process may use
    before = _crew()
    source, sink = os.pipe()
    os.set_blocking(source, False)
    try:
        _here = _Crew(max(1, before.processors // processes), _Spare(source, before.spare))
        yield lambda: _crew().leave_to(sink)
    finally:
        _crew().end()
        _here = before
        os.close(source)
        os.close(sink)


def begin_anew() -> None:
    """In a copy of a process, which has none of its threads."""
    global _here  # noqa: PLW0603
    _here = _Crew(_crew().processors, _crew().spare)


def _processors() -> int:
    """MRCTL_WORKERS, or as many as there are for this process."""
    given = os.environ.get("MRCTL_WORKERS", "")
    return int(given) if given.isdigit() and int(given) else len(os.sched_getaffinity(0))


def _crew() -> _Crew:
    global _here  # noqa: PLW0603
    if _here is None:
        _here = _Crew(_processors())
    return _here


class _Spare:
    """Processors of other processes that are done: a byte each in a pipe, for who reads it first."""

    def __init__(self, source: int, beyond: _Spare | None) -> None:
        self._source, self._beyond = source, beyond

    def taken(self, most: int) -> int:
        """How many there were, at most so many; they are this process's now."""
        if most < 1:
            return 0
        try:
            count = len(os.read(self._source, most))
        except BlockingIOError:
            count = 0
        return count + (self._beyond.taken(most - count) if self._beyond else 0)


class _Crew:
    """The threads, and how many processors have nothing to do; below 0 where some have to share."""

    def __init__(self, processors: int, spare: _Spare | None = None) -> None:
        self.processors, self.spare = processors, spare
        self._pool = ThreadPoolExecutor(THREADS * processors, thread_name_prefix="fit")
        self._idle = processors - 1  # who asks is busy
        self._lock = Lock()

    def with_spare(self, most: int) -> int:
        """The processors, with spare ones of others up to so many."""
        with self._lock:
            self._take(most - self.processors)
            return self.processors

    def join(self, work: Callable[[], None], most: int) -> list[Future[None]]:
        """Idle processors, at most so many, begin the same work."""
        with self._lock:
            self._take(most - max(0, self._idle))
            count = max(0, min(most, self._idle))
            self._idle -= count
        return [self._pool.submit(self._until_idle, work) for _ in range(count)]

    def wait(self, helpers: list[Future[None]]) -> None:
        """Until all are done, idle; raises what they raised. Who has not begun yet need not."""
        if not helpers:
            return
        self._free(1)
        try:
            for helper in helpers:
                if helper.cancel():
                    self._free(1)
                else:
                    helper.result()
        finally:
            self._free(-1)

    def leave_to(self, sink: int) -> None:
        """All its processors are for the others."""
        os.write(sink, bytes(self.processors))

    def end(self) -> None:
        """Let its threads go, which have nothing to do."""
        self._pool.shutdown(wait=False)

    def _take(self, most: int) -> None:
        """Spare processors of other processes, at most so many, become its own and idle."""
        count = self.spare.taken(most) if self.spare else 0
        self.processors += count
        self._idle += count

    def _until_idle(self, work: Callable[[], None]) -> None:
        try:
            work()
        finally:
            self._free(1)

    def _free(self, count: int) -> None:
        with self._lock:
            self._idle += count


_here: _Crew | None = None  # this process's, made when first asked for
