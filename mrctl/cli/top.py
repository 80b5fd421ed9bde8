"""`mrctl top`: a controller at work, seen from the bus."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import select
import shutil
import sys
import termios
import time
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from mrctl.can.ports import Port, open_port
from mrctl.config import load_config
from mrctl.errors import BusError
from mrctl.top.screen import fit, lines
from mrctl.top.watch import Watch

LOOK_EVERY_S: Final = 0.02
ONCE_S: Final = 2.2
"""Time for a first look: the slowest frames come once a second."""
LOG_LINES: Final = 6
LOG_TAIL_BYTES: Final = 8192

_ENTER = "\x1b[?1049h\x1b[?25l"
_LEAVE = "\x1b[?25h\x1b[?1049l"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl top`."""
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="configuration, YAML")
    parser.add_argument("--channel", help="CAN channel, instead of the configuration's")
    parser.add_argument("--interface", help="interface of python-can, instead of the configuration's")
    parser.add_argument("--once", action="store_true", help="look for two seconds, print, and end")
    parser.add_argument(
        "--every", type=float, default=0.5, metavar="SECONDS", help="between two views (default: %(default)s)"
    )
    parser.add_argument("--log", metavar="FILE", help="show the last lines of the daemon's log too")
    parser.add_argument(
        "--json", metavar="FILE", help="write each view as a line of JSON (- is standard output)"
    )
    parser.epilog = """\
States and causes, currents, inputs, lateness and duration of the ticks, rejected frames and their reasons,
and how often each frame comes: all from the frames on the bus, on this machine or another. It sends nothing.
q or Ctrl-C ends it. Off a terminal it prints one view, as with --once.

examples:
  mrctl top -c config/vehicle.yaml
  mrctl top -c config/vehicle.yaml --once --json -
"""


def run(args: argparse.Namespace) -> int:
    """Watch until told to stop; with --once returns 1 where no controller was seen."""
    config = load_config(args.config).on_bus(args.channel, args.interface)
    watch = Watch.of(config, time.monotonic())
    bus = config.bus
    port = open_port(
        bus.interface, bus.channel, bus.bitrate, bus.fd, watch.frames, data_bitrate=bus.data_bitrate
    )
    with contextlib.closing(port), _json_to(args.json) as json_to:
        if args.once or (json_to is None and not sys.stdout.isatty()):
            return _once(watch, port, args, json_to)
        try:
            if json_to is not None:
                _stream(watch, port, args.every, json_to)
            else:
                _live(watch, port, args)
        except KeyboardInterrupt:
            pass  # the usual way to end it
    return 0


def _once(watch: Watch, port: Port, args: argparse.Namespace, json_to: Any) -> int:  # noqa: ANN401  # a text file
    _look(watch, port, ONCE_S)
    snapshot = watch.snapshot(time.monotonic())
    if json_to is not None:
        json_to.write(json.dumps(snapshot, indent=2) + "\n")
    else:
        print("\n".join(lines(snapshot, _tail(args.log))))
    if snapshot["command_age_s"] is None:
        raise BusError(
            f"no command of a controller on {snapshot['channel']} in {ONCE_S:g} s; start `mrctl run` there"
        )
    return 0


def _stream(watch: Watch, port: Port, every_s: float, json_to: Any) -> None:  # noqa: ANN401  # a text file
    while True:
        _look(watch, port, every_s)
        json_to.write(json.dumps({"time_s": time.time(), **watch.snapshot(time.monotonic())}) + "\n")
        json_to.flush()


def _live(watch: Watch, port: Port, args: argparse.Namespace) -> None:
    with _screen() as keys:
        while True:
            if _look(watch, port, args.every, keys):
                return
            view = lines(watch.snapshot(time.monotonic()), _tail(args.log))
            columns, rows = shutil.get_terminal_size()
            text = "\x1b[K\r\n".join(fit(view, columns, rows))
            sys.stdout.write(f"\x1b[H{text}\x1b[K\x1b[J")
            sys.stdout.flush()


def _look(watch: Watch, port: Port, seconds: float, keys: int | None = None) -> bool:
    """Take frames for so long; True when q was pressed."""
    ends = time.monotonic() + seconds
    while (now := time.monotonic()) < ends:
        watch.take(port.receive(), now)
        if keys is None:
            time.sleep(LOOK_EVERY_S)
        elif select.select([keys], [], [], LOOK_EVERY_S)[0]:
            pressed = os.read(keys, 64)
            if not pressed or b"q" in pressed or b"\x03" in pressed:
                return True
    watch.measure_rates(time.monotonic())
    return False


@contextlib.contextmanager
def _screen() -> Iterator[int | None]:
    """The terminal's other screen, without echo, until the end; gives where keys come from, if anywhere."""
    keys = sys.stdin.fileno() if sys.stdin.isatty() else None
    before = termios.tcgetattr(keys) if keys is not None else None
    try:
        if keys is not None:
            tty.setcbreak(keys)
        sys.stdout.write(_ENTER)
        yield keys
    finally:
        sys.stdout.write(_LEAVE)
        sys.stdout.flush()
        if keys is not None and before is not None:
            termios.tcsetattr(keys, termios.TCSADRAIN, before)


@contextlib.contextmanager
def _json_to(name: str | None) -> Iterator[Any]:
    if name is None:
        yield None
    elif name == "-":
        yield sys.stdout
    else:
        with Path(name).open("w", encoding="utf-8") as file:
            yield file


def _tail(path: str | None) -> list[str]:
    """The last lines of a log, as far as it can be read; a file that is not there yet is no error."""
    if path is None:
        return []
    try:
        with Path(path).open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - LOG_TAIL_BYTES))
            text = file.read().decode("utf-8", "replace")
    except OSError as error:
        return [f"{path}: {error.strerror}"]
    clean = ("".join(c if c.isprintable() else "?" for c in line) for line in text.splitlines()[-LOG_LINES:])
    return list(clean)
