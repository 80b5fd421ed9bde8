"""Whether a model leaves white noise and next to nothing more: then a search beside it can find nothing.

What a damper does fades with frequency, and no effect is named that takes less than a share of what is left.
So where that is as loud at low frequencies as at high ones, no candidate need be fitted to know. But what is
late by a fixed time does not fade: a force that steps at each turn leaves a spike there, as loud at all
frequencies. So nor may what is left follow the modelled force, a few samples before or after. Where so
little is left that an effect must be more than finer tables, what these would take is none.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from mrctl.discover.fits.finer_tables import left_by_finer
from mrctl.discover.fits.proof import Proof
from mrctl.discover.noise.spectral_floor import HIGHEST_SHARE, periodogram
from mrctl.discover.verdict.worth import least_accepted_n2, least_n2

Array = NDArray[np.float64]

LOW = 0.15  # of the rate at which forces are weighed, below which a damper acts
SURE = 3.0  # standard errors of the level of noise, beyond which there is nothing
ALIKE = 1.5  # lines that a window makes one
FEWEST = 64  # samples of a record, for its spectrum to say something
AROUND = 4  # samples before and after, by which what is left may follow the force
ROUNDING = 1e-12  # of the largest force's power, below which a direction says nothing


def is_quiet(before: Proof) -> bool:
    """Whether no effect can take enough off a model to be named: what it leaves may be white noise."""
    model = before.fit.model
    parts = model.residuals(before.fit.theta)
    if min(part.size for part in parts) < FEWEST:
        return False
    samples = float(sum(part.size for part in parts))
    least = least_accepted_n2(before) * samples
    measured = (model.weighed(r, r.force_n) for r in model.records)
    if _follows([f[-part.size :] - part for f, part in zip(measured, parts, strict=True)], parts) > least:
        return False
    over = _surely_over_the_noise(parts)
    if least <= over < least_n2(before) * samples:  # so little must be more than finer tables would take
        over = _surely_over_the_noise(left_by_finer(before))
    return over < least


def _follows(forces: list[Array], parts: list[Array]) -> float:
    """The square sum (N²) of residuals that one linear filter makes of the forces, of any phase."""
    taps = 2 * AROUND + 1
    gram, along = np.zeros((taps, taps)), np.zeros(taps)
    for force, part in zip(forces, parts, strict=True):
        moved = sliding_window_view(force - force.mean(), taps)
        gram += moved.T @ moved
        along += moved.T @ part[AROUND:-AROUND]
    return float(along @ np.linalg.pinv(gram, ROUNDING, hermitian=True) @ along)


def _surely_over_the_noise(parts: list[Array]) -> float:
    """The square sum (N²) of residuals at low frequencies that is certainly not exceeded, over the noise."""
    found = np.array([_over_the_noise(part) for part in parts])
    return float(found[:, 0].sum()) + SURE * float(np.sqrt(found[:, 1].sum()))


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
