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
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from mrctl.config import RealtimeConfig

_LOCK_CURRENT: Final = 1  # <sys/mman.h>, MCL_CURRENT and MCL_FUTURE
_LOCK_FUTURE: Final = 2
_CAP_IPC_LOCK: Final = 14  # <linux/capability.h>


@dataclass(slots=True)
class Realtime:
    """What the process has, and what it was refused and why, by option."""

    granted: dict[str, str] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)


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
    """Give back what matters to whoever lives on in this process: the garbage collector."""
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


def _stop_collector() -> str:
    """The tick makes no reference cycles; a collection in the middle of it would cost milliseconds."""
    gc.collect()
    gc.freeze()
    gc.disable()
    return "off"


def _mend(option: str) -> str:
    mends = {
        "priority": "; CPUSchedulingPolicy=fifo and CPUSchedulingPriority= in the unit, or ulimit -r",
        "cpus": "; CPUAffinity= in the unit says which there are",
        "lock_memory": "; LimitMEMLOCK=infinity in the unit, or ulimit -l unlimited",
    }
    return mends.get(option, "")
