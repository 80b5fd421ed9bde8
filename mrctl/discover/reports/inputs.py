"""What a report was made from: each input by its name and the beginning of its digest."""

from __future__ import annotations

from mrctl.calibration import Calibration
from mrctl.measurements.run import Campaign

DIGITS = 16


def inputs_of(campaign: Campaign, calibration: Calibration | None = None) -> list[tuple[str, str]]:
    """Name and digest of the calibration, where one was read from a file, and of the measurements."""
    read = [(campaign.root.name or str(campaign.root), campaign.sha256[:DIGITS])]
    if calibration is not None and calibration.path and calibration.sha256:
        read.insert(0, (calibration.path.name, calibration.sha256[:DIGITS]))
    return read
