"""The damper on the virtual dyno: physics of its own, outside the model that is identified from it.

    F = k e + S tanh(v / v_s) + G x (1 + c_g x)                         at the rod: column, seals, gas
    de/dt = v - w,    (1 - r) B(w) + r s + k tau w = k (e + tau v)      elastic, relaxing fluid column
    ds/dt = (B(w) - s) / tau_s                                          structure that forms and breaks
    B(w) = m [ Y(j) a(j, Tf) tanh(w / vk(j)) + R r_R(Tf) tanh(w / vr(Tf)) + C c(Tf) w ]
    dm/dt = (1 - m) |v| / L                                             particles that settled are stirred up
    dj/dt = (i - j) / tau_c                                             coil and eddy currents
    Cf dTf/dt = F v - Gf (Tf - Tc),   Cc dTc/dt = Gf (Tf - Tc) + R_c i^2 - Ga (Tc - Ta)

x, v: extension and its rate; w: the part of v that shears the fluid; i: driver current; j: field current;
Tf, Tc, Ta: fluid, case and air. Three things in B keep it from being a product f(i) g(v) h(i, T): the
yield force Y grows with the current and has a knee vk that widens with it; the residual force R and the
viscous force C w, which are all there is without current, have other shapes over velocity and lose force
to heat at other rates. The loop of force over velocity comes from k, tau and r, which depend on the current,
and from the gas, which does not scale with it: it changes with current, amplitude and frequency as no single
linear filter's does.

The numbers are chosen so that the published method, on the protocol of the published forty runs, comes to
the published figures: peak force falling by 100, 150, 200, 250 N from 84 to 181 degF at 0, 1, 2, 3 A, errors
of the separable and of the whole model, on and off (`mrctl verify` shows each).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.plant.dyno.kernel import fluid_force, fluid_terms, simulate_states
from mrctl.plant.dyno.parameters import DynoDamper

Array = NDArray[np.float64]

SUBSTEPS = 4  # integration steps per sample at 2 kHz: finer ones change the force by less than 0.1 N


@dataclass(frozen=True, slots=True)
class DynoStates:
    """What happened in the damper, sample by sample (n each)."""

    force_n: Array
    field_current_a: Array
    fluid_temperature_c: Array
    case_temperature_c: Array


def simulate(
    damper: DynoDamper,
    rate_hz: float,
    displacement_m: Array,
    velocity_m_s: Array,
    current_a: Array,
    temperature_c: float,
    air_c: float,
) -> DynoStates:
    """The damper through a motion and a current (n each), starting at rest, its parts at temperature_c.

    The current is held from sample to sample and flows already when the run begins; motion is taken
    linear between samples.
    """
    substeps = max(1, round(SUBSTEPS * 2000.0 / rate_hz))
    states = simulate_states(
        damper,
        1.0 / rate_hz,
        substeps,
        np.ascontiguousarray(displacement_m, dtype=np.float64),
        np.ascontiguousarray(velocity_m_s, dtype=np.float64),
        np.ascontiguousarray(current_a, dtype=np.float64),
        float(temperature_c),
        float(air_c),
    )
    return DynoStates(*states)


def backbone_n(damper: DynoDamper, velocity_m_s: Array, current_a: float, temperature_c: float) -> Array:
    """The force in N of a steady velocity (n), fluid at temperature_c, current settled, gas left out."""
    terms = fluid_terms(damper, float(current_a), float(temperature_c), 1.0)
    seal = damper.seal_n * np.tanh(velocity_m_s / damper.seal_velocity_m_s)
    return np.array([fluid_force(float(w), terms)[0] for w in velocity_m_s]) + seal
