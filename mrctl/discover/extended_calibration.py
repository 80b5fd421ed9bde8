"""What was found, as a calibration that keeps its history."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import mrctl
from mrctl.calibration import Provenance, Step, calibration_from_damper, dump_calibration
from mrctl.discover.extend import Extension
from mrctl.measurements import Campaign
from mrctl.printable import printable


def write_extended(
    extension: Extension,
    name: str,
    campaign: Campaign,
    data: str,
    output: str,
    what: str,
    history: Sequence[Step] = (),
    notes: Sequence[str] = (),
) -> None:
    """The extended damper as a calibration with its history; notes: more about how it was made."""
    today = datetime.now(UTC).date().isoformat()
    steps = [
        Step(
            what=what,
            effects=effects,
            rmse_n=rmse,
            noise_floor_n=extension.noise_floor_n,
            date=today,
            data=f"{printable(data)}, sha256 {campaign.sha256[:16]}",
            version=mrctl.__version__,
        )
        for effects, rmse in extension.steps
    ]
    how = f"base and effects fitted jointly, proven on {len(extension.held_out)} runs not in that fit."
    provenance = Provenance(
        source=f"{len(campaign)} runs in {printable(data)}",
        created=today,
        method=" ".join([f"mrctl {what}: {how}", *notes]),
        data_sha256=campaign.sha256,
        history=(*history, *steps),
    )
    dump_calibration(calibration_from_damper(name, extension.damper, provenance, extension.std), output)
