"""`mrctl effects`: the physical effects it knows, and a start for one of your own."""

from __future__ import annotations

import argparse
import json
import keyword
import os
import shlex
import sys
import textwrap
from pathlib import Path

from mrctl.calibration import load_calibration
from mrctl.cli.effect_template import template
from mrctl.cli.own_effects import effects_named, file_of
from mrctl.errors import InputError
from mrctl.model.effects.base import Effect, Parameter, force_power
from mrctl.model.effects.card import card
from mrctl.model.effects.registry import VARIABLE, effects
from mrctl.model.effects.size import LARGEST_N, SMALLEST_N
from mrctl.printable import printable
from mrctl.report.terminal import paint
from mrctl.share_path import share_file
from mrctl.yaml_source.writer import check_writable, write_atomically

WIDTH = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl effects`."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these effects (default: all)")
    parser.add_argument("--json", metavar="FILE", help="write them as JSON; - is standard output")
    parser.add_argument("--new", metavar="NAME", help="write a commented effect of your own that runs")
    parser.add_argument("-o", "--output", metavar="FILE", help="where --new writes (default: NAME.py)")
    parser.add_argument(
        "--check",
        action="store_true",
        help="try out what every effect promises (with numba, from the extra desk)",
    )
    parser.epilog = f"""\
An effect of your own is one file that holds an EFFECT. mrctl finds it in the files and folders that the
environment variable {VARIABLE} lists (separated by "{os.pathsep}"; of a folder not what begins with _),
or in an installed package through the
entry point `[project.entry-points."mrctl.effects"]  NAME = "package.module"`.

examples:
  mrctl effects
  mrctl effects gas_spring
  mrctl effects --new bypass_groove -o bypass_groove.py
  {VARIABLE}=bypass_groove.py mrctl effects bypass_groove --check
"""


def run(args: argparse.Namespace) -> int:
    """List, write or check; returns 0, or 1 where a promise is broken."""
    _refuse_what_does_nothing(args)
    if args.new is not None:
        return _write_new(args.new, Path(args.output or f"{args.new}.py"))
    chosen = _chosen(args.names)
    cards = {one.name: card(one) for one in chosen}
    broken = _check(chosen, quiet=args.json == "-") if args.check else {}
    for name, what in broken.items():
        cards[name]["broken_promises"] = what
    status = 1 if any(broken.values()) else 0
    if args.json:
        figures = {"effects": list(cards.values())}
        text = json.dumps(figures, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        if args.json == "-":
            sys.stdout.write(text)
            return status
        write_atomically(args.json, text)
    if not args.check:
        print("\n\n".join(_text(one) for one in chosen))
    return status


def _refuse_what_does_nothing(args: argparse.Namespace) -> None:
    """Raises InputError for what would be passed over: much beside --new, -o without it."""
    if args.new is None:
        if args.output:
            mend = "name the effect to write, --new NAME; the list goes to a file by --json FILE"
            raise InputError.at("-o", "does nothing without --new", mend)
        return
    for what, given in (("NAME", args.names), ("--json", args.json), ("--check", args.check)):
        if given:
            mend = "write the effect first, and ask for this by itself"
            raise InputError.at(what, "does nothing beside --new", mend)


def _chosen(names: list[str]) -> list[Effect]:
    return effects_named(names, "NAME") or list(effects().values())


def _text(one: Effect) -> str:
    needs = f", needs {' and '.join(sorted(one.needs))}" if one.needs else ""
    lines = [
        f"{paint(one.name, 'bold')}  ({one.stage}{needs})",
        *_wrapped(one.summary),
        *_wrapped(one.equation),
        *(line for parameter in one.parameters for line in _parameter_text(parameter)),
        *_wrapped(f"undone: {one.inverse}. {one.inverse_note}"),
        *_wrapped(f"source: {one.source}"),
    ]
    return "\n".join(lines)


def _parameter_text(p: Parameter) -> list[str]:
    unit = "" if p.unit == "1" else f" {p.unit}"
    held = ", held unless asked for" if p.held else ""
    numbers = f"{p.low:g} to {p.high:g}{unit}, neutral {p.neutral:g}, usual {p.typical:g}"
    power = force_power(p.unit)
    if power:
        way = "in" if power > 0 else "in inverse"
        numbers += f" (for {SMALLEST_N:g} to {LARGEST_N:g} N of force; else {way} proportion)"
    return _wrapped(f"{p.name}: {p.help}; {numbers}{held}", "    ")


def _wrapped(text: str, indent: str = "  ") -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=indent, subsequent_indent=indent + "  ")


def _write_new(name: str, path: Path) -> int:
    if keyword.iskeyword(name):
        raise InputError.at("--new", f"{name!r} is a Python keyword", "choose another name")
    if not name.isidentifier() or name != name.lower() or name.startswith("_"):
        mend = "lower-case letters, digits and _, a letter first"
        raise InputError.at("--new", f"{name!r} cannot name an effect", mend)
    if name in effects():
        raise InputError.at("--new", f"the effect {name} is already there", "choose another name")
    check_writable(path)
    if path.exists():
        raise InputError.at(path, "the file is already there", "choose another with -o")
    write_atomically(path, template(name))
    print(f"wrote {path}")
    print(f"try it:  {VARIABLE}={shlex.quote(str(path))} mrctl effects {name} --check")
    return 0


def _check(chosen: list[Effect], *, quiet: bool) -> dict[str, list[str]]:
    """What each effect fails to keep; told as they are tried, unless quiet."""
    try:
        from mrctl.simulate.promises import broken_promises  # noqa: PLC0415 - only this needs numba
    except ImportError as error:
        raise InputError.at(
            "--check", f"it needs {error.name}", 'install the extra: pip install "mrctl[desk]"'
        ) from error
    damper = load_calibration(share_file("config/calibration.yaml")).damper
    found = {}
    for one in chosen:
        found[one.name] = broken_promises(one, damper)
        if quiet:
            continue
        print(f"{one.name}: {'breaks' if found[one.name] else 'keeps'} its promises")
        for what in found[one.name]:
            print(f"  {printable(file_of(one))}: {one.name}: {what}")
    return found
