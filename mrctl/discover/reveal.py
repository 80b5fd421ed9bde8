"""Before any search: which effects this campaign could show at all, at their usual size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.screen import Look

Array = NDArray[np.float64]

LEAST_SIGNAL = 30.0  # square sum in units of the noise that an effect of usual size must leave


def hidden_effects(looks: list[Look], colour: float) -> dict[str, str]:
    """Effects that this campaign cannot show, and why; `colour`: samples that count as one."""
    result = {}
    for look in looks:
        name = look.effect.name
        if look.usual_force <= 0.0:
            result[name] = "at its usual size it makes no force here: nothing in these runs excites it"
        elif look.usual_beyond < LEAST_SIGNAL * colour:
            share = 100.0 * (1.0 - look.usual_beyond / look.usual_force)
            result[name] = (
                f"the base model's own tables and filter take up {min(share, 100.0):.4g} % of it, "
                "and the rest is below the noise"
            )
    return result
