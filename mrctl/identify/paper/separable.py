"""Sec. 5.3 to 5.6: from the backbones to g(v), h(i, T) and f(i), with the paper's checks on each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.paper.backbone import Backbones
from mrctl.identify.paper.conditions import Conditions

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Collapse:
    """Figs. 5.7 to 5.11 and 5.19: curves scaled to room temperature, averaged, normalised; g and f.

    ratio (runs): a run's end points over those of its current's reference, the mean of both ends.
    collapsed_n (runs, bins), average_n (C, bins), normalised (C, bins); f_n (C); g (bins), of on states only.
    std_on, std_all (bins): spread of the normalised curves over the on states and over all (Fig. 5.11).
    """

    ratio: Array
    collapsed_n: Array
    average_n: Array
    normalised: Array
    f_n: Array
    g: Array
    std_on: Array
    std_all: Array


@dataclass(frozen=True, slots=True, eq=False)
class Temperature:
    """Figs. 5.12 to 5.18: h of each current, averaged over the on states, and what it leaves over.

    by_current (C, K), NaN where not measured; on, off (K): the tables; std_on (K): Fig. 5.15; of_run (runs).
    shift (C): h of each current's reference run, 1 where that was at the nominal temperature.
    validated_n (runs, bins): each curve over its h; rmse_n, rmse_percent (runs) against the reference curve,
    in percent of the run's largest backbone force (Figs. 5.17, 5.18).
    """

    by_current: Array
    on: Array
    off: Array
    std_on: Array
    of_run: Array
    shift: Array
    validated_n: Array
    rmse_n: Array
    rmse_percent: Array


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Fig. 5.20: each run's curve from f g h (runs, bins), and its RMSE (runs), in N and in percent."""

    force_n: Array
    rmse_n: Array
    rmse_percent: Array


def collapse(backbones: Backbones, at: Conditions) -> Collapse:
    """Scale to room temperature, average per current, normalise; f is the divisor (Sec. 5.3, 5.5)."""
    force = backbones.force_n
    nominal = force[at.reference[at.current]]
    ratio = np.array([end_ratio(curve, other) for curve, other in zip(force, nominal, strict=True)])
    collapsed = force / ratio[:, None]
    average = np.stack([_mean(collapsed[at.runs_at(c)]) for c in range(at.current_a.size)])
    f = np.nanmax(np.abs(average), axis=1)
    normalised = average / f[:, None]
    return Collapse(
        ratio=ratio,
        collapsed_n=collapsed,
        average_n=average,
        normalised=normalised,
        f_n=f,
        g=_mean(normalised[at.on]),
        std_on=_std(normalised[at.on]),
        std_all=_std(normalised),
    )


def end_ratio(curve: Array, nominal: Array) -> float:
    """How much larger a curve is than another: the mean of the ratios at their outermost common bins."""
    both = np.flatnonzero(np.isfinite(curve) & np.isfinite(nominal))
    low, high = both[0], both[-1]
    return 0.5 * float(curve[low] / nominal[low] + curve[high] / nominal[high])


def temperature_correction(backbones: Backbones, at: Conditions, collapsed: Collapse) -> Temperature:
    """h(i, T) from the end points, averaged over the on states; the off state as it is (Sec. 5.4).

    A current that was not measured at the nominal temperature is brought there along its own h.
    """
    by_current = np.full((at.current_a.size, at.temperature_c.size), np.nan)
    for c, k in np.ndindex(by_current.shape):
        runs = np.flatnonzero((at.current == c) & (at.temperature == k))
        if runs.size:
            by_current[c, k] = float(np.mean(collapsed.ratio[runs]))
    at_nominal = np.array([_filled(at, row)[at.nominal] for row in by_current])
    by_current /= at_nominal[:, None]
    on = _filled(at, _mean(by_current[at.on]))
    off = _filled(at, _mean(by_current[at.off])) if at.off.any() else on
    h = (off + at.on_share()[:, None] * (on - off))[at.current, at.temperature]
    validated = backbones.force_n / h[:, None]
    shift = 1.0 / at_nominal
    reference = backbones.force_n[at.reference[at.current]] / shift[at.current, None]
    error = rms(validated - reference)
    return Temperature(
        by_current=by_current,
        on=on,
        off=off,
        std_on=_std(by_current[at.on]),
        of_run=h,
        shift=shift,
        validated_n=validated,
        rmse_n=error,
        rmse_percent=100.0 * error / backbones.peak_n(),
    )


def estimate(backbones: Backbones, at: Conditions, collapsed: Collapse, h: Temperature) -> Estimate:
    """Put f, g and h together and hold them against the backbones they came from (Sec. 5.6)."""
    f = collapsed.f_n / h.shift
    force = (f[at.current] * h.of_run)[:, None] * collapsed.g
    error = rms(force - backbones.force_n)
    return Estimate(force, error, 100.0 * error / backbones.peak_n())


def rms(error: Array) -> Array:
    """Root mean square along the last axis, without NaN."""
    return np.asarray(np.sqrt(np.nanmean(error**2, axis=-1)), dtype=np.float64)


def _filled(at: Conditions, row: Array) -> Array:
    """One current's h at all temperatures: gaps filled linearly, ends held."""
    seen = np.isfinite(row)
    return np.interp(at.temperature_c, at.temperature_c[seen], row[seen])


def _mean(curves: Array) -> Array:
    """The mean over curves, over those that have the bin; NaN where none has."""
    seen = np.isfinite(curves)
    count = np.where(seen.any(axis=0), seen.sum(axis=0), np.nan)
    return np.asarray(np.where(seen, curves, 0.0).sum(axis=0) / count, dtype=np.float64)


def _std(curves: Array) -> Array:
    """The standard deviation over curves, with n - 1; 0 for a single one."""
    seen = np.isfinite(curves)
    away = np.where(seen, curves - _mean(curves), 0.0)
    return np.asarray(np.sqrt((away**2).sum(axis=0) / np.maximum(seen.sum(axis=0) - 1, 1)), dtype=np.float64)
