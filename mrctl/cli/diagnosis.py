"""What `compare`, `diagnose`, `extend` and `discover` share: their data, effects and calibrations."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping

from mrctl.calibration import Calibration
from mrctl.discover.extend import Extension
from mrctl.measurements import Campaign, load_campaign, require_sound
from mrctl.model.effects.base import Effect, Vector
from mrctl.model.effects.registry import effect as effect_named


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


def extension_figures(extension: Extension, parameters: Mapping[str, object]) -> dict[str, object]:
    """What `extend --json` writes."""
    return {
        "effects": list(extension.effects),
        "rmse_before_n": extension.rmse_before_n,
        "rmse_after_n": extension.rmse_after_n,
        "noise_floor_n": extension.noise_floor_n,
        "held_out": list(extension.held_out),
        "parameters": parameters,
        "steps": [{"effects": list(names), "rmse_n": rmse} for names, rmse in extension.steps],
    }
