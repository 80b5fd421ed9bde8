"""From a fit to a damper that can run: whole tables from 0 A, valid ranges, filters for every loop rate."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.inverse_filter import design_inverse_filter
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.knots import filled
from mrctl.identify.layout import Layout, Tables
from mrctl.identify.portable import portable
from mrctl.model.damper import Damper, EffectSetting, Span
from mrctl.model.effects.base import Vector
from mrctl.model.static import StaticTables, static_tables, transition_increases

Array = NDArray[np.float64]

NEAR_ZERO_A = 0.05  # a lowest knot below this is the force without current
LEAST_OFF_SHARE = 0.2  # f at 0 A is taken as no less than this share of f at the lowest current measured
UNKNOWN_RISE = 1e-3  # relative rise of f with the current where only one current was measured
FAR_APART_C = 15.0  # temperatures that were held further apart have nothing measured between them
NARROW_C = 1.0  # half the width of a temperature range where there is but one
REFINE_CUTOFF_HZ = 60.0
SLEW_A_S = 100.0


def damper_of(fit: JointFit) -> Damper:
    """The damper of a fit, with its effects; normalised to max |g| = 1, f from 0 A, filters at one rate.

    What was not measured is filled in as `findings` says, which also tells where the filter is not quite the
    fit's, as the loop's rates cannot carry that one. Raises FilterError where they carry nothing near it.
    """
    layout, t = fit.model.layout, fit.tables
    rate = max(float(max(r.rate_hz for r in fit.model.records)), 1000.0)
    rate = rate if rate <= 4000.0 else 2000.0
    forward = portable(t.filter, rate)
    static = complete_tables(layout, t)
    velocity, temperature = layout.velocity_m_s, static.temperature_c
    low_a, high_a = measured_currents(fit)
    return Damper(
        static=static,
        forward_filter=forward,
        inverse_filter=design_inverse_filter(forward),
        refine_cutoff_hz=REFINE_CUTOFF_HZ,
        current_max_a=static.current_a[-1],
        current_slew_a_s=SLEW_A_S,
        velocity_valid_m_s=Span(float(velocity[0]), float(velocity[-1])),
        temperature_valid_c=Span(temperature[0], temperature[-1]),
        current_valid_a=Span(low_a, high_a)
        if low_a < high_a
        else Span(static.current_a[0], static.current_a[-1]),
        effects=tuple(
            EffectSetting(effect.name, effect.mapping(values))
            for effect, values in zip(fit.model.effects.chosen, at_full_shape(fit), strict=True)
        ),
    )


def measured_currents(fit: JointFit) -> tuple[float, float]:
    """The lowest and the largest current measured, in A."""
    i = fit.model.layout.current_a
    return (0.0 if i[0] < NEAR_ZERO_A else float(i[0])), float(i[-1])


def at_full_shape(fit: JointFit) -> list[Vector]:
    """The effects' parameters (SI) beside tables with max |g| = 1."""
    scale = full_shape(fit.tables)
    return [
        values if effect.rescaled is None else effect.within(effect.rescaled(values, scale))
        for effect, values in zip(fit.model.effects.chosen, fit.effect_values.values(), strict=True)
    ]


def full_shape(t: Tables) -> float:
    """The largest |g|."""
    return float(np.max(np.abs(t.g)))


def normalised(t: Tables) -> Tables:
    """The same model with max |g| = 1."""
    scale = full_shape(t)
    return Tables(t.f * scale, t.g / scale, t.h_on, t.h_off, t.off_below_a, t.on_above_a, t.filter)


def complete_tables(layout: Layout, t: Tables) -> StaticTables:
    """Tables that a calibration takes: from 0 A, at least two rows each, rising through the transition."""
    t = normalised(t)
    i, f = layout.current_a.copy(), t.f
    low, high = t.off_below_a, t.on_above_a
    if i[0] < NEAR_ZERO_A:
        i[0] = 0.0
    elif i.size > 1:
        at_zero = f[0] - i[0] * (f[1] - f[0]) / (i[1] - i[0])
        i, f = np.append(0.0, i), np.append(max(at_zero, LEAST_OFF_SHARE * f[0]), f)
    else:
        i, f = np.append(0.0, i), np.append(LEAST_OFF_SHARE * f[0], f)
    if i.size == 1:
        i, f = np.array([0.0, 1.0]), f[0] * np.array([1.0, 1.0 + UNKNOWN_RISE])
    temperature, h_on, h_off = layout.temperature_c, t.h_on, t.h_off
    if temperature.size == 1:
        temperature = temperature[0] + NARROW_C * np.array([-1.0, 1.0])
        h_on, h_off = np.ones(2), np.ones(2)
    else:
        # Where nothing was measured a fluid thins by so much a degree: a chord would lie above that.
        between = filled(temperature, FAR_APART_C)
        h_on, h_off = (np.exp(np.interp(between, temperature, np.log(h))) for h in (h_on, h_off))
        temperature = between
    low = max(0.0, min(low, high))
    for share in (1.0, 0.75, 0.5, 0.25, 0.0):
        # Where f rises less through the transition than h falls, h off gives way.
        off = h_on * (h_off / h_on) ** share
        tables = static_tables(
            i.tolist(),
            f.tolist(),
            layout.velocity_m_s.tolist(),
            np.where(layout.velocity_m_s == 0.0, 0.0, np.clip(t.g, -1.0, 1.0)).tolist(),
            temperature.tolist(),
            off.tolist(),
            h_on.tolist(),
            low,
            max(low, high),
        )
        if transition_increases(tables):
            break
    return tables


def table_std(fit: JointFit, covariance: Array) -> dict[str, tuple[float, ...]]:
    """Standard deviations of the calibration's table values, by its keys."""
    layout = fit.model.layout
    size = layout.size
    names = ("f", "g", "h_off", "h_on")

    def values(theta: Array) -> Array:
        s = complete_tables(layout, layout.unpack(theta))
        return np.concatenate([s.force_n, s.shape, s.h_off, s.h_on])

    theta = fit.theta[:size]
    here = values(theta)
    slopes = np.zeros((here.size, size))
    for k in range(layout.parts["filter"].start):
        moved = theta.copy()
        moved[k] += 1e-5
        slopes[:, k] = (values(moved) - here) / 1e-5
    std = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance[:size, :size], slopes), 0.0))
    s = complete_tables(layout, fit.tables)
    ends = np.cumsum([0, len(s.force_n), len(s.shape), len(s.h_off), len(s.h_on)])
    parts = dict(zip(names, (std[a:b] for a, b in pairwise(ends)), strict=True))
    if layout.current_a[0] >= NEAR_ZERO_A:
        parts["f"][0] = max(float(parts["f"][0]), 0.5 * s.force_n[0])
    keys = {"f": "f.force", "g": "g.shape", "h_off": "h.off", "h_on": "h.on"}
    result = {keys[name]: tuple(float(x) for x in part) for name, part in parts.items()}
    for name, deviations in fit.effect_std(covariance).items():
        effect = next(e for e in fit.model.effects.chosen if e.name == name)
        for p, deviation in zip(effect.parameters, deviations, strict=True):
            result[f"effects.{name}.{p.name}"] = (deviation,)
    return result
