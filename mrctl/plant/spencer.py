"""A Bouc-Wen damper through a motion: Dormand and Prince's Runge-Kutta 5(4) with its own step.

Between samples the stroke is the cubic that has stroke and rate at both ends; the drive is held and goes
through the model's first-order lag exactly.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrctl.model.baselines import bouc_wen
from mrctl.model.baselines.bouc_wen import LARGEST_V, BoucWen
from mrctl.model.effects.base import Step
from mrctl.simulate.compiled import compiled

__all__ = ["LARGEST_V", "simulate_bouc_wen"]

Array = NDArray[np.float64]

RELATIVE = 1e-8  # 2 mN of 1.5 kN
ABSOLUTE_M = 1e-10
LEAST_SHARE = 1e-9  # of a sample: a step that would be smaller is taken as it is


def simulate_bouc_wen(
    p: BoucWen,
    rate_hz: float,
    displacement_m: Array,
    velocity_m_s: Array,
    drive: ArrayLike,
    *,
    relative: float = RELATIVE,
) -> Array:
    """The force in N (n) of a damper at rest at the first sample; `drive` (n, or one number) in V or A.

    NaN from where the state grows beyond all numbers, which only a damper that gives energy does.
    """
    x, v = (np.array(signal, dtype=np.float64) for signal in (displacement_m, velocity_m_s))
    u = np.array(np.broadcast_to(np.asarray(drive, dtype=np.float64), x.shape))
    out = np.empty_like(x)
    loop = compiled(_loop, bouc_wen.force, "bouc_wen")
    loop(p, 1.0 / rate_hz, x, v, u, relative, ABSOLUTE_M, out)
    return out


def _loop(force: Step) -> Step:
    rates = bouc_wen.rates  # known to the compiler: `force` calls it

    def loop(
        p: BoucWen,
        dt_s: float,
        x: Array,
        v: Array,
        drive: Array,
        relative: float,
        absolute: float,
        out: Array,
    ) -> None:
        u, y, z = drive[0], x[0], 0.0
        h = dt_s
        out[0] = force(p, u, y, z, x[0], v[0])
        for s in range(x.size - 1):
            x0, x1, v0, v1 = x[s], x[s + 1], v[s], v[s + 1]
            a = (x1 - x0) / dt_s
            b2, b3 = (3.0 * a - 2.0 * v0 - v1) / dt_s, (v0 + v1 - 2.0 * a) / (dt_s * dt_s)
            u0, aim = u, drive[s]
            t = 0.0
            while t < dt_s:
                step = min(h, dt_s - t)
                ky = np.zeros(7)
                kz = np.zeros(7)
                for stage in range(7):
                    ys, zs = y, z
                    for j in range(stage):
                        ys += step * TABLEAU[stage, j] * ky[j]
                        zs += step * TABLEAU[stage, j] * kz[j]
                    at = t + NODES[stage] * step
                    us = aim + (u0 - aim) * math.exp(-p.eta_1_s * at) if at > 0.0 else u0
                    xs = x0 + at * (v0 + at * (b2 + at * b3))
                    vs = v0 + at * (2.0 * b2 + 3.0 * b3 * at)
                    ky[stage], kz[stage] = rates(p, us, ys, zs, xs, vs)
                # The last stage's point is the fifth-order result.
                error_y, error_z = 0.0, 0.0
                for j in range(7):
                    error_y += step * ERROR[j] * ky[j]
                    error_z += step * ERROR[j] * kz[j]
                away = math.sqrt(
                    0.5
                    * (
                        (error_y / (absolute + relative * max(abs(y), abs(ys)))) ** 2
                        + (error_z / (absolute + relative * max(abs(z), abs(zs)))) ** 2
                    )
                )
                # Not finite: a stage flew away. A short step mends it; no step mends a state that is lost.
                if not math.isfinite(away):
                    if step <= LEAST_SHARE * dt_s:
                        out[s + 1 :] = math.nan
                        return
                    h = 0.1 * step
                    continue
                if away <= 1.0 or step <= LEAST_SHARE * dt_s:
                    t = dt_s if step == dt_s - t else t + step
                    y, z = ys, zs
                # The step that was cut short by the sample's end says nothing against a longer one.
                change = min(max(0.9 * max(away, 1e-10) ** -0.2, 0.2), 5.0)
                h = step * change if away > 1.0 or step == h else max(h, step * change)
            u = aim + (u0 - aim) * math.exp(-p.eta_1_s * dt_s)
            out[s + 1] = force(p, u, y, z, x1, v1)

    return loop


# Dormand and Prince, Journal of Computational and Applied Mathematics 6 (1980).
NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
TABLEAU = np.zeros((7, 6))
TABLEAU[1, :1] = 1 / 5
TABLEAU[2, :2] = 3 / 40, 9 / 40
TABLEAU[3, :3] = 44 / 45, -56 / 15, 32 / 9
TABLEAU[4, :4] = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
TABLEAU[5, :5] = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
TABLEAU[6] = 35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
ERROR = np.append(TABLEAU[6], 0.0) - np.array(
    [5179 / 57600, 0.0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40]
)
