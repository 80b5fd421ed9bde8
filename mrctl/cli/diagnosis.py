"""What `compare`, `diagnose`, `extend` and `discover` share: their data, effects and calibrations."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from mrctl.calibration import Calibration
from mrctl.discover.extend import Extension
from mrctl.discover.reports.fitted import derived_of, parameters_of
from mrctl.errors import InputError
from mrctl.identify.findings import findings_of
from mrctl.measurements import Campaign, load_campaign, require_sound
from mrctl.model.effects.base import Effect, Vector
from mrctl.model.effects.registry import effect as effect_named
from mrctl.model.filters import FilterError
from mrctl.report.terminal import paint


def load_sound(args: argparse.Namespace) -> Campaign:
    """The campaign, its quality spoken of. Raises InputError where it cannot be used."""
    campaign = load_campaign(args.data, args.columns)
    for problem in require_sound(campaign):
        print(f"warning: {problem}", file=sys.stderr)
    return campaign


def data_arguments(parser: argparse.ArgumentParser) -> None:
    """DATA and what goes with it."""
    parser.add_argument("data", metavar="DATA", help="a campaign: folder of runs, or one file")
    parser.add_argument("--columns", metavar="MAP.yaml", help="names, units and layout of foreign files")
    parser.add_argument("--report", metavar="F.html", help="write a report with pictures")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON; - is standard output")
    parser.add_argument("--quiet", action="store_true", help="no progress, no table")


def effects_of(calibration: Calibration) -> tuple[list[Effect], dict[str, Vector]]:
    """The calibration's effects and their parameters."""
    known, values = [], {}
    for setting in calibration.damper.effects:
        effect = effect_named(setting.name)
        known.append(effect)
        values[setting.name] = effect.vector(setting.parameters)
    return known, values


@contextmanager
def fast_enough(campaign: Campaign) -> Iterator[None]:
    """Raises InputError where a filter that is found within cannot be carried to the loop's rates."""
    try:
        yield
    except FilterError as error:
        raise InputError.at(campaign.root, str(error), "measure at 500 Hz or faster") from error


def extension_figures(extension: Extension) -> dict[str, Any]:
    """What `extend --json` writes."""
    return {
        "effects": list(extension.effects),
        "rmse_before_n": extension.rmse_before_n,
        "rmse_after_n": extension.rmse_after_n,
        "noise_floor_n": extension.noise_floor_n,
        "held_out": list(extension.held_out),
        "parameters": {name: parameters_of(extension.fit, name) for name in extension.effects},
        "derived": {name: derived_of(extension.fit, name) for name in extension.effects},
        "steps": [{"effects": list(names), "rmse_n": rmse} for names, rmse in extension.steps],
        "not_identified": [f"{one}." for one in findings_of(extension.fit, extension.std, extension.damper)],
    }


def print_parameters(
    name: str, parameters: Mapping[str, Mapping[str, Any]], derived: Mapping[str, Mapping[str, Any]]
) -> None:
    """An effect's parameters with their intervals, and what they come to."""
    print("\n" + paint(name, "bold"))
    for key, p in parameters.items():
        ci = "not moved by this data" if p["ci95"] is None else f"{p['ci95'][0]:.4g} to {p['ci95'][1]:.4g}"
        print(f"  {key} = {p['value']:.4g} {p['unit']}  ({ci})")
    for words, p in derived.items():
        print(f"  {words}: {p['value']:.4g} {p['unit']}")
