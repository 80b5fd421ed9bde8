"""A helper process, forked before real time begins, for what must not hold up the tick: a disk, a parser.

A second thread would not do: while it works, the tick waits for the interpreter's lock, 5 ms at the median.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
from collections.abc import Callable
from typing import Final

END_PATIENCE_S: Final = 1.0
_MAX_DESCRIPTORS: Final = 4096


class Helper:
    """A forked child that runs `work(reads_from, writes_to)` until its pipe ends."""

    def __init__(self, work: Callable[[int, int], None]) -> None:
        """work: what the child does, given the descriptors on which it hears and answers."""
        hears, self.to_child = os.pipe()
        self.from_child, answers = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            _be_the_helper(work, hears, answers)
        os.close(hears)
        os.close(answers)
        os.set_blocking(self.to_child, False)
        os.set_blocking(self.from_child, False)

    def close(self) -> None:
        """Hang up and wait a moment for the child to finish what it was told; then it is killed."""
        os.close(self.to_child)
        # The child holds the other end of this pipe: its end is the child's.
        select.select([self.from_child], [], [], END_PATIENCE_S)
        os.close(self.from_child)
        with contextlib.suppress(ProcessLookupError, ChildProcessError):
            if os.waitpid(self.pid, os.WNOHANG) == (0, 0):
                os.kill(self.pid, signal.SIGKILL)
                os.waitpid(self.pid, 0)


def _be_the_helper(work: Callable[[int, int], None], hears: int, answers: int) -> None:
    """The child's life; does not return."""
    status = 1
    try:
        # It ends when its pipe does, not by what a terminal sends to the whole group.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        # The pipes of other helpers, which would never see an end of theirs.
        for low, high in _gaps(3, _MAX_DESCRIPTORS, sorted({hears, answers})):
            os.closerange(low, high)
        work(hears, answers)
        status = 0
    finally:
        os._exit(status)


def _gaps(low: int, high: int, kept: list[int]) -> list[tuple[int, int]]:
    starts, ends = [low, *(number + 1 for number in kept)], [*kept, high]
    return list(zip(starts, ends, strict=True))
