"""Whether a model leaves white noise and next to nothing more: then a search beside it can find nothing.

What a damper does fades with frequency, and no effect is named that takes less than a share of what is left.
So where that is as loud at low frequencies as at high ones, no candidate need be fitted to know.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.proof import Proof
from mrctl.discover.noise.spectral_floor import HIGHEST_SHARE, periodogram
from mrctl.discover.verdict.worth import least_accepted_n2

Array = NDArray[np.float64]

LOW = 0.15  # of the rate at which forces are weighed, below which a damper acts
SURE = 3.0  # standard errors of the level of noise, beyond which there is nothing
ALIKE = 1.5  # lines that a window makes one
FEWEST = 64  # samples of a record, for its spectrum to say something


def is_quiet(before: Proof) -> bool:
    """Whether no effect can take enough off a model to be named: what it leaves may be white noise."""
    parts = before.fit.model.residuals(before.fit.theta)
    if min(part.size for part in parts) < FEWEST:
        return False
    found = np.array([_over_the_noise(part) for part in parts])
    over, doubt = float(found[:, 0].sum()), float(np.sqrt(found[:, 1].sum()))
    return over + SURE * doubt < least_accepted_n2(before) * float(sum(part.size for part in parts))


def _over_the_noise(residual: Array) -> tuple[float, float]:
    """The square sum (N²) of a residual (n) at low frequencies over the noise of high ones; its variance."""
    power = periodogram(residual)
    share = np.arange(power.size) / residual.size
    low, high = (share > 0.0) & (share < LOW), (share >= LOW) & (share < HIGHEST_SHARE)
    noise = float(power[high].mean())
    lines, others = np.count_nonzero(low), np.count_nonzero(high)
    constant = residual.size * float(residual.mean()) ** 2
    over = constant + 2.0 * float((power[low] - noise).sum())
    return over, 4.0 * noise**2 * ALIKE * (lines + lines**2 / others)
