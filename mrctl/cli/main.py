"""The command line: finds the command, imports its module, turns errors into one line and an exit status.

Exit status: 0 success, 1 failure at run time, 2 unusable input, 130 interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import mrctl
from mrctl.errors import InputError, MrctlError, Problem, lines_of
from mrctl.printable import printable

# In the order of a user's way; the summaries stand here so that `mrctl --help` imports no command.
COMMANDS = {
    "demo": "the whole story on a simulated car: compare ways to command the dampers, draw a report",
    "run": "the controller: sensor frames in, current commands out",
    "plant": "a simulated car on the same bus, for loop tests",
    "top": "a live view of the controller, from the frames on the bus",
    "replay": "recorded CAN logs through the controller: the same commands again, or where they differ",
    "judge": "watch a bus or a log: does every command keep the safety rules?",
    "check": "say whether a calibration, configuration or DBC is sound",
    "predict": "add the model's force to a measured run",
    "invert": "add the current that makes a run's force",
    "compare": "model against measurements: how good, and where it fails",
    "identify": "measurements to calibration",
    "diagnose": "which physical effect is missing, or why the measurements cannot tell",
    "extend": "add effects to a calibration, proven on runs left out",
    "discover": "identify, diagnose and extend until nothing more can honestly be added",
    "effects": "physical effects beyond the separable model: equations, parameters, how each is undone",
    "dyno": "measure a virtual damper by the published protocol and others",
    "verify": "the published tables and figures, side by side with what both methods reach here",
    "bench": "benchmarks against a peer in the same run",
    "safe-frame": "put a last 0 A command on the bus, for service managers",
}


# What the extra `desk` brings, and a plain installation does without.
DESK = {"scipy", "numba", "matplotlib", "asammdf"}


class Command(Protocol):
    """What a command's module must have."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare options; set `parser.epilog` to examples."""

    def run(self, args: argparse.Namespace) -> int:
        """Do it; returns the exit status."""


def build_parser(chosen: str | None) -> argparse.ArgumentParser:
    """The parser of all commands; only the chosen one's module is imported."""
    parser = argparse.ArgumentParser(
        prog="mrctl",
        description="Makes a magnetorheological damper do what a control law asks.",
        epilog="`mrctl COMMAND --help` explains a command and gives an example.",
    )
    parser.add_argument("--version", action="version", version=f"mrctl {mrctl.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if name == chosen:
            module = load_command(name)
            module.add_arguments(sub)
            sub.set_defaults(run=module.run)
    return parser


def load_command(name: str) -> Command:
    """The module of a command."""
    module: Command = importlib.import_module(f"mrctl.cli.{name.replace('-', '_')}")
    return module


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    # The fits are many and small: threads inside the linear algebra would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _open_what_is_closed()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without Unicode gets "?" instead of a traceback
            stream.reconfigure(errors="replace")
    chosen = next((word for word in arguments if word in COMMANDS), None)
    try:
        args = build_parser(chosen).parse_args(arguments)
        _refuse_empty(args)
        status: int = args.run(args)
        sys.stdout.flush()
    except MrctlError as error:
        lines = lines_of(error.problems) if isinstance(error, InputError) else [printable(str(error))]
        for line in lines:
            print(f"error: {line}", file=sys.stderr)
        return error.exit_status
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] not in DESK:
            raise
        line = f"error: {error.name} is not installed; this needs the desk: pip install 'mrctl[desk]'"
        print(line, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader, `head` perhaps, has had enough
        _drop_output()
        return 0
    except OSError as error:  # above all a disk that is full behind standard output
        place = "standard output" if error.filename is None else str(error.filename)
        failure = Problem(
            place, None, f"failed ({error.strerror or error})", "make room, or name another place"
        )
        print(f"error: {failure}", file=sys.stderr)
        _drop_output()
        return 1
    return status


def _refuse_empty(args: argparse.Namespace) -> None:
    """Raises InputError for an argument without a letter: as a path it would mean the current folder."""
    for name, value in vars(args).items():
        if value == "" or (isinstance(value, list) and "" in value):
            mend = "give it a value; is a variable of the shell not set?"
            raise InputError.at(name.replace("_", " ").upper(), "is empty", mend)


def _open_what_is_closed() -> None:
    """Standard output or error that the caller closed goes nowhere: the next file would take its number."""
    sys.stdout = sys.stdout or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - for good
    sys.stderr = sys.stderr or Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - as above


def _drop_output() -> None:
    """What is left to print goes nowhere, so that the end of the program does not fail for it again."""
    with contextlib.suppress(io.UnsupportedOperation):  # what stands in for standard output in tests
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def entry_point() -> None:
    """The `mrctl` program."""
    sys.exit(main())
