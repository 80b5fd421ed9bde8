"""The inverse hysteresis filter by automatic loop shaping, in place of tuning by hand (paper, Sec. 8.1).

What is asked of the cascade of forward and inverse filter:

    0 to 20 Hz          gain 1 and no phase: the band in which the damper works
    20 to 100 Hz        as near to that as the rest allows, less far where the forward filter is very soft
    near Nyquist        it rolls off, so that noise in the wish is not amplified

The inverse filter is third order, proper, stable by construction and has unit DC gain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from mrctl.identify import hysteresis
from mrctl.model.filters import BAND_HZ, ORDER, Filter, FilterError

Array = NDArray[np.float64]

BAND_ERROR = 0.002  # a cascade error of this size in the band counts as much as ...
FOLLOW_ERROR = 0.1  # ... this one above it, ...
ROLL_OFF_ERROR = 0.5  # ... this gain left near Nyquist.
LEAST_DAMPING, MOST_DAMPING = 0.5, 10.0  # of the pole pair: what rings amplifies the wish's noise without end
SLOWEST_HZ, STARTS_HZ = 0.2, (60.0, 150.0, 400.0)
LOOP_RATES_HZ = (500.0, 1000.0, 2000.0)
# Fastest pole, end of the band that is followed (Hz), and the gain of the inverse filter that counts as an
# error: less is asked, from the first to the last step by step, until every loop rate can carry the filter
# and it does what it is for. A forward filter that is late cannot be followed far, and asked to, an inverse
# gets worse where it could. With a larger first gain it tracks a wish without noise better still, one with
# 0.3 % of noise no better.
STEPS = 12
LADDER = np.geomspace((400.0, 100.0, 10.0), (70.0, 30.0, 1.0), STEPS)
FOLLOWED_HZ = 100.0
ENOUGH = 0.2  # of the errors that are as asked: no other is looked for
FASTEST_SHARE = 0.4  # of the sample rate: no pole is faster


def design_inverse_filter(forward: Filter) -> Filter:
    """The inverse of a stable forward filter, at its sample rate: proper, stable, third order, unit DC gain.

    The cascade is flat to 20 Hz and rolls off towards Nyquist; how flat it can be depends on the forward
    filter's delay and zeros, which `cascade_error` of the calibration tells. Raises FilterError for an
    unstable forward filter.
    """
    if not forward.is_stable():
        raise FilterError("an unstable filter has no inverse to design")
    found: list[tuple[float, Filter]] = []
    for fastest_hz, follow_hz, largest_gain in LADDER:
        shaping = Shaping(forward, follow_hz, largest_gain)
        inverse = _shaped(forward, shaping, min(fastest_hz, FASTEST_SHARE * forward.sample_rate_hz))
        if carries(inverse):
            found.append((_unlike(forward, inverse), inverse))
            if found[-1][0] < ENOUGH:
                break
    if not found:
        # Nothing that inverts can be carried: the loop stays as it is, and `cascade_error` tells the cost.
        return Filter.of(forward.sample_rate_hz, (1.0,), (1.0,))
    return min(found, key=lambda one: one[0])[1]


def _unlike(forward: Filter, inverse: Filter) -> float:
    """How far a cascade is from undoing: mean squares of its errors in the band and above, 1 each as asked.

    A wish holds less and less above the band, and so do the errors count.
    """
    band = np.linspace(0.25, BAND_HZ, 60)
    above = np.geomspace(BAND_HZ, min(FOLLOWED_HZ, 0.25 * forward.sample_rate_hz), 40)
    within, beyond = (np.abs(forward.response(f) * inverse.response(f) - 1.0) for f in (band, above))
    beyond = beyond * (BAND_HZ / above) ** 2
    return float(np.mean((within / BAND_ERROR) ** 2) + np.mean((beyond / FOLLOW_ERROR) ** 2))


def _shaped(forward: Filter, shaping: Shaping, fastest_hz: float) -> Filter:
    """The best inverse filter with no pole beyond a frequency, and none that rings."""
    unit_hz = hysteresis.UNIT_RAD_S / (2.0 * np.pi)
    low, high = np.log(SLOWEST_HZ / unit_hz), np.log(fastest_hz / unit_hz)
    # The pair by its damping (logarithm of 2 zeta) in place of its linear coefficient.
    lower = np.array([low, np.log(2.0 * LEAST_DAMPING), 2 * low, -np.inf, -np.inf, -np.inf])
    upper = np.array([high, np.log(2.0 * MOST_DAMPING), 2 * high, np.inf, np.inf, np.inf])

    def theta(x: Array) -> Array:
        return hysteresis.by_middle(np.concatenate([x[:1], x[1:2] + 0.5 * x[2:3], x[2:]]))

    turned = np.stack([theta(unit) for unit in np.eye(6)], axis=1)  # theta is linear in x

    def fit(start: Array, evaluations: int) -> OptimizeResult:
        return least_squares(
            lambda x: shaping.errors(theta(x)),
            start,
            jac=lambda x: shaping.slopes(theta(x)) @ turned,
            bounds=(lower, upper),
            x_scale="jac",
            max_nfev=evaluations,
        )

    fits = []
    for logs in _pole_starts(forward):
        by_damping = np.array([logs[0], logs[1] - 0.5 * logs[2], logs[2]])
        poles = np.clip(by_damping, lower[:3] + 1e-6, upper[:3] - 1e-6)
        fits.append(fit(np.concatenate([poles, shaping.numerator(theta(poles))]), 12))
    best = fit(min(fits, key=lambda one: float(one.cost)).x, 80)
    return hysteresis.as_filter(theta(np.asarray(best.x, dtype=np.float64)), forward.sample_rate_hz)


def carries(one: Filter) -> bool:
    """Whether the filter can be carried to the loop's rates."""
    try:
        for rate in LOOP_RATES_HZ:
            one.resampled(rate)
    except FilterError:
        return False
    return True


class Shaping:
    """The weighted errors of a cascade over frequency."""

    def __init__(self, forward: Filter, follow_hz: float, largest_gain: float) -> None:
        self._rate = forward.sample_rate_hz
        nyquist = 0.5 * self._rate
        edge = min(follow_hz, 0.5 * nyquist)
        band = np.linspace(0.25, BAND_HZ, 60)
        follow = np.geomspace(BAND_HZ * 1.05, edge, 25) if edge > BAND_HZ * 1.1 else np.empty(0)
        above = np.linspace(edge * 1.1, nyquist, 25)
        self._hz = np.concatenate([band, follow, above])
        self._wanted = (self._hz <= edge).astype(np.float64)
        near_nyquist = np.clip((above - 0.5 * nyquist) / (0.5 * nyquist), 0.0, 1.0)
        self._weight = np.concatenate(
            [
                np.full(band.size, 1.0 / BAND_ERROR) / np.sqrt(band.size),
                np.full(follow.size, 1.0 / FOLLOW_ERROR) / np.sqrt(max(follow.size, 1)),
                near_nyquist / ROLL_OFF_ERROR / np.sqrt(above.size),
            ]
        )
        self._forward = forward.response(self._hz)
        delay = np.exp(-2j * np.pi * self._hz / self._rate)
        self._delays = np.vander(delay, ORDER + 1, increasing=True)
        self._gain_weight = 1.0 / largest_gain / np.sqrt(self._hz.size)

    def errors(self, theta: Array) -> Array:
        """Weighted deviations of the cascade from what is asked, and the inverse filter's own gain."""
        b, a = hysteresis.discretise(theta, self._rate)
        inverse = (self._delays @ b) / (self._delays @ a)
        miss = self._weight * (self._forward * inverse - self._wanted)
        return np.concatenate([miss.real, miss.imag, self._gain_weight * np.abs(inverse)])

    def slopes(self, theta: Array) -> Array:
        """Derivatives of the errors by each parameter (errors × parameters)."""
        b, a = hysteresis.discretise(theta, self._rate)
        db, da = hysteresis.coefficient_slopes(theta, self._rate)
        below = self._delays @ a
        inverse = (self._delays @ b) / below
        change = (self._delays @ db.T - inverse[:, None] * (self._delays @ da.T)) / below[:, None]
        miss = (self._weight * self._forward)[:, None] * change
        louder = np.real(np.conj(inverse)[:, None] * change) / np.maximum(np.abs(inverse), 1e-12)[:, None]
        return np.concatenate([miss.real, miss.imag, self._gain_weight * louder])

    def numerator(self, logs: Array) -> Array:
        """The numerator that suits given poles: linear least squares on the same errors."""
        base = self.errors(np.concatenate([logs, np.zeros(3)]))
        rows = np.stack([self.errors(np.concatenate([logs, unit])) - base for unit in np.eye(3)], axis=1)
        # The gain rows are not linear; they only regularise here.
        return np.asarray(np.linalg.lstsq(rows, -base, rcond=1e-10)[0], dtype=np.float64)


def _pole_starts(forward: Filter) -> list[Array]:
    """Poles to begin with: the forward filter's own zeros, then spread ones."""
    unit_hz = hysteresis.UNIT_RAD_S / (2.0 * np.pi)
    starts = []
    zeros = np.roots(np.trim_zeros(np.asarray(forward.b), "fb"))
    fast = 2.0 * np.pi * STARTS_HZ[-1] / hysteresis.UNIT_RAD_S
    logs = [np.log(z + 0j) * forward.sample_rate_hz / hysteresis.UNIT_RAD_S for z in zeros if abs(z) > 1e-6]
    # A zero that no stable pole can undo is mirrored: the gain is right, the phase as near as may be.
    mirrored = [complex(-max(abs(s.real), 1e-2), s.imag) for s in logs]
    mirrored = sorted((s for s in mirrored if abs(s) < 10 * fast), key=abs)
    pairs = [s for s in mirrored if s.imag > 1e-9]
    reals = [-s.real for s in mirrored if abs(s.imag) <= 1e-9]
    if pairs:
        s = pairs[0]
        starts.append(np.log([reals[0] if reals else fast, -2 * s.real, abs(s) ** 2]))
    elif reals:
        slow, middle, third = sorted([*reals, fast, 2 * fast])[:3]
        starts.append(np.log([third, slow + middle, slow * middle]))
    for hz in STARTS_HZ:
        p = hz / unit_hz
        starts.append(np.log([0.3 * p, 1.4 * p, p * p]))
        starts.append(np.log([p, 2.2 * p, p * p]))
    return [np.asarray(s, dtype=np.float64) for s in starts]
