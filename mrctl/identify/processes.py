"""Large pieces of work side by side in processes: Python's own share of them runs on one processor at a time.

A copy of this process has all that it needs and is sent nothing; it sends back what it found. What both have
had from before travels as a reference, and where it arrives it is the object that was there already.
"""

from __future__ import annotations

import io
import multiprocessing
import os
import pickle
import struct
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from mrctl.identify import parallel

T = TypeVar("T")
S = TypeVar("S")

MOST = 8  # processes: each needs memory of its own
_PLACE = struct.Struct("<I")


def in_processes(function: Callable[[T], S], over: Iterable[T], had: Iterable[object] = ()) -> list[S]:
    """The function's results, in their order, by this process and copies of it.

    had: objects that results refer to and that are not to be copied, as records, or cannot be pickled, as
    a plug-in's effects. What a copy did not do, since it failed or was ended, is done here, and raises here.
    Who finds nothing left to do leaves its processors to the others. Where there can be no copies, which is
    on other systems than Linux and from other threads than the main one, it is one after another: what works
    in processes of its own need not get along with its like in threads.
    """
    todo, common = list(over), tuple(had)
    able = sys.platform == "linux" and threading.current_thread() is threading.main_thread()
    count = min(parallel.workers(len(todo)), len(todo), MOST) if able and len(todo) > 1 else 1
    if count < 2:
        return [function(one) for one in todo]
    with parallel.shared_by(count) as leave, _turns(len(todo)) as turns:
        work = partial(_work, function, todo, turns, leave, common)
        with _copies(work, count - 1) as sources:
            found = {place: function(todo[place]) for place in turns}
            leave()
            for source in sources:
                found |= _received(source, common)
    return [found[place] if place in found else function(one) for place, one in enumerate(todo)]


@contextmanager
def _turns(count: int) -> Iterator[Iterator[int]]:
    """So many places, each for the process that asks first: all of them read one pipe."""
    source, sink = os.pipe()
    with os.fdopen(source, "rb", buffering=0) as places:
        with os.fdopen(sink, "wb") as all_of_them:
            all_of_them.write(b"".join(map(_PLACE.pack, range(count))))
        yield (_PLACE.unpack(place)[0] for place in iter(partial(places.read, _PLACE.size), b""))


@contextmanager
def _copies(work: Callable[[Connection], None], count: int) -> Iterator[list[Connection]]:
    """Copies of this process at work, and where what they find will come from; afterwards there are none."""
    fork = multiprocessing.get_context("fork")
    copies, sources = [], []
    try:
        for _ in range(count):
            source, sink = fork.Pipe(duplex=False)
            sources.append(source)
            with sink:
                copies.append(fork.Process(target=work, args=(sink,), daemon=True))
                copies[-1].start()
        yield sources
    finally:
        for source in sources:
            source.close()
        for copy in copies:
            copy.kill()
            copy.join()
            copy.close()


def _work(
    function: Callable[[T], S],
    todo: Sequence[T],
    turns: Iterator[int],
    leave: Callable[[], None],
    had: Sequence[object],
    sink: Connection,
) -> None:
    """What a copy does: take turns, and send what it found when there are none left.

    Whatever ends it, it says nothing: what is missing is done by who asked, and there it is raised again.
    """
    try:
        parallel.begin_anew()
        found = [(place, function(todo[place])) for place in turns]
        leave()
        for result in found:
            sink.send_bytes(_pickled(result, had))
    finally:
        os._exit(0)


def _received(source: Connection, had: Sequence[object]) -> dict[int, Any]:
    """What a copy sends until it ends, by place."""
    found: dict[int, Any] = {}
    while True:
        try:
            body = source.recv_bytes()
        except (EOFError, ConnectionError):
            return found
        place, result = _Unpickler(io.BytesIO(body), had).load()
        found[place] = result


def _pickled(result: object, had: Sequence[object]) -> bytes:
    stream = io.BytesIO()
    _Pickler(stream, had).dump(result)
    return stream.getvalue()


class _Pickler(pickle.Pickler):
    """Writes what both processes have had as its place among that."""

    def __init__(self, stream: io.BytesIO, had: Sequence[object]) -> None:
        super().__init__(stream, protocol=pickle.HIGHEST_PROTOCOL)
        self._places = {id(one): place for place, one in enumerate(had)}

    def persistent_id(self, obj: object) -> int | None:
        """The place of an object that is not to be copied."""
        return self._places.get(id(obj))


class _Unpickler(pickle.Unpickler):
    """Reads it back."""

    def __init__(self, stream: io.BytesIO, had: Sequence[object]) -> None:
        super().__init__(stream)
        self._had = had

    def persistent_load(self, pid: int) -> object:
        """The object at that place."""
        return self._had[pid]
