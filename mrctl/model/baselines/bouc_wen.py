"""Bouc-Wen models: Spencer's modified one (Eq. 9.1 to 9.3), and the plain one as its limit.

    y' = [alpha z + c0 x' + k0 (x - y)] / (c0 + c1)
    z' = -gamma |x' - y'| z |z|^(n-1) - beta (x' - y') |z|^n + A (x' - y')
    F  = alpha z + c0 (x' - y') + k0 (x - y) + k1 (x - x0)        ( = c1 y' + k1 (x - x0) )
    alpha = alpha_a + alpha_b u,  c0 = c0_a + c0_b u,  c1 = c1_a + c1_b u,  u' = -eta (u - V)

With c1 infinite y stays at 0, which is the plain Bouc-Wen model F = alpha z + c0 x' + k1 (x - x0).
Spencer, Dyke, Sain, Carlson, Journal of Engineering Mechanics 123 (1997).
"""

from __future__ import annotations

from typing import NamedTuple


class BoucWen(NamedTuple):
    """Parameters in SI units; V, the drive, is in volts or amperes, whatever commands the damper."""

    c0_a_n_s_m: float
    c0_b_n_s_m: float  # per unit of drive, as all _b
    k0_n_m: float
    c1_a_n_s_m: float
    c1_b_n_s_m: float
    k1_n_m: float
    x0_m: float
    alpha_a_n_m: float
    alpha_b_n_m: float
    gamma: float  # 1/m^n
    beta: float  # 1/m^n
    a: float
    n: float
    eta_1_s: float


def spencer_in_cm(
    c0: tuple[float, float],
    k0: float,
    c1: tuple[float, float],
    k1: float,
    x0: float,
    alpha: tuple[float, float],
    gamma: float,
    beta: float,
    a: float,
    n: float,
    eta: float,
) -> BoucWen:
    """The parameters as they are published, in cm, N, V and s, brought to SI; pairs are (at 0 V, per V)."""
    per_cm, inverse_power = 100.0, 100.0**n
    return BoucWen(
        per_cm * c0[0], per_cm * c0[1], per_cm * k0, per_cm * c1[0], per_cm * c1[1], per_cm * k1, x0 / per_cm,
        per_cm * alpha[0], per_cm * alpha[1], inverse_power * gamma, inverse_power * beta, a, n, eta,
    )  # fmt: skip


SPENCER_1997 = spencer_in_cm(
    c0=(21.0, 3.50), k0=46.9, c1=(283.0, 2.95), k1=5.00, x0=14.3, alpha=(140.0, 695.0), gamma=363.0,
    beta=363.0, a=301.0, n=2.0, eta=190.0,
)  # fmt: skip
LARGEST_V = 2.25  # the prototype saturates there


def rates(p: BoucWen, u: float, y_m: float, z_m: float, x_m: float, v_m_s: float) -> tuple[float, float]:
    """Rates of y and z in m/s at a drive u, stroke x and its rate v."""
    c0 = p.c0_a_n_s_m + p.c0_b_n_s_m * u
    soft = 1.0 / (p.c1_a_n_s_m + p.c1_b_n_s_m * u)
    pull = (p.alpha_a_n_m + p.alpha_b_n_m * u) * z_m + c0 * v_m_s + p.k0_n_m * (x_m - y_m)
    y_rate = pull * soft / (1.0 + c0 * soft)
    w = v_m_s - y_rate
    size = abs(z_m)
    bent = size**p.n
    back = p.gamma * abs(w) * bent * (1.0 if z_m > 0.0 else -1.0)
    return y_rate, -back - p.beta * w * bent + p.a * w


def force(p: BoucWen, u: float, y_m: float, z_m: float, x_m: float, v_m_s: float) -> float:
    """The force in N."""
    y_rate = rates(p, u, y_m, z_m, x_m, v_m_s)[0]
    c0 = p.c0_a_n_s_m + p.c0_b_n_s_m * u
    inner = (p.alpha_a_n_m + p.alpha_b_n_m * u) * z_m + c0 * (v_m_s - y_rate) + p.k0_n_m * (x_m - y_m)
    return inner + p.k1_n_m * (x_m - p.x0_m)
