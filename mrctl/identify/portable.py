"""The filter of a fit as every loop rate can carry it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mrctl.identify import hysteresis
from mrctl.identify.inverse_filter import carries
from mrctl.model.filters import BAND_HZ, Filter, FilterError

Array = NDArray[np.float64]

TAMED_HZ = (150.0, 100.0, 70.0, 50.0)  # fastest pole, lowered until every loop rate can carry the filter
TAMED_BAND_HZ = 40.0
SLOWEST_HZ = 0.5  # of a filter of one pole, the last resort
NEEDLE = 0.05  # of the response, from where on what fewer poles miss counts less
LAGS_HZ = (8.0, 40.0)  # where filters of fewer poles begin


def portable(theta: Array, rate_hz: float) -> Filter:
    """The filter at a rate, tamed as little as needed for every loop rate to carry it.

    First its poles are made slower; where that does not do (a fit has gone after a drift with a pole of
    minutes, say), it gets fewer of them. Raises FilterError where not even one pole does.
    """
    exact = hysteresis.as_filter(theta, rate_hz)
    if carries(exact):
        return exact
    f = np.concatenate([np.linspace(0.2, BAND_HZ, 60), np.linspace(BAND_HZ + 1.0, TAMED_BAND_HZ, 20)])
    wanted = hysteresis.response(theta, f)
    for order in range(theta.size // 2, 0, -1):
        whole = 2 * order == theta.size
        start, loss = (hysteresis.by_middle(theta), "linear") if whole else (_lags(order), "soft_l1")
        for fastest_hz in TAMED_HZ:
            tamed = hysteresis.as_filter(_nearest(start, fastest_hz, f, wanted, loss), rate_hz)
            if carries(tamed):
                return tamed
    raise FilterError("the hysteresis filter found cannot be carried to the loop's rates")


def _nearest(start: Array, fastest_hz: float, f: Array, wanted: NDArray[np.complex128], loss: str) -> Array:
    """The parameters of the filter nearest to a response at frequencies (n, Hz), of no pole faster than that.

    start: in the form of `hysteresis.by_middle`. loss: scipy's; with fewer poles a needle of the response,
    which they cannot have, must not bend the rest.
    """
    order = start.size // 2
    weight = np.where(f <= BAND_HZ, 1.0, 0.2)

    def errors(x: Array) -> Array:  # of a pair its linear coefficient: bounded, neither pole is fast
        at = hysteresis.by_middle(x)
        miss = weight * (hysteresis.response(at, f) - wanted)
        # A numerator that grows beyond the band is what no lower rate can follow.
        return np.concatenate(
            [miss.real, miss.imag, 1e-3 * np.abs(hysteresis.response(at, np.array([125.0, 250.0])))]
        )

    top = _log(fastest_hz)
    upper = np.concatenate([[top, top + np.log(2.0), 2 * top][-order:], np.full(order, np.inf)])
    slowest = -12.0
    if order == 1:
        upper, slowest = np.array([top, np.inf]), _log(SLOWEST_HZ)
    lower = np.concatenate([np.full(order, slowest), np.full(order, -np.inf)])
    begin = np.maximum(np.minimum(start, upper - 1e-3), lower + 1e-3)
    bounds = lower, upper
    x = least_squares(errors, begin, bounds=bounds, x_scale="jac", loss=loss, f_scale=NEEDLE).x
    return hysteresis.by_middle(np.asarray(x, dtype=np.float64))


def _lags(order: int) -> Array:
    """Little more than one or two lags, in the form of `hysteresis.by_middle`."""
    slow, fast = (np.exp(_log(hz)) for hz in LAGS_HZ)
    poles = [_log(LAGS_HZ[0])] if order == 1 else [np.log(slow + fast), np.log(slow * fast)]
    return np.array([*poles, *np.full(order, 0.1)])


def _log(hz: float) -> float:
    """The parameter of a pole at a frequency in Hz."""
    return float(np.log(2.0 * np.pi * hz / hysteresis.UNIT_RAD_S))
