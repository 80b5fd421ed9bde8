"""Real time from the system, as far as it grants it: priority, processors, memory, and no garbage collector.

Every option stands alone: what is refused is noted with the mend, and the controller runs all the same. Under
systemd the unit has set priority and limits before the process lost the right to do so (RestrictRealtime);
what is there already is not asked for again.
"""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from mrctl.config import RealtimeConfig

_LOCK_CURRENT: Final = 1  # <sys/mman.h>, MCL_CURRENT and MCL_FUTURE
_LOCK_FUTURE: Final = 2
_CAP_IPC_LOCK: Final = 14  # <linux/capability.h>

# Kernel documentation, "PM Quality of Service Interface": the latency written holds while the file is open.
_LATENCY_DEVICE: Final = Path("/dev/cpu_dma_latency")
_SLEEP_STATES: Final = Path("/sys/devices/system/cpu/cpuidle")
_NO_LATENCY: Final = struct.pack("=i", 0)  # µs
_FIRST_PASSED: Final = 3  # sd_listen_fds(3), SD_LISTEN_FDS_START


@dataclass(slots=True)
class Realtime:
    """What the process has, and what it was refused and why, by option."""

    granted: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    awake: int | None = None  # descriptor that keeps the processors awake while it is open


def enter(wanted: RealtimeConfig) -> Realtime:
    """Take what the configuration asks for; never raises."""
    result = Realtime()
    steps: dict[str, Callable[[], str]] = {}
    if wanted.cpus is not None:
        steps["cpus"] = partial(_pin, wanted.cpus)
    if wanted.priority is not None:
        steps["priority"] = partial(_raise_priority, wanted.priority)
    if wanted.lock_memory:
        steps["lock_memory"] = _lock_memory
    if wanted.cpu_awake:
        steps["cpu_awake"] = partial(_keep_awake, result)
    if wanted.freeze_gc:
        steps["freeze_gc"] = _stop_collector
    for name, take in steps.items():
        try:
            result.granted[name] = take()
        except OSError as error:
            result.refused[name] = f"{error.strerror or error}{_mend(name)}"
    result.granted.setdefault("priority", _policy_now())
    return result


def leave(taken: Realtime) -> None:
    """Give back what matters to others, and to whoever lives on in this process: sleep, and the collector."""
    if taken.awake is not None:
        os.close(taken.awake)
        taken.awake = None
    if "freeze_gc" in taken.granted:
        gc.enable()
        gc.unfreeze()


def _raise_priority(priority: int) -> str:
    param = os.sched_param(priority)
    if (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority) != (os.SCHED_FIFO, priority):
        os.sched_setscheduler(0, os.SCHED_FIFO, param)
    return _policy_now()


def _policy_now() -> str:
    names = {os.SCHED_OTHER: "OTHER", os.SCHED_FIFO: "FIFO", os.SCHED_RR: "RR"}
    policy = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
    return f"{names.get(policy, policy)} {os.sched_getparam(0).sched_priority}"


def _pin(cpus: list[int]) -> str:
    os.sched_setaffinity(0, cpus)
    return ",".join(str(cpu) for cpu in sorted(os.sched_getaffinity(0)))


def _lock_memory() -> str:
    """Lock all memory, now and later. Under a finite limit, later allocations would fail: not even tried."""
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if soft != resource.RLIM_INFINITY and not _may_lock():
        raise OSError(0, f"RLIMIT_MEMLOCK is {soft >> 10} KiB")
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_LOCK_CURRENT | _LOCK_FUTURE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return "all"


def _may_lock() -> bool:
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    effective = next((line.split()[1] for line in status.splitlines() if line.startswith("CapEff:")), "0")
    return bool(int(effective, 16) >> _CAP_IPC_LOCK & 1)


def _keep_awake(result: Realtime) -> str:
    """No processor of the machine sleeps deeper than it wakes from at once, until `leave`."""
    if not _SLEEP_STATES.exists():
        return "no sleep states"  # then the kernel has no such device either
    descriptor = _passed_by_systemd(_LATENCY_DEVICE.name)
    if descriptor is None:
        descriptor = os.open(_LATENCY_DEVICE, os.O_WRONLY | os.O_CLOEXEC)
    try:
        os.write(descriptor, _NO_LATENCY)
    except OSError:
        os.close(descriptor)
        raise
    result.awake = descriptor
    return "0 us"


def _passed_by_systemd(name: str) -> int | None:
    """The descriptor that OpenFile= of the unit has opened under this name, or None (sd_listen_fds(3))."""
    if os.environ.get("LISTEN_PID") != str(os.getpid()):
        return None
    names = os.environ.get("LISTEN_FDNAMES", "").split(":")
    if name not in names:
        return None
    descriptor = _FIRST_PASSED + names.index(name)
    os.set_inheritable(descriptor, False)
    return descriptor


def _stop_collector() -> str:
    """The tick makes no reference cycles; a collection in the middle of it would cost milliseconds."""
    gc.collect()
    gc.freeze()
    gc.disable()
    return "off"


def _mend(option: str) -> str:
    mends = {
        "priority": "; CPUSchedulingPolicy=fifo and CPUSchedulingPriority= in the unit, or ulimit -r",
        "cpu_awake": f"; OpenFile={_LATENCY_DEVICE}:cpu_dma_latency in the unit (systemd 253), or root",
        "cpus": "; CPUAffinity= in the unit says which there are",
        "lock_memory": "; LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited",
    }
    return mends.get(option, "")
