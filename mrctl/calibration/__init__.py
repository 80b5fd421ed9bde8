"""The calibration file: all that describes one damper, with units, provenance and limits."""

from __future__ import annotations

from mrctl.calibration.calibration import (
    Calibration,
    calibration_from_damper,
    calibration_from_document,
    dump_calibration,
    load_calibration,
)
from mrctl.calibration.effects import known_effects
from mrctl.calibration.filter_checks import cascade_error
from mrctl.calibration.models import Provenance, Step

__all__ = [
    "Calibration",
    "Provenance",
    "Step",
    "calibration_from_damper",
    "calibration_from_document",
    "cascade_error",
    "dump_calibration",
    "known_effects",
    "load_calibration",
]
