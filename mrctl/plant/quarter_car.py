"""A quarter car: body, wheel, suspension spring, tyre that can leave the ground.

    m_b a_b = -k_s (z_b - z_w) - F
    m_w a_w = +k_s (z_b - z_w) + F + (F_tyre - W),   F_tyre = max(0, W + k_t (z_r - z_w) + c_t (v_r - v_w))

z from the static equilibrium, upward positive; F > 0 resists extension; W is the weight on the tyre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from mrctl.plant.road import Road

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, slots=True)
class QuarterCarParameters:
    """One corner of a mid-size car: body mode near 1.2 Hz, wheel mode near 11 Hz."""

    body_mass_kg: float = 400.0
    wheel_mass_kg: float = 40.0
    spring_n_m: float = 25000.0
    tyre_n_m: float = 200000.0
    tyre_damping_n_s_m: float = 100.0

    def __post_init__(self) -> None:
        """Raises ValueError for a value that no car has."""
        for item in fields(self):
            value = getattr(self, item.name)
            if not (math.isfinite(value) and value >= 0.0) or (value == 0.0 and item.name.endswith("_kg")):
                raise ValueError(f"{item.name} is {value!r}; give a finite number above 0")


class QuarterCar:
    """Motion of one corner, integrated with Runge and Kutta's fourth-order rule at a fixed step.

    During a step the damper force is held and the road rises evenly.
    """

    __slots__ = (
        "_constants",
        "_distance_m",
        "_p",
        "_road",
        "_road_m",
        "_speed_m_s",
        "_weight_n",
        "body_acceleration_m_s2",
        "body_m",
        "body_velocity_m_s",
        "tyre_force_n",
        "wheel_m",
        "wheel_velocity_m_s",
    )

    def __init__(
        self,
        road: Road,
        speed_m_s: float,
        parameters: QuarterCarParameters | None = None,
        start_m: float = 0.0,
    ) -> None:
        """Stands at rest at start_m along the road, at the height the road has there."""
        p = self._p = parameters or QuarterCarParameters()
        self._road = road
        self._speed_m_s = speed_m_s
        self._distance_m = start_m
        self._weight_n = (p.body_mass_kg + p.wheel_mass_kg) * GRAVITY_M_S2
        self._constants = (
            p.spring_n_m,
            p.tyre_n_m,
            p.tyre_damping_n_s_m,
            self._weight_n,
            p.body_mass_kg,
            p.wheel_mass_kg,
        )
        self._road_m = road.height_m(start_m)
        self.body_m = self.wheel_m = self._road_m
        self.body_velocity_m_s = self.wheel_velocity_m_s = 0.0
        self.body_acceleration_m_s2 = 0.0
        self.tyre_force_n = self._weight_n

    @property
    def relative_velocity_m_s(self) -> float:
        """Extension speed of the damper in m/s."""
        return self.body_velocity_m_s - self.wheel_velocity_m_s

    @property
    def displacement_m(self) -> float:
        """Extension of the damper in m from the static equilibrium."""
        return self.body_m - self.wheel_m

    @property
    def static_tyre_force_n(self) -> float:
        """Weight on the tyre in N."""
        return self._weight_n

    def energy_j(self) -> float:
        """Mechanical energy in J of masses and springs about the equilibrium, tyre on the ground."""
        p = self._p
        kinetic = p.body_mass_kg * self.body_velocity_m_s**2 + p.wheel_mass_kg * self.wheel_velocity_m_s**2
        elastic = p.spring_n_m * self.displacement_m**2 + p.tyre_n_m * (self._road_m - self.wheel_m) ** 2
        return 0.5 * (kinetic + elastic)

    def step(self, dt_s: float, damper_force_n: float) -> None:
        """Advance by dt_s with this damper force."""
        half = 0.5 * dt_s
        r0 = self._road_m
        self._distance_m += self._speed_m_s * dt_s
        r1 = self._road.height_m(self._distance_m)
        rm, slope = 0.5 * (r0 + r1), (r1 - r0) / dt_s

        ks, kt, ct, weight, mb, mw = self._constants
        f = damper_force_n
        zb, vb, zw, vw = self.body_m, self.body_velocity_m_s, self.wheel_m, self.wheel_velocity_m_s

        # Each stage: the tyre's change of force (never below minus the weight), then the accelerations.
        between = ks * (zb - zw) + f
        tyre = max(-weight, kt * (r0 - zw) + ct * (slope - vw))
        b1, w1 = -between / mb, (between + tyre) / mw

        vb2, vw2 = vb + half * b1, vw + half * w1
        zw2 = zw + half * vw
        between = ks * (zb + half * vb - zw2) + f
        tyre = max(-weight, kt * (rm - zw2) + ct * (slope - vw2))
        b2, w2 = -between / mb, (between + tyre) / mw

        vb3, vw3 = vb + half * b2, vw + half * w2
        zw3 = zw + half * vw2
        between = ks * (zb + half * vb2 - zw3) + f
        tyre = max(-weight, kt * (rm - zw3) + ct * (slope - vw3))
        b3, w3 = -between / mb, (between + tyre) / mw

        vb4, vw4 = vb + dt_s * b3, vw + dt_s * w3
        zw4 = zw + dt_s * vw3
        between = ks * (zb + dt_s * vb3 - zw4) + f
        tyre = max(-weight, kt * (r1 - zw4) + ct * (slope - vw4))
        b4, w4 = -between / mb, (between + tyre) / mw

        sixth = dt_s / 6.0
        self.body_m = zb + sixth * (vb + 2.0 * (vb2 + vb3) + vb4)
        self.wheel_m = zw + sixth * (vw + 2.0 * (vw2 + vw3) + vw4)
        self.body_velocity_m_s = vb + sixth * (b1 + 2.0 * (b2 + b3) + b4)
        self.wheel_velocity_m_s = vw + sixth * (w1 + 2.0 * (w2 + w3) + w4)
        self._road_m = r1
        self.body_acceleration_m_s2 = -(ks * (self.body_m - self.wheel_m) + f) / mb
        self.tyre_force_n = weight + max(
            -weight, kt * (r1 - self.wheel_m) + ct * (slope - self.wheel_velocity_m_s)
        )
