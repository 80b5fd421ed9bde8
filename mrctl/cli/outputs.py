"""Where a command writes: looked at before it works, and the figures that it writes there.

There must be a place, and nothing that the command reads.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Container, Mapping, Sequence
from pathlib import Path

from mrctl.errors import InputError
from mrctl.measurements.column_map import read_map
from mrctl.measurements.find import find_files
from mrctl.report.terminal import paint
from mrctl.yaml_source.writer import check_writable, write_atomically

OUTPUTS = {"output": "-o", "json": "--json", "report": "--report"}
INPUTS = {"calibration": "CAL", "run_file": "RUN", "columns": "--columns", "damper": "--damper"}


def check_outputs(
    args: argparse.Namespace, *, makes_folder: Container[str] = ("report",), updates: str = ""
) -> None:
    """Raises InputError where an output cannot be written, or would replace another one or an input.

    makes_folder: the outputs whose writers make the folders that are missing. updates: the input that -o may
    replace, since all that it holds goes on in the output.
    """
    places: dict[str, str] = {}
    read: dict[str, str] | None = None
    for name, option in OUTPUTS.items():
        path = getattr(args, name, None)
        if not path or (name == "json" and path == "-"):
            continue
        check_writable(path, makes_folder=name in makes_folder)
        if Path(path).exists() and not Path(path).is_file():
            continue  # a pipe or /dev/null takes everything and replaces nothing
        real = os.path.realpath(path)
        if real in places:
            what = f"{places[real]} and {option} name the same file"
            raise InputError.at(path, what, "name another one for one of them")
        places[real] = option
        if Path(path).exists():
            read = _inputs(args) if read is None else read
            if real in read and not (name == "output" and read[real] == INPUTS.get(updates)):
                what = f"{option} would replace what is read as {read[real]}"
                raise InputError.at(path, what, "name another file")


def given(name: str, *values: str | None) -> list[str]:
    """An option's words in a command line that a report shows; none where it was not given."""
    words = [value for value in values if value]
    return [name, *words] if words else []


def write_figures(args: argparse.Namespace, figures: Mapping[str, object]) -> bool:
    """Write the figures as JSON where --json says; returns whether the command is to print for people too.

    It is not with --quiet, nor where standard output is the JSON's.
    """
    if args.json:
        text = json.dumps(figures, indent=2, allow_nan=False) + "\n"
        if args.json == "-":
            sys.stdout.write(text)
            return False
        write_atomically(args.json, text)
    return not args.quiet


def print_unsaid(notes: Sequence[str]) -> None:
    """What of a calibration the measurements do not say."""
    if notes:
        print("\n" + paint("What this campaign does not say", "bold"))
        for note in notes:
            print(f"  {note}")


def _inputs(args: argparse.Namespace) -> dict[str, str]:
    """The files that a command reads, followed through links, and which argument names each."""
    files = {label: getattr(args, name, None) for name, label in INPUTS.items()}
    found = {os.path.realpath(path): label for label, path in files.items() if path}
    if getattr(args, "data", None):
        columns = getattr(args, "columns", None)
        patterns = read_map(columns).patterns if columns else ()
        found |= {os.path.realpath(file): "DATA" for file, _ in find_files(args.data, patterns).files}
    return found
