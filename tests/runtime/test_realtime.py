"""Real time as far as the system grants it; what it refuses is named with the mend."""

from __future__ import annotations

import gc
import os
import resource

import pytest

from mrctl.config import RealtimeConfig
from mrctl.runtime import realtime

NOTHING = {"lock_memory": False, "freeze_gc": False}


@pytest.fixture
def unprivileged(monkeypatch):
    def refuse(*_arguments):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "sched_setaffinity", refuse)
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (8 << 20, 8 << 20))
    monkeypatch.setattr(realtime, "_may_lock", lambda: False)


@pytest.mark.usefixtures("unprivileged")
def test_what_is_refused_is_named_with_the_mend_and_raises_nothing():
    taken = realtime.enter(RealtimeConfig(priority=50, cpus=[0], freeze_gc=False))
    assert taken.refused == {
        "priority": "Operation not permitted; "
        "CPUSchedulingPolicy=fifo and CPUSchedulingPriority= in the unit, or ulimit -r",
        "cpus": "Operation not permitted; CPUAffinity= in the unit says which there are",
        "lock_memory": "RLIMIT_MEMLOCK is 8192 KiB; "
        "LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited",
    }
    assert taken.granted == {"priority": "OTHER 0"}


@pytest.mark.usefixtures("unprivileged")
def test_a_policy_that_is_there_already_is_not_asked_for_again(monkeypatch):
    monkeypatch.setattr(os, "sched_getscheduler", lambda _pid: os.SCHED_FIFO)
    monkeypatch.setattr(os, "sched_getparam", lambda _pid: os.sched_param(40))
    taken = realtime.enter(RealtimeConfig(priority=40, **NOTHING))
    assert taken.granted == {"priority": "FIFO 40"}
    assert not taken.refused


def test_processors_are_pinned():
    before = os.sched_getaffinity(0)
    one = min(before)
    try:
        taken = realtime.enter(RealtimeConfig(cpus=[one], **NOTHING))
        assert taken.granted["cpus"] == str(one)
        assert os.sched_getaffinity(0) == {one}
    finally:
        os.sched_setaffinity(0, before)


def test_the_collector_stops_and_comes_back():
    taken = realtime.enter(RealtimeConfig(lock_memory=False))
    assert not gc.isenabled()
    assert gc.get_freeze_count() > 0
    realtime.leave(taken)
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_nothing_asked_for_is_nothing_taken():
    taken = realtime.enter(RealtimeConfig(**NOTHING))
    assert set(taken.granted) == {"priority"}
    assert gc.isenabled()
