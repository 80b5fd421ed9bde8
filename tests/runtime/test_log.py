"""Log lines leave without holding up the tick: journal fields, a helper process, full disks, slow readers."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time

import pytest

from mrctl.runtime import journal
from mrctl.runtime.helper import Helper
from mrctl.runtime.journal import Journal, datagram
from mrctl.runtime.log import NonBlockingStream, copy_lines, make_logger


def fields_of(data):
    fields = {}
    while data:
        line, _, rest = data.partition(b"\n")
        key, equals, value = line.partition(b"=")
        if not equals:
            size = int.from_bytes(rest[:8], "little")
            value, rest = rest[8 : 8 + size], rest[9 + size :]
        fields[key.decode()] = value.decode()
        data = rest
    return fields


def test_a_line_becomes_fields_of_the_journal_and_a_readable_message():
    event = {
        "event": "rejected frames",
        "level": "warning",
        "timestamp": "now",
        "rejected": {"crc": 3, "not-available": 1},
        "dampers": ["a", "b"],
        "share": 0.25,
        "text": "two\nlines",
    }
    fields = fields_of(datagram(event))
    assert fields["PRIORITY"] == "4"
    assert fields["SYSLOG_IDENTIFIER"] == "mrctl"
    assert fields["MRCTL_EVENT"] == "rejected frames"
    assert fields["MRCTL_REJECTED_CRC"] == "3"
    assert fields["MRCTL_REJECTED_NOT_AVAILABLE"] == "1"
    assert fields["MRCTL_DAMPERS"] == "a,b"
    assert fields["MRCTL_SHARE"] == "0.25"
    assert fields["MRCTL_TEXT"] == "two\nlines"
    assert fields["MESSAGE"].startswith("rejected frames: rejected={crc: 3, not-available: 1} dampers=a,b")
    assert "MRCTL_TIMESTAMP" not in fields


def test_a_journal_that_takes_nothing_costs_lines_and_no_time(tmp_path):
    address = str(tmp_path / "journal")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as reader:
        reader.bind(address)
        with contextlib.closing(Journal(address)) as out:
            started = time.monotonic()
            for _ in range(3000):
                out.write({"event": "x", "level": "info", "text": "y" * 500})
            assert time.monotonic() - started < 2.0
            assert out.dropped > 1000
            while out.dropped:
                reader.recv(10_000)
                out.write({"event": "x", "level": "info"})


def test_standard_error_is_the_journal_only_where_the_manager_says_so(monkeypatch):
    monkeypatch.delenv("JOURNAL_STREAM", raising=False)
    assert not journal.is_stderr()
    status = os.fstat(2)
    monkeypatch.setenv("JOURNAL_STREAM", f"{status.st_dev}:{status.st_ino}")
    assert journal.is_stderr()
    monkeypatch.setenv("JOURNAL_STREAM", f"{status.st_dev}:{status.st_ino + 1}")
    assert not journal.is_stderr()


def test_a_reader_that_stops_reading_costs_lines_which_are_counted():
    reads, writes = os.pipe()
    os.set_blocking(writes, False)
    fcntl.fcntl(writes, 1031, 4096)
    out = NonBlockingStream(writes)
    for _ in range(100):
        out.write("z" * 999 + "\n")
    assert out.dropped >= 96
    while select.select([reads], [], [], 0.0)[0]:
        os.read(reads, 4096)
    out.write("again\n")
    assert out.dropped == 0
    os.close(reads)
    os.close(writes)


DAEMON = """
import sys, time
from mrctl.runtime.log import daemon_logger
with daemon_logger() as log:
    for k in range(int(sys.argv[1])):
        log.info("line", k=k)
    print(time.monotonic(), flush=True)
"""


def test_lines_reach_a_file_through_the_helper_to_the_last_one(tmp_path):
    with (tmp_path / "log").open("wb") as log:
        done = subprocess.run([sys.executable, "-c", DAEMON, "500"], stderr=log, check=True, timeout=60)
    assert done.returncode == 0
    lines = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert [line["k"] for line in lines] == list(range(500))
    assert {"event", "level", "timestamp"} <= set(lines[0])


class Disk:
    """A descriptor whose writes fail when told to, or after some bytes."""

    def __init__(self, monkeypatch):
        self.room = None
        self.text = b""
        monkeypatch.setattr(os, "write", self.write)

    def write(self, _descriptor, data):
        if self.room == 0:
            raise OSError(28, "No space left on device")
        taken = bytes(data) if self.room is None else bytes(data[: self.room])
        if self.room is not None:
            self.room -= len(taken)
        self.text += taken
        return len(taken)


def test_a_full_disk_costs_lines_and_the_next_line_says_how_many(monkeypatch):
    disk = Disk(monkeypatch)
    steps = [(None, b"a\n"), (0, b"b\nc\n"), (0, b"d\n"), (None, b"e\n"), (3, b"long\nf\n"), (None, b"g\n")]
    feed = iter(steps)

    def read(_descriptor, _size):
        disk.room, data = next(feed, (None, b""))
        return data

    monkeypatch.setattr(os, "read", read)
    copy_lines(0, 1)
    lines = disk.text.decode().splitlines()
    assert lines[0] == "a"
    assert json.loads(lines[1]) == {"event": "log lines lost", "lines_lost": 3}
    assert lines[2:4] == ["e", "lon"]
    assert json.loads(lines[4]) == {"event": "log lines lost", "lines_lost": 2}
    assert lines[5] == "g"


def test_a_helper_ends_with_its_pipe_and_not_by_signals_to_the_group():
    helper = Helper(lambda hears, answers: os.write(answers, os.read(hears, 10)) and None)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        time.sleep(0.05)
        os.kill(helper.pid, number)
    os.write(helper.to_child, b"hello")
    os.set_blocking(helper.from_child, True)
    assert os.read(helper.from_child, 10) == b"hello"
    helper.close()
    with pytest.raises(ChildProcessError):
        os.waitpid(helper.pid, 0)


def test_a_helper_that_hangs_is_killed():
    helper = Helper(lambda _hears, _answers: time.sleep(100))
    started = time.monotonic()
    helper.close()
    assert time.monotonic() - started < 5.0


def test_levels_are_kept(capfd):
    make_logger("warning").info("quiet")
    make_logger("warning").warning("loud")
    err = capfd.readouterr().err
    assert "loud" in err
    assert "quiet" not in err
