"""A motion for the effects, and the independent solution of an equation along it."""

from __future__ import annotations

import numpy as np
from effects.conftest import make_damper
from scipy.integrate import solve_ivp

T = 2.0
TABLES = make_damper().static


def signals(dt_s: float, seconds: float = T) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(round(seconds / dt_s) + 1) * dt_s
    return t, velocity(t)


def velocity(t):
    return 0.25 * np.sin(9.0 * t) + 0.1 * np.sin(31.0 * t + 0.5)


def solved(rate, y0: float, t: np.ndarray, method: str = "RK45") -> np.ndarray:
    span = t[0], t[-1]
    return solve_ivp(rate, span, [y0], method, t_eval=t, rtol=1e-8, atol=1e-11, max_step=1e-3).y[0]


def relative(ours: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(np.mean((ours - exact) ** 2) / np.mean((exact - exact.mean()) ** 2)))
