"""A velocity that was smoothed more than its motion bears: a filter without phase, or wide differences.

What it took off a fast motion seems to be missing from the damper, and most where that is steep. No physics
makes the piston move more sharply than the rod, so it is put back where a base model asks for much of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.noise.input_noise import clear_band
from mrctl.discover.noise.motion_noise import Spectrum
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record

Array = NDArray[np.float64]

TRIED_S = {2: 3e-4, 4: 1e-3}  # differences and means take (w t)^2 off, Butterworth's to and fro (w t)^4
SHARE = 0.1  # of what a base leaves, that putting it back must promise to take, and take
MOST = 2.0  # times a motion is made what it was
ZOOMS = (2.0**0.5, 2.0**0.25)  # factors between the times tried


@dataclass(frozen=True, slots=True)
class Smoothing:
    """What was smoothed, by 1 + (w t)^order: a time in s and an even order."""

    order: int
    time_s: float

    def frequency_hz(self, share: float) -> float:
        """Where it takes a small share of a motion off."""
        return float(share ** (1.0 / self.order) / (2.0 * np.pi * self.time_s))

    def undone(self, record: Record, spectrum: Spectrum) -> Record:
        """The record, its motion as sharp as it was, where it stands out of its noise; without phase."""
        f, band = clear_band(record, spectrum)
        more = band * np.minimum((2.0 * np.pi * f * self.time_s) ** self.order, MOST - 1.0)

        def sharp(x: Array) -> Array:
            # Beyond its ends a motion goes on, turned about them: there is no corner that is none.
            long = np.concatenate([2.0 * x[0] - x[:0:-1], x, 2.0 * x[-1] - x[-2::-1]])
            share = np.interp(np.fft.rfftfreq(long.size, 1.0 / record.rate_hz), f, more)
            put_back = np.fft.irfft(np.fft.rfft(long) * share, long.size)
            return x + put_back[x.size - 1 : 2 * x.size - 1]

        motion = sharp(record.velocity_m_s), sharp(record.acceleration_m_s2)
        return replace(record, velocity_m_s=motion[0], acceleration_m_s2=motion[1])


def smoothing_of(
    fit: JointFit, spectrum: Spectrum | None, refitted: Callable[[list[Record]], JointFit]
) -> Smoothing | None:
    """How the velocities of a base fit's records were smoothed; None where it asks for little of it back.

    spectrum: `noise_spectrum` of the records as they were measured. refitted: the fit, to other versions.
    """
    if spectrum is None:
        return None
    tangent = Tangent.of(fit)
    begun = [one for order in TRIED_S if (one := _promised(tangent, order, spectrum)) is not None]

    def cost(one: Smoothing) -> float:
        return refitted([one.undone(r, spectrum) for r in fit.model.records]).total

    found = [_nearest(one, cost) for one in begun]
    least, best = min(found, key=lambda pair: pair[0], default=(fit.total, None))
    return best if least < (1.0 - SHARE) * fit.total else None


def _promised(tangent: Tangent, order: int, spectrum: Spectrum) -> Smoothing | None:
    """The smoothing that one linear step from none would undo; None where that promises little."""
    model, theta = tangent.fit.model, tangent.fit.theta
    small = Smoothing(order, TRIED_S[order])
    sharp = model.on([small.undone(r, spectrum) for r in model.records])
    force = tangent.stacked(sharp.predict(theta)) - tangent.stacked(model.predict(theta))
    beyond = float(tangent.products_beyond(force[None])[0, 0])
    along = float(force @ tangent.residual)
    whole = float(tangent.residual @ tangent.residual)
    if beyond <= 0.0 or along <= 0.0 or along * along < SHARE * whole * beyond:
        return None
    return replace(small, time_s=small.time_s * (along / beyond) ** (1.0 / order))


def _nearest(begin: Smoothing, cost: Callable[[Smoothing], float]) -> tuple[float, Smoothing]:
    """The cheapest smoothing to undo about one to begin with, and what it costs."""
    best = cost(begin), begin
    for factor in ZOOMS:
        middle = best[1]
        tried = [replace(middle, time_s=middle.time_s * by) for by in (1.0 / factor, factor)]
        best = min(best, *((cost(one), one) for one in tried), key=lambda pair: pair[0])
    return best
