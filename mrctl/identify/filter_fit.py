"""The hysteresis filter alone, between given static forces and measured ones: where a joint fit begins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mrctl.identify import filtering, hysteresis

Array = NDArray[np.float64]

REAL_HZ = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)
PAIR_HZ = (4.0, 10.0, 25.0, 60.0)
PAIR_DAMPING = (0.3, 0.7)
REFINED = 3  # best of the grid that are refined
ITERATIONS = 12


def _sections() -> tuple[list[tuple[str, Array]], list[int]]:
    """Denominator factors to choose from, and how many numerator terms each brings."""
    unit = hysteresis.UNIT_RAD_S / (2 * np.pi)
    factors = [("real", np.array([1.0, hz / unit])) for hz in REAL_HZ]
    factors += [
        ("pair", np.array([1.0, 2 * z * hz / unit, (hz / unit) ** 2])) for hz in PAIR_HZ for z in PAIR_DAMPING
    ]
    return factors, [f.size - 1 for _, f in factors]


def search_filter(
    order: int, rates_hz: Sequence[float], static_n: Sequence[Array], force_n: Sequence[Array], weights: Array
) -> Array:
    """The best filter of an order: a grid of poles with their linear numerators, the best ones refined.

    Every candidate is a sum of first- and second-order sections, so each section is run once, and a
    candidate is one small least-squares problem on their common Gram matrix.
    """
    factors, counts = _sections()
    gram, right = _gram(factors, rates_hz, static_n, force_n, weights)
    at = np.cumsum([1, *counts])
    scored = []
    for chosen in _choices(factors, order):
        columns = np.concatenate([[0], *[np.arange(at[k], at[k] + counts[k]) for k in chosen]])
        part = gram[np.ix_(columns, columns)]
        part = part + 1e-7 * np.trace(part) / columns.size * np.eye(columns.size)
        gains = np.linalg.solve(part, right[columns])
        score = float(right[columns] @ gains)
        scored.append((score, _parameters([factors[k][1] for k in chosen], gains)))
    scored.sort(key=lambda pair: -pair[0])
    fits = [fit_filter(theta, rates_hz, static_n, force_n, weights) for _, theta in scored[:REFINED]]
    return min(fits, key=lambda fit: fit[1])[0]


def _choices(factors: list[tuple[str, Array]], order: int) -> list[tuple[int, ...]]:
    reals = [k for k, (kind, _) in enumerate(factors) if kind == "real"]
    pairs = [k for k, (kind, _) in enumerate(factors) if kind == "pair"]
    found: list[tuple[int, ...]] = list(combinations(reals, order))
    if order >= 2:
        found += [(p, *rest) for p in pairs for rest in combinations(reals, order - 2)]
    return found


def _gram(
    factors: list[tuple[str, Array]],
    rates_hz: Sequence[float],
    static_n: Sequence[Array],
    force_n: Sequence[Array],
    weights: Array,
) -> tuple[Array, Array]:
    """Products of all sections' outputs (less the static force itself) with each other and with the rest.

    Unit DC gain is built in: every section stands as (section - 1) u, fitted to F - u; the first
    column, the derivative-like remainder of the direct path, is zero and only keeps the count.
    """
    size = 1 + sum(f.size - 1 for _, f in factors)
    gram, right = np.zeros((size, size)), np.zeros(size)
    for rate, u, force, w in zip(rates_hz, static_n, force_n, weights, strict=True):
        rows = [np.zeros_like(u)]
        for _, den in factors:
            order = den.size - 1
            low = _run(den, np.array([den[-1]]), rate, u)
            rows.append(low - u)
            if order == 2:
                rows.append(_run(den, np.array([den[1], 0.0]), rate, u))
        block = np.stack(rows)
        gram += w * (block @ block.T)
        right += w * (block @ (force - u))
    return gram, right


def _run(den: Array, num: Array, rate_hz: float, u: Array) -> Array:
    """U through num/den (s in UNIT_RAD_S)."""
    order = den.size - 1
    num = np.concatenate([np.zeros(order + 1 - num.size), num])
    m = (num / den)[:-1][::-1]
    with_constant = num[-1] != 0.0
    if with_constant:
        theta = np.concatenate([_logs(den), m])
        return filtering.filtered(*hysteresis.discretise(theta, rate_hz), u)
    # No constant term: the low-pass with it, less the low-pass without.
    both = np.concatenate([_logs(den), m])
    low = np.concatenate([_logs(den), np.zeros(order)])
    full, plain = (filtering.filtered(*hysteresis.discretise(x, rate_hz), u) for x in (both, low))
    return np.asarray(full - plain, dtype=np.float64)


def _parameters(dens: list[Array], gains: Array) -> Array:
    """The filter's parameters (log d, m) for chosen sections with their gains."""
    total = np.ones(1)
    for den in dens:
        total = np.convolve(total, den)
    num = total.copy()
    at = 1
    for k, den in enumerate(dens):
        others = np.ones(1)
        for n, other in enumerate(dens):
            if n != k:
                others = np.convolve(others, other)
        own = gains[at] * (np.array([den[-1]]) if den.size == 2 else np.array([0.0, 0.0, den[-1]]))
        own = np.concatenate([np.zeros(den.size - own.size), own]) - gains[at] * den
        at += 1
        if den.size == 3:
            own = own + gains[at] * np.array([0.0, den[1], 0.0])
            at += 1
        num = num + np.convolve(own, others)
    order = total.size - 1
    logs = _logs(total) if order < 3 else _cubic_logs(dens)
    return np.concatenate([logs, (num / total)[:-1][::-1]])


def _logs(den: Array) -> Array:
    """The logarithms that name a polynomial of the first or second order."""
    return np.asarray(np.log(den[1:] if den.size == 2 else [den[2] / den[1], den[2]]), dtype=np.float64)


def _cubic_logs(dens: list[Array]) -> Array:
    """Log p, log q, log c0 of (s + p)(s² + c0 / q s + c0)."""
    if len(dens) == 3:
        dens = [dens[0], np.convolve(dens[1], dens[2])]
    real, pair = sorted(dens, key=len)
    return np.concatenate([_logs(real), _logs(pair)])


def fit_filter(
    start: Array,
    rates_hz: Sequence[float],
    static_n: Sequence[Array],
    force_n: Sequence[Array],
    weights: Array,
) -> tuple[Array, float]:
    """The filter near `start` that takes static to measured force best, and its weighted square sum."""
    order = start.size // 2
    theta, damping = _bounded(hysteresis.paired(start), order), 1e-3

    def miss(at: Array) -> tuple[list[Array], float]:
        ys = [
            filtering.filtered(*hysteresis.discretise(at, rate), u)
            for rate, u in zip(rates_hz, static_n, strict=True)
        ]
        total = sum(float(w * np.sum((f - y) ** 2)) for w, f, y in zip(weights, force_n, ys, strict=True))
        return ys, total

    ys, here = miss(theta)
    for _ in range(ITERATIONS):
        matrix, right = np.zeros((theta.size, theta.size)), np.zeros(theta.size)
        for rate, u, y, f, w in zip(rates_hz, static_n, ys, force_n, weights, strict=True):
            rows = filtering.sensitivities(theta, rate, u, y)
            matrix += w * (rows @ rows.T)
            right += w * (rows @ (f - y))
        before = here
        for _ in range(6):
            bent = matrix + np.diag(damping * np.diag(matrix) + 1e-12 * np.trace(matrix))
            trial = _bounded(theta + np.clip(np.linalg.solve(bent, right), -1.5, 1.5), order)
            trial_ys, there = miss(trial)
            if there < here:
                theta, ys, here = trial, trial_ys, there
                damping = max(damping / 10.0, 1e-9)
                break
            damping *= 10.0
        if before - here < 1e-4 * before:
            break
    return theta, here


def _bounded(theta: Array, order: int) -> Array:
    """Poles in reach, no numerator term that turns the phase: a free search ends in all-passes."""
    return np.concatenate(
        [np.clip(theta[:order], 2 * np.log(0.02), 2 * np.log(200.0)), np.clip(theta[order:], 0.0, 10.0)]
    )
