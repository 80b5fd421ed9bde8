"""Real time as far as the system grants it; what it refuses is named with the mend."""

from __future__ import annotations

import gc
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from mrctl.config import RealtimeConfig
from mrctl.runtime import realtime

ALL_ELSE_OFF = {"lock_memory": False, "freeze_gc": False}
NOTHING = {"cpu_awake": False, **ALL_ELSE_OFF}


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
    taken = realtime.enter(RealtimeConfig(priority=50, cpus=[0], cpu_awake=False, freeze_gc=False))
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
    taken = realtime.enter(RealtimeConfig(cpu_awake=False, lock_memory=False))
    assert not gc.isenabled()
    assert gc.get_freeze_count() > 0
    realtime.leave(taken)
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_nothing_asked_for_is_nothing_taken():
    taken = realtime.enter(RealtimeConfig(**NOTHING))
    assert set(taken.granted) == {"priority"}
    assert gc.isenabled()


@pytest.fixture
def latency_device(monkeypatch, tmp_path):
    device = tmp_path / "cpu_dma_latency"
    device.write_bytes(b"")
    monkeypatch.setattr(realtime, "_LATENCY_DEVICE", device)
    monkeypatch.setattr(realtime, "_SLEEP_STATES", tmp_path)
    return device


def test_the_processors_stay_awake_until_it_leaves(latency_device):
    taken = realtime.enter(RealtimeConfig(cpu_awake=True, **ALL_ELSE_OFF))
    assert taken.granted["cpu_awake"] == "0 us"
    assert latency_device.read_bytes() == bytes(4)  # the kernel's binary form: int32, in us
    held = taken.awake
    assert Path(f"/proc/self/fd/{held}").readlink() == latency_device
    assert not os.get_inheritable(held)  # a helper that lives on must not keep them awake
    realtime.leave(taken)
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(held)
    realtime.leave(taken)  # once is enough, twice does no harm


def test_a_device_that_is_refused_is_named_with_the_mend(latency_device):
    latency_device.unlink()
    taken = realtime.enter(RealtimeConfig(cpu_awake=True, **ALL_ELSE_OFF))
    assert taken.refused == {
        "cpu_awake": "No such file or directory; "
        f"OpenFile={latency_device}:cpu_dma_latency in the unit (systemd 253), or root"
    }
    assert taken.awake is None
    realtime.leave(taken)


def test_a_device_that_takes_nothing_is_given_back(monkeypatch):
    monkeypatch.setattr(realtime, "_LATENCY_DEVICE", Path("/dev/full"))
    monkeypatch.setattr(realtime, "_SLEEP_STATES", Path("/"))
    before = len(list(Path("/proc/self/fd").iterdir()))
    taken = realtime.enter(RealtimeConfig(cpu_awake=True, **ALL_ELSE_OFF))
    assert taken.refused["cpu_awake"].startswith("No space left on device; ")
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_a_kernel_without_sleep_states_has_none_to_keep_out_of(monkeypatch, tmp_path):
    monkeypatch.setattr(realtime, "_SLEEP_STATES", tmp_path / "none")
    taken = realtime.enter(RealtimeConfig(cpu_awake=True, **ALL_ELSE_OFF))
    assert taken.granted["cpu_awake"] == "no sleep states"


def test_the_device_that_systemd_has_opened_is_taken(tmp_path):
    # As OpenFile= passes it: an open descriptor 3 and up, their names, and whom they are for.
    device = tmp_path / "opened_by_systemd"
    program = (
        "import os\n"
        "null = os.open('/dev/null', os.O_RDWR)\n"
        "os.dup2(null, 3) if null != 3 else None\n"
        "os.dup2(os.open(os.environ['DEVICE'], os.O_RDWR), 4)\n"
        "os.environ |= {'LISTEN_PID': str(os.getpid()), 'LISTEN_FDS': '2',"
        " 'LISTEN_FDNAMES': 'log:cpu_dma_latency'}\n"
        "from pathlib import Path\n"
        "from mrctl.config import RealtimeConfig\n"
        "from mrctl.runtime import realtime\n"
        "realtime._SLEEP_STATES, realtime._LATENCY_DEVICE = Path('/'), Path('/nowhere/cpu_dma_latency')\n"
        "taken = realtime.enter(RealtimeConfig(lock_memory=False, freeze_gc=False))\n"
        "print(taken.awake, taken.granted['cpu_awake'], os.get_inheritable(4))\n"
    )
    device.write_bytes(b"")
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"DEVICE": str(device), "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.stdout.split("\n")[0] == "4 0 us False", done.stderr
    assert device.read_bytes() == bytes(4)


def test_descriptors_for_another_process_are_left_alone(monkeypatch):
    monkeypatch.setenv("LISTEN_PID", str(os.getpid() + 1))
    monkeypatch.setenv("LISTEN_FDNAMES", "cpu_dma_latency")
    assert realtime._passed_by_systemd("cpu_dma_latency") is None
