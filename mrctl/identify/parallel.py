"""Work side by side on the processors: numpy's and the compiled loops' own leaves Python's lock alone.

Whoever has several things to do takes those processors along that are idle at that moment, also from within
such work: a fit among fits goes through its own batches with the processors whose fits are done.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import TypeVar

T = TypeVar("T")
S = TypeVar("S")

THREADS = 4  # for each processor: most of them wait for others
_sharing = 1  # processes


def in_parallel(function: Callable[[T], S], over: Iterable[T]) -> list[S]:
    """The function's results, in their order, by this thread and whoever is idle."""
    todo = list(over)
    if len(todo) < 2 or workers() < 2:
        return [function(one) for one in todo]
    found: dict[int, S] = {}
    places = iter(range(len(todo)))

    def take() -> None:
        for place in places:
            found[place] = function(todo[place])

    helpers = _crew().join(take, len(todo) - 1)
    try:
        take()
    except BaseException:
        deque(places, maxlen=0)  # nobody begins another one
        raise
    _crew().wait(helpers)
    return [found[place] for place in range(len(todo))]


def workers() -> int:
    """How many threads a fit may use: this process's share of the processors."""
    return max(1, _processors() // _sharing)


@contextmanager
def shared_by(processes: int) -> Iterator[None]:
    """Meanwhile the processors are those of so many processes, this one and its copies."""
    global _sharing  # noqa: PLW0603 - what a whole process may use
    before, _sharing = _sharing, _sharing * processes
    try:
        yield
    finally:
        _sharing = before


def begin_anew() -> None:
    """In a copy of a process, which has none of its threads."""
    _crew_of.cache_clear()


@cache
def _processors() -> int:
    """MRCTL_WORKERS, or as many as there are for this process."""
    given = os.environ.get("MRCTL_WORKERS", "")
    return int(given) if given.isdigit() and int(given) else len(os.sched_getaffinity(0))


def _crew() -> _Crew:
    return _crew_of(workers())


@cache
def _crew_of(processors: int) -> _Crew:
    return _Crew(processors)


class _Crew:
    """The threads, and how many processors have nothing to do; below 0 where some have to share."""

    def __init__(self, processors: int) -> None:
        self._pool = ThreadPoolExecutor(THREADS * processors, thread_name_prefix="fit")
        self._idle = processors - 1  # who asks is busy
        self._lock = Lock()

    def join(self, work: Callable[[], None], most: int) -> list[Future[None]]:
        """Idle processors, at most so many, begin the same work."""
        with self._lock:
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

    def _until_idle(self, work: Callable[[], None]) -> None:
        try:
            work()
        finally:
            self._free(1)

    def _free(self, count: int) -> None:
        with self._lock:
            self._idle += count
