"""A real SocketCAN and a real systemd for tests, on any Linux machine.

A bed's `run` executes a bash script and hands back what it printed and wrote:

- `NativeBed` where this machine can create a vcan interface: the script runs in a network and process
  namespace of its own, so that no interface of the machine is touched.
- `Guest` everywhere else, and always for systemd: a user-mode Linux (Debian package `user-mode-linux`) boots
  on the host's own files under an overlay, and one guest serves all scripts of a test session, one by one.

Scripts see the same paths in both, `$PYTHON` is the interpreter of the tests, and job.sh gives them `mark`
and `wait_for`. Time in the guest is emulated: right for behaviour, not for timing.
"""

from __future__ import annotations

import contextlib
import os
import select
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parent.parent
GUEST_MEMORY_MIB = 768
# The user-mode kernel keeps its memory in a file here and dies of SIGBUS when the place is full.
GUEST_MEMORY_PLACE = Path("/dev/shm")  # noqa: S108 - the kernel's choice; nothing is written there by name
BOOT_TIMEOUT_S = 90.0
CLOCK_STEP_S = 1000.0  # no script takes as long: the clock was set
PACKAGES = "user-mode-linux can-utils iproute2 kmod systemd"


class BedError(Exception):
    """The bed itself failed (missing program, no boot, hung guest), not what a script tested on it."""


@dataclass(frozen=True)
class Result:
    """What a script left behind: exit status, output, and the directory with the files that it wrote.

    excuse: why nothing that fails on it is a finding; "" where all is.
    """

    returncode: int
    stdout: str
    stderr: str
    directory: Path
    excuse: str = ""

    def checked(self) -> Result:
        """Itself when the script succeeded; otherwise an AssertionError that shows all it said."""
        assert self.returncode == 0, (
            f"script exited {self.returncode} in {self.directory}\n{self.transcript()}"
        )
        return self

    def read(self, name: str) -> str:
        """A text file that the script wrote."""
        return (self.directory / name).read_text(encoding="utf-8", errors="replace")

    def stood_still_s(self) -> float:
        """For how long, at most, nothing at all ran while the script recorded: its machine had no CPU.

        A clock that the script set back or forth is none of this.
        """
        lines = self.read("pulse").splitlines() if (self.directory / "pulse").exists() else []
        spans = [[int(word) / 1e6 for word in line.split()] for line in lines]
        return max((end - start for start, end in spans if end - start < CLOCK_STEP_S), default=0.0)

    def transcript(self) -> str:
        """All text that the script left, for a failure message."""
        texts = [f"--- stdout\n{self.stdout}", f"--- stderr\n{self.stderr}"]
        texts += [
            f"--- {p.name} (end)\n{self.read(p.name)[-3000:]}" for p in sorted(self.directory.glob("*.log"))
        ]
        return "\n".join(texts)


class Bed(ABC):
    """Runs bash scripts one by one where CAN (and perhaps systemd) is real."""

    has_systemd = False

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._jobs = 0

    def run(
        self,
        script: str,
        *,
        files: Mapping[str, str] | None = None,
        timeout_s: float = 60.0,
        machine: bool = False,
    ) -> Result:
        """Run a bash script (`set -euo pipefail`) in a fresh directory with `files`, and wait for its end.

        By default it has a vcan0 of its own and every process it leaves is killed; `machine=True` runs it
        beside systemd instead. A script that takes longer than `timeout_s` is killed: status 124.
        """
        if machine and not self.has_systemd:
            raise BedError("this bed has no systemd; ask for the guest")
        self._jobs += 1
        job = self.directory / f"job{self._jobs:03d}"
        job.mkdir()
        for name, text in {"script": script, **(files or {})}.items():
            (job / name).write_text(text, encoding="utf-8")
        (job / "run").write_text(_run_script(job, machine=machine), encoding="utf-8")
        returncode = self._execute(job, timeout_s)
        texts = [(job / name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")]
        return Result(returncode, texts[0], texts[1], job)

    @abstractmethod
    def _execute(self, job: Path, timeout_s: float) -> int: ...


class NativeBed(Bed):
    """Scripts on this machine's own kernel, each in namespaces of its own."""

    @staticmethod
    def is_possible() -> bool:
        """Whether this machine can create a vcan interface and listen before all others, tried aside."""
        script = (
            "ip link add vcan0 type vcan && ip link set vcan0 up && exec timeout 0.2 chrt -f 52 candump vcan0"
        )
        tried = subprocess.run(["unshare", "--net", "sh", "-c", script], capture_output=True, check=False)
        return tried.returncode == 124  # candump listened until its time was over

    def _execute(self, job: Path, timeout_s: float) -> int:
        with (job / "stdout").open("wb") as out, (job / "stderr").open("wb") as err:
            command = ["bash", str(job / "run"), f"{timeout_s:g}"]
            return subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, check=False, timeout=timeout_s + 30
            ).returncode


class Guest(Bed):
    """A user-mode Linux with systemd that serves scripts over a serial line until it is closed."""

    has_systemd = True

    def __init__(self, directory: Path) -> None:
        super().__init__(directory)
        _require_programs()
        self._kernel: subprocess.Popen[bytes] | None = None
        self._to_guest = self._from_guest = -1
        self._pending = b""
        self._boot()

    def _boot(self) -> None:
        """Start the kernel and wait until its command loop answers (3 to 10 s)."""
        environment = {
            "BED_BASE_PREFIX": sys.base_prefix,
            "BED_SITE_PACKAGES": sysconfig.get_path("purelib"),
            "BED_CHECKOUT": str(CHECKOUT),
            "BED_PYTHON": f"python{sys.version_info.major}.{sys.version_info.minor}",
            "BED_HERE": str(HERE),
        }
        lines = [f"{name}={shlex.quote(value)}\n" for name, value in environment.items()]
        (self.directory / "bed.env").write_text("".join(lines), encoding="utf-8")
        guest_in, self._to_guest = os.pipe()
        self._from_guest, guest_out = os.pipe()
        # On one CPU: between two, the kernel and the process that it traces wake each other through the host
        # at every system call, five times as slowly where the host itself has to wait for its CPUs.
        cpu = max(os.sched_getaffinity(0))
        command = [
            "taskset", "--cpu-list", f"{cpu}",
            "linux.uml", f"mem={GUEST_MEMORY_MIB}M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/",
            "rw", f"init={HERE / 'guest_init.sh'}", f"MRCTL_BED={self.directory}",
            f"uml_dir={self.directory}/",
            "con=null", "con0=null,fd:1", "ssl=null", f"ssl0=fd:{guest_in},fd:{guest_out}", "quiet",
        ]  # fmt: skip
        preload = _whole_registers(self.directory)
        with (self.directory / "console.log").open("wb") as console:
            self._kernel = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=console, stderr=subprocess.STDOUT,
                pass_fds=(guest_in, guest_out), start_new_session=True, env=os.environ | preload,
            )  # fmt: skip
        os.close(guest_in)
        os.close(guest_out)
        self._expect("ready", BOOT_TIMEOUT_S)

    def _execute(self, job: Path, timeout_s: float) -> int:
        if self._kernel is None:  # the last script took the guest down: a new one for this script
            self._boot()
        os.write(self._to_guest, f"{timeout_s:g} {job}\n".encode())
        # Generous: the guest's own time-out should end the script, this one means that the guest hangs.
        answer = self._expect("done", 1.5 * timeout_s + 30)
        _, status, name = answer.split()
        if name != job.name:
            self._kill()
            raise BedError(f"the guest answered {answer!r} to {job.name}")
        return int(status)

    def _expect(self, word: str, timeout_s: float) -> str:
        """The next line from the guest that starts with `word`; kills the guest when none comes in time."""
        deadline = time.monotonic() + timeout_s
        while True:
            while b"\n" in self._pending:
                line, self._pending = self._pending.split(b"\n", 1)
                text = line.decode(errors="replace").strip()
                if text.split(" ")[0] == word:
                    return text
            ready, _, _ = select.select([self._from_guest], [], [], max(0.0, deadline - time.monotonic()))
            chunk = os.read(self._from_guest, 4096) if ready else b""
            if not chunk:
                self._kill()
                console = (self.directory / "console.log").read_text(encoding="utf-8", errors="replace")
                console = console.split("Call Trace:")[0]
                why = "ended" if ready else f"did not answer within {timeout_s:.0f} s"
                if "child stopped with signal 1" in console:
                    why += " of a SIGSTOP or SIGCONT from outside, which it does not survive,"
                raise BedError(
                    f"the user-mode guest {why} while waiting for {word!r}; its console:\n{console[-4000:]}"
                )
            self._pending += chunk

    def close(self) -> None:
        """Hang up; the guest's command loop then powers it off."""
        if self._kernel is None:
            return
        os.close(self._to_guest)
        self._to_guest = -1
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._kernel.wait(timeout=10)
        self._kill()

    def _kill(self) -> None:
        """End the kernel and every process that it traces: all are of the process group started here."""
        if self._kernel is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._kernel.pid, signal.SIGKILL)
            self._kernel.wait()
            self._kernel = None
        for descriptor in (self._to_guest, self._from_guest):
            if descriptor >= 0:
                os.close(descriptor)
        self._to_guest = self._from_guest = -1
        self._pending = b""


def machine_has_can() -> bool:
    """Whether SocketCAN scripts run on this machine itself; MRCTL_TESTBED=native or =guest forces it."""
    choice = os.environ.get("MRCTL_TESTBED", "")
    if choice not in {"", "guest", "native"}:
        raise BedError(f"MRCTL_TESTBED={choice}: must be guest or native")
    return choice == "native" or (not choice and NativeBed.is_possible())


def _run_script(job: Path, *, machine: bool) -> str:
    """The wrapper of a job: environment, time-out and, unless it works beside systemd, namespaces."""
    here, python = shlex.quote(str(HERE)), shlex.quote(sys.executable)
    path = shlex.quote(str(Path(sys.executable).parent))
    # All that a script leaves behind comes to the first process of its namespace. That is none that waits:
    # bash that misses its last child's end waits for one of those, which never ends.
    isolate = """unshare --net --pid --fork --kill-child --mount-proc bash -c 'bash "$@"; exit' init"""
    start = f"bash {here}/job.sh machine" if machine else f"{isolate} {here}/job.sh bus"
    return f"""cd {shlex.quote(str(job))} || exit 126
export PATH={path}:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME="$PWD" LC_ALL=C.UTF-8
export PYTHON={python} PYTHONPATH={shlex.quote(str(CHECKOUT))} PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1
nearly_over=$((${{1%.*}} - 2))
exec timeout --kill-after=5 "$1" {start} "$nearly_over"
"""


def _whole_registers(directory: Path) -> dict[str, str]:
    """What the kernel's environment needs on a processor whose registers are larger than it knows."""
    if " amx_tile" not in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
        return {}
    library = directory / "whole_registers.so"
    command = ["cc", "-shared", "-fPIC", "-O2", "-o", library, HERE / "whole_registers.c"]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except FileNotFoundError:
        mend = "apt-get install gcc libc6-dev, or see tests/run.sh"
        raise BedError(f"on a processor with AMX the test bed needs a C compiler; {mend}") from None
    except subprocess.CalledProcessError as error:
        raise BedError(f"whole_registers.c does not compile: {error.stderr}") from None
    return {"LD_PRELOAD": str(library)}


def _require_programs() -> None:
    """All that a guest needs, or one BedError that names the mend."""
    missing = [
        name
        for name in ("linux.uml", "taskset", "chrt", "candump", "ip", "insmod", "unshare")
        if shutil.which(name) is None
    ]
    if not Path("/lib/systemd/systemd").exists():
        missing.append("/lib/systemd/systemd")
    if missing:
        raise BedError(
            f"the test bed lacks {', '.join(missing)}; apt-get install {PACKAGES}, or see tests/run.sh"
        )
    free_mib = shutil.disk_usage(GUEST_MEMORY_PLACE).free >> 20
    if free_mib < GUEST_MEMORY_MIB:
        where = f"{GUEST_MEMORY_PLACE} has {free_mib} MiB free"
        raise BedError(f"{where}, the test bed needs {GUEST_MEMORY_MIB}; enlarge it")
