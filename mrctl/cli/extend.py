"""`mrctl extend`: adds effects to a calibration, and shows the error before and after."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mrctl.calibration import load_calibration
from mrctl.cli.diagnosis import (
    data_arguments,
    effects_of,
    extension_figures,
    fast_enough,
    load_sound,
    print_parameters,
)
from mrctl.cli.outputs import check_outputs, given, print_unsaid, write_figures
from mrctl.cli.own_effects import effects_named, try_own_effects
from mrctl.discover.extend import Extension, extend
from mrctl.discover.extended_calibration import write_extended
from mrctl.errors import InputError
from mrctl.model.damper import Damper
from mrctl.report.progress import Progress

FALLS = 0.99  # times the error before: more is no fall
NARROWER = 0.9  # times the range before, from which it is said


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl extend`."""
    parser.add_argument("calibration", metavar="CAL", help="the calibration to extend")
    data_arguments(parser)
    parser.add_argument(
        "--effect", nargs="+", action="extend", default=[], metavar="NAME", help="add these (mrctl effects)"
    )
    parser.add_argument(
        "--remove", nargs="+", action="extend", default=[], metavar="NAME", help="take these out again"
    )
    parser.add_argument("-o", "--output", required=True, metavar="CAL2.yaml", help="the calibration to write")
    parser.epilog = """\
Base and effects are fitted together. The error before and after is measured on runs that those fits did not
see; what is written is then fitted to all runs.

examples:
  mrctl extend damper.yaml campaign/ --effect gas_spring -o extended.yaml --report extended.html
  mrctl extend extended.yaml campaign/ --remove gas_spring -o plain.yaml
"""


def run(args: argparse.Namespace) -> int:
    """Extend, prove, write."""
    check_outputs(args, updates="calibration")  # whose history goes on
    calibration = load_calibration(args.calibration)
    has = {setting.name for setting in calibration.damper.effects}
    _check_names(args, has)
    added = [e for e in effects_named(args.effect, "--effect") if e.name not in has]
    try_own_effects()
    campaign = load_sound(args)
    known, values = effects_of(calibration)
    kept, removed = ([e for e in known if (e.name in args.remove) is out] for out in (False, True))
    for name in sorted(has & set(args.effect)):
        print(f"note: {args.calibration} has {name} already; it is fitted anew", file=sys.stderr)
    quiet = args.quiet or args.json == "-"
    with Progress("Extending", 1.0, quiet=quiet) as progress, fast_enough(campaign):
        result = extend(campaign, kept, added, values, report=progress.update, removed=removed)
    parts = ["extend"] * bool(args.effect) + ["remove " + ", ".join(args.remove)] * bool(args.remove)
    what = " and ".join(parts)
    write_extended(
        result, calibration.name, campaign, args.data, args.output, what, calibration.provenance.history
    )
    for doubt in _doubts(result, calibration.damper, args.effect):
        print(f"warning: {doubt}", file=sys.stderr)
    figures = extension_figures(result)
    if args.report:
        from mrctl.discover.reports.extend_report import write_extension  # noqa: PLC0415 - only who asks for it loads it

        words = ["mrctl", "extend", args.calibration, args.data, *given("--columns", args.columns)]
        words += [*given("--effect", *args.effect), *given("--remove", *args.remove)]
        words += ["-o", args.output, "--report", args.report]
        write_extension(result, figures, campaign, calibration, Path(args.report), shlex.join(words))
    if write_figures(args, figures):
        print_extension(figures, args.output)
    return 0


def _doubts(result: Extension, before: Damper, added: Sequence[str]) -> list[str]:
    """What of the new calibration a user might not expect: effects that prove nothing, less that is valid."""
    found = []
    if added and result.rmse_after_n > FALLS * result.rmse_before_n:
        names = ", ".join(added)
        found.append(f"the error on the runs left out does not fall with {names}; nothing here bears it out")
    now = result.damper
    for what, unit, was, here in (
        ("currents", "A", before.current_valid_a, now.current_valid_a),
        ("velocities", "m/s", before.velocity_valid_m_s, now.velocity_valid_m_s),
        ("temperatures", "degC", before.temperature_valid_c, now.temperature_valid_c),
    ):
        if here.high - here.low < NARROWER * (was.high - was.low):
            less = (
                f"{here.low:.3g} to {here.high:.3g} {unit} and was for {was.low:.3g} to {was.high:.3g} {unit}"
            )
            found.append(f"the calibration is for {what} of {less}: all of it is fitted to these runs")
    return found


def _check_names(args: argparse.Namespace, has: set[str]) -> None:
    """Raises InputError for names that cannot be added to or removed from a calibration of these effects."""
    if not args.effect and not args.remove:
        raise InputError.at(
            "--effect", "nothing to add or remove", "name an effect; `mrctl effects` lists them"
        )
    for name in args.remove:
        if name not in has:
            raise InputError.at(
                args.calibration,
                f"has no effect {name} to remove",
                f"it has {', '.join(sorted(has)) or 'none'}",
            )
        if name in args.effect:
            raise InputError.at("--remove", f"{name} is to be added as well", "name it in one of the two")


def print_extension(figures: dict[str, Any], output: str) -> None:
    """The error falling, and the parameters."""
    floor = figures["noise_floor_n"]
    print(f"\nHeld out, seen by no fit: {', '.join(figures['held_out'])}")
    for step in figures["steps"]:
        print(f"{step['rmse_n']:10.3g} N with {', '.join(step['effects']) or 'the base model alone'}")
    print(f"{'not known' if floor is None else f'{floor:10.3g} N'} noise")
    for name, parameters in figures["parameters"].items():
        print_parameters(name, parameters, figures["derived"][name])
    print_unsaid(figures["not_identified"])
    print(f"\nwritten: {output}")
