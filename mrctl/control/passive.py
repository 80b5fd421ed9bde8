"""Laws that make the damper passive: a constant damping, or the curve of another damper."""

from __future__ import annotations

from collections.abc import Mapping

from mrctl.control.base import ForceLaw, Law, Motion, Parameter, ParameterValue
from mrctl.control.parameters import number, table
from mrctl.control.semi_active import DAMPING_BOUND_N_S_M
from mrctl.model.tables import interpolate, strictly_increasing

DAMPING = Parameter("damping_n_s_m", "N s/m", 1500.0, 0.0, DAMPING_BOUND_N_S_M, "damping coefficient")
VELOCITY = Parameter(
    "velocity_m_s",
    "m/s",
    (-0.5, -0.1, 0.0, 0.1, 0.5),
    -20.0,
    20.0,
    "relative velocities of the curve, rising; from 0 on the curve is mirrored to compression",
)
FORCE = Parameter("force_n", "N", (-1000.0, -500.0, 0.0, 500.0, 1000.0), -1.0e5, 1.0e5, "forces of the curve")


def _passive(values: Mapping[str, ParameterValue]) -> ForceLaw:
    damping = number(values, DAMPING.name)

    def force(motion: Motion) -> float:
        return damping * motion.relative_velocity_m_s

    return force


def _reference(values: Mapping[str, ParameterValue]) -> ForceLaw:
    velocities, forces = table(values, VELOCITY.name), table(values, FORCE.name)
    if len(velocities) != len(forces) or len(velocities) < 2:
        raise ValueError(
            f"velocity_m_s has {len(velocities)} knots and force_n {len(forces)}; "
            "give two columns of the same length, at least 2"
        )
    if not strictly_increasing(velocities):
        raise ValueError("velocity_m_s does not rise from knot to knot; sort it and drop repeated knots")
    if any(v * f < 0.0 or (v == 0.0 and f != 0.0) for v, f in zip(velocities, forces, strict=True)):
        raise ValueError(
            "the curve would drive the motion or has force at rest; give force_n the sign of velocity_m_s"
        )
    if velocities[0] >= 0.0:
        start = 1 if velocities[0] == 0.0 else 0
        velocities = (*(-v for v in reversed(velocities[start:])), 0.0, *velocities[start:])
        forces = (*(-f for f in reversed(forces[start:])), 0.0, *forces[start:])
    elif 0.0 not in velocities:
        raise ValueError("the curve has no knot at rest; add 0 to velocity_m_s and to force_n")

    def force(motion: Motion) -> float:
        return interpolate(motion.relative_velocity_m_s, velocities, forces)

    return force


PASSIVE = Law(
    name="passive",
    summary="a constant damping, c * v_rel; also what takes over while a better law lacks its signals",
    source="the linear viscous damper",
    parameters=(DAMPING,),
    needs=frozenset(),
    make=_passive,
)

REFERENCE_DAMPER = Law(
    name="reference_damper",
    summary="behaves like a given passive damper: its force-velocity curve, held beyond its ends",
    source="model reference control, paper chapter 1",
    parameters=(VELOCITY, FORCE),
    needs=frozenset(),
    make=_reference,
)
