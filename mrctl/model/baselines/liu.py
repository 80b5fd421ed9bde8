"""Liu's current map (Eq. 2.2, 2.3): a viscous force that thins with temperature, and a power law of current.

    i = [(|F| - k mu(T) |v|) / alpha]^(1/beta)    where F dissipates and |F| > k mu |v|, else 0

k, alpha and beta come from the damper's tables by least squares, or as parameters. Both branches of mu give
0.245 Pa s at 0 degC, so that it is continuous there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from mrctl.model.baselines.slew import slewed
from mrctl.model.damper import Damper
from mrctl.model.static import backbone_force
from mrctl.model.static_inverse import Reach

VISCOSITY_AT_ZERO_PA_S = 0.245


def viscosity_pa_s(temperature_c: float) -> float:
    """The plastic viscosity of the fluid in Pa s (Eq. 2.3)."""
    rate = 0.0332 if temperature_c < 0.0 else 0.0079
    return VISCOSITY_AT_ZERO_PA_S * math.exp(-rate * temperature_c)


class LiuParameters(NamedTuple):
    """F = k mu(T) v + alpha i^beta sign(v)."""

    viscous_length_m: float  # k
    field_force_n: float  # alpha: the force of 1 A
    exponent: float  # beta


def fit_liu(damper: Damper) -> LiuParameters:
    """The parameters nearest to the damper's static force over its velocities, currents and temperatures.

    Linear least squares for k and alpha at each beta, beta by search; rebound side of the tables.
    Raises ValueError when no beta gives a positive k and alpha.
    """
    static = damper.static
    v_max = static.velocity_m_s[-1]
    velocities = np.linspace(v_max / 20.0, v_max, 20)
    currents = np.linspace(0.0, damper.current_max_a, 13)
    temperatures = np.linspace(static.temperature_c[0], static.temperature_c[-1], 7)
    grid = [(v, i, T) for v in velocities for i in currents for T in temperatures]
    force = np.array([backbone_force(float(v), float(i), float(T), static) for v, i, T in grid])
    viscous = np.array([viscosity_pa_s(T) * v for v, _, T in grid])
    current = np.array([i for _, i, _ in grid])

    best: tuple[float, LiuParameters] | None = None
    for beta in np.linspace(0.2, 2.0, 181):
        columns = np.stack([viscous, current**beta], axis=1)
        (k, alpha), *_ = np.linalg.lstsq(columns, force, rcond=None)
        misfit = float(np.sum((columns @ np.array([k, alpha]) - force) ** 2))
        if k > 0.0 and alpha > 0.0 and (best is None or misfit < best[0]):
            best = (misfit, LiuParameters(float(k), float(alpha), float(beta)))
    if best is None:
        raise ValueError(
            "the damper's tables have no part that grows with velocity and current as Liu's model needs; "
            "give viscous_length_m, field_force_n and exponent, or choose another current map"
        )
    return best[1]


class LiuMap:
    """One damper's current by Liu's map, sample by sample."""

    __slots__ = ("_current_max_a", "_step_max_a", "current_a", "fitted", "reach")

    def __init__(self, damper: Damper, dt_s: float, parameters: Mapping[str, float] | None = None) -> None:
        """parameters: viscous_length_m, field_force_n, exponent; what is 0 is fitted to the damper."""
        given = {name: value for name, value in (parameters or {}).items() if value}
        missing = set(LiuParameters._fields) - given.keys()
        base = fit_liu(damper) if missing else LiuParameters(**given)
        self.fitted = base._replace(**given)
        self._current_max_a = damper.current_max_a
        self._step_max_a = damper.current_slew_a_s * dt_s
        self.reset()

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:  # noqa: ARG002  # interface
        """Start anew with this current flowing; the wish leaves no trace in this map."""
        self.current_a = current_a
        self.reach = Reach.WITHIN

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:
        """The current command in A: within 0 and the largest, within the slew limit of the last."""
        k, alpha, beta = self.fitted
        field = abs(force_wish_n) - k * viscosity_pa_s(temperature_c) * abs(velocity_m_s)
        if force_wish_n * velocity_m_s > 0.0 and field > 0.0:
            wanted = (field / alpha) ** (1.0 / beta)
            self.reach = Reach.ABOVE if wanted > self._current_max_a else Reach.WITHIN
        else:
            wanted, self.reach = 0.0, Reach.WITHIN if force_wish_n == 0.0 else Reach.BELOW
        self.current_a = slewed(self.current_a, wanted, self._current_max_a, self._step_max_a)
        return self.current_a
