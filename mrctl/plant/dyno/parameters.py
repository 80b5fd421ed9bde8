"""What the virtual dyno's damper is made of."""

from __future__ import annotations

from typing import NamedTuple


class DynoDamper(NamedTuple):
    """Parameters of the damper; its equations stand in `damper`."""

    nominal_c: float = 28.8889  # 84 degF: where the forces below hold
    # Y(j) = saturating * (1 - exp(-q / knee)) + linear * q,  q = j^2 / (j + onset): iron, then leakage
    yield_saturating_n: float = 760.0
    yield_knee_a: float = 0.70
    yield_linear_n_a: float = 330.0
    yield_onset_a: float = 0.05
    # a(j, T) = exp(-rate dT) - field_rate j dT |dT|: fluid, and iron that carries less when warm
    yield_rate_1_k: float = 7.0e-4
    yield_field_1_ak2: float = 5.0e-6
    yield_velocity_m_s: float = 0.035
    yield_velocity_m_s_a: float = 0.002
    # R r(T) tanh(w / vr(T)), vr = velocity (1 - thinned (1 - thick)): carrier fluid in the gap, and remanence
    residual_n: float = 218.0
    residual_rate_1_k: float = 7.0e-3
    residual_velocity_m_s: float = 0.054
    residual_thinned: float = 0.14
    # C c(T) w, with a thickener that melts: c = (1 - share) exp(-rate dT) + share thick,
    # thick = 2 / (1 + exp(dT / melt))
    viscous_n_s_m: float = 230.0
    viscous_rate_1_k: float = 6.0e-3
    thickener_share: float = 0.3
    thickener_melt_k: float = 12.0
    # tau = relaxation + relaxation_off o, r = memory + memory_off o, o = exp(-j / loop_current)
    stiffness_n_m: float = 1.0e7
    relaxation_s: float = 0.0012
    relaxation_off_s: float = 0.0025
    memory: float = 0.04
    memory_off: float = 0.09
    memory_s: float = 0.05
    loop_current_a: float = 0.5
    # seals; gas, its force at mid stroke taken as zero; settling. The gas has kappa p A^2 / V of a monotube:
    # 1.4 * 2.5 MPa * (2 cm^2)^2 / 64 cm^3
    seal_n: float = 8.0
    seal_velocity_m_s: float = 0.004
    gas_stiffness_n_m: float = 2200.0
    gas_curvature_1_m: float = 2.0
    settled: float = 0.93
    stirring_length_m: float = 0.04
    # coil
    coil_rise_s: float = 0.009
    coil_fall_s: float = 0.006
    coil_resistance_ohm: float = 1.2
    # heat
    fluid_heat_j_k: float = 700.0
    case_heat_j_k: float = 1500.0
    fluid_to_case_w_k: float = 60.0
    case_to_air_w_k: float = 6.0


MAGNERIDE_LIKE = DynoDamper()
