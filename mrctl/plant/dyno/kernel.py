"""The virtual dyno's damper, compiled: Runge-Kutta over its states, Newton for the sheared velocity."""
# numba's decorators are untyped.
# mypy: disable-error-code="untyped-decorator"

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrctl.plant.dyno.parameters import DynoDamper

Array = NDArray[np.float64]
Terms = tuple[float, float, float, float, float]

NEWTON_STEPS = 60
NEWTON_TOLERANCE_M_S = 1e-11


@njit(cache=True)
def fluid_terms(p: DynoDamper, field_a: float, fluid_c: float, stirred: float) -> Terms:
    """Yield force, its knee, residual force, its knee, viscosity at a field and a temperature."""
    dt = fluid_c - p.nominal_c
    q = field_a * field_a / (field_a + p.yield_onset_a) if field_a > 0.0 else 0.0
    full = p.yield_saturating_n * (1.0 - math.exp(-q / p.yield_knee_a)) + p.yield_linear_n_a * q
    warm = max(math.exp(-p.yield_rate_1_k * dt) - p.yield_field_1_ak2 * field_a * dt * abs(dt), 0.05)
    knee = p.yield_velocity_m_s + p.yield_velocity_m_s_a * field_a
    thick = 2.0 / (1.0 + math.exp(min(dt / p.thickener_melt_k, 700.0)))
    residual = p.residual_n * math.exp(-p.residual_rate_1_k * dt)
    residual_knee = p.residual_velocity_m_s * (1.0 - p.residual_thinned * (1.0 - thick))
    thin = (1.0 - p.thickener_share) * math.exp(-p.viscous_rate_1_k * dt)
    viscous = p.viscous_n_s_m * (thin + p.thickener_share * thick)
    return (stirred * full * warm, knee, stirred * residual, residual_knee, stirred * viscous)


@njit(cache=True)
def fluid_force(w: float, terms: Terms) -> tuple[float, float]:
    """B(w) in N and its slope in N s/m."""
    full, knee, residual, residual_knee, viscous = terms
    a, b = math.tanh(w / knee), math.tanh(w / residual_knee)
    force = full * a + residual * b + viscous * w
    slope = full * (1.0 - a * a) / knee + residual * (1.0 - b * b) / residual_knee + viscous
    return force, slope


@njit(cache=True)
def sheared_velocity(pull: float, damping: float, guess: float, terms: Terms) -> float:
    """The w with B(w) + damping w = pull: Newton, kept within a bracket that closes."""
    limit = abs(pull) / damping
    low, high = -limit, limit
    w = min(max(guess, low), high)
    for _ in range(NEWTON_STEPS):
        force, slope = fluid_force(w, terms)
        misfit = force + damping * w - pull
        if misfit > 0.0:
            high = w
        else:
            low = w
        step = misfit / (slope + damping)
        after = w - step
        if not low <= after <= high:
            after = 0.5 * (low + high)
        if abs(after - w) < NEWTON_TOLERANCE_M_S:
            return after
        w = after
    return w


@njit(cache=True)
def simulate_states(
    p: DynoDamper,
    dt_s: float,
    substeps: int,
    x: Array,
    v: Array,
    current: Array,
    start_c: float,
    air_c: float,
) -> tuple[Array, Array, Array, Array]:
    """Force, field current, fluid and case temperature at each sample; see `damper` for the equations."""
    n = x.size
    force_n, field_a, fluid_c, case_c = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    k = p.stiffness_n_m
    h = dt_s / substeps
    e, j, w, remembered = 0.0, current[0], 0.0, 0.0
    stirred = p.settled
    fluid, case = start_c, start_c
    for s in range(n):
        if s > 0:
            i = current[s - 1]
            for sub in range(substeps):
                v0 = v[s - 1] + (v[s] - v[s - 1]) * sub / substeps
                v1 = v[s - 1] + (v[s] - v[s - 1]) * (sub + 1) / substeps
                vm = 0.5 * (v0 + v1)
                share = 1.0 - math.exp(-h / (p.coil_rise_s if i > j else p.coil_fall_s))
                j += share * (i - j)
                stirred += (1.0 - stirred) * (1.0 - math.exp(-abs(vm) * h / p.stirring_length_m))
                off = math.exp(-j / p.loop_current_a)
                c = k * (p.relaxation_s + p.relaxation_off_s * off)
                memory = p.memory + p.memory_off * off
                kept = memory * remembered
                terms = fluid_terms(p, j, fluid, stirred * (1.0 - memory))
                # Classic Runge-Kutta for e; every stage finds its own w.
                w0 = sheared_velocity(k * e + c * v0 - kept, c, w, terms)
                k1 = v0 - w0
                w1 = sheared_velocity(k * (e + 0.5 * h * k1) + c * vm - kept, c, w0, terms)
                k2 = vm - w1
                w2 = sheared_velocity(k * (e + 0.5 * h * k2) + c * vm - kept, c, w1, terms)
                k3 = vm - w2
                w3 = sheared_velocity(k * (e + h * k3) + c * v1 - kept, c, w2, terms)
                k4 = v1 - w3
                e += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
                w = w3
                fresh = fluid_force(w, terms)[0] / (1.0 - memory)
                remembered += (1.0 - math.exp(-h / p.memory_s)) * (fresh - remembered)
                power = k * e * v1
                to_case = p.fluid_to_case_w_k * (fluid - case)
                fluid += h * (power - to_case) / p.fluid_heat_j_k
                to_air = p.case_to_air_w_k * (case - air_c)
                case += h * (to_case + p.coil_resistance_ohm * i * i - to_air) / p.case_heat_j_k
        gas = p.gas_stiffness_n_m * x[s] * (1.0 + p.gas_curvature_1_m * x[s])
        force_n[s] = k * e + p.seal_n * math.tanh(v[s] / p.seal_velocity_m_s) + gas
        field_a[s], fluid_c[s], case_c[s] = j, fluid, case
    return force_n, field_a, fluid_c, case_c
