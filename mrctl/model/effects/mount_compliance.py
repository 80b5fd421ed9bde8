"""Mount compliance: rubber or bearings in series, so that the piston moves less than the rod ends."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from mrctl.model.effects.base import Effect, GivesWay, Parameter, Ranges, Stage, Undo, Vector
from mrctl.model.filters import Coefficients, iir_step, second_order, settled_state
from mrctl.model.static import StaticTables, backbone_force, force_level
from mrctl.model.tables import interpolate

USUAL_RAD_S = 2.0 * math.pi  # of the motion that a run may begin in
KNEE_SHARE = 0.15  # of the top speed, at which a damper behind a dashpot yields
SLOW_S = 1.0  # in which that follows its spring
SOLVED = 20  # Newton steps at most, for how far a force bends a spring that hardens, ...
CLOSE = 1e-12  # ... to this share
ARM_S = 0.02  # in which a rubber's arm creeps, to begin with


def softness(p: Sequence[float], bent_m: float) -> float:
    """How much further a newton bends the mount where it is bent so far, in m/N."""
    return p[0] / (1.0 + 3.0 * p[2] * bent_m * bent_m)


def inside(p: Sequence[float], lag: Coefficients) -> Coefficients:
    """The lag of the force that the mount carries: the part of H's that is no load cell's, as one or two.

    Two are as far as it may go: behind three a loop closed around a damper and a spring need not be stable.
    """
    return second_order(p[3] * (1.0 / lag[0] - 1.0), p[6])


def creeping(p: Sequence[float], dt_s: float) -> tuple[float, float]:
    """The share of its force that the arm keeps over a sample, and what a metre of bending adds, in N/m.

    Exact where the mount's end runs straight over the sample.
    """
    if p[4] <= 0.0 or p[0] <= 0.0:
        return 0.0, 0.0
    kept = math.exp(-dt_s / p[5])
    return kept, p[4] / p[0] * p[5] * (1.0 - kept) / dt_s


def step(
    p: Sequence[float],
    s: list[float],
    velocity_m_s: float,
    displacement_m: float,
    current_a: float,
    temperature_c: float,
    factor: float,
    beside_n: float,
    beside_n_s_m: float,
    tables: StaticTables,
    lag: Coefficients,
    dt_s: float,
) -> tuple[float, float]:
    """The piston's velocity in m/s and displacement in m.

    The balance k y (1 + hardening y^2) + c dy/dt + z = lag[f g(v1) h factor] + beside(v1), v1 = v - dy/dt, is
    as stiff as the low-speed slope of g over k is short, so it is solved implicitly (BDF2: second order,
    stable at any step), the spring on its tangent where y is expected. g being a table, the solution is
    exact: the segment that holds it, then a straight line.
    """
    if p[0] <= 0.0:
        return velocity_m_s, displacement_m
    lag = inside(p, lag)
    static = factor * force_level(current_a, temperature_c, tables)
    expected = 2.0 * s[3] - s[4]
    soft = softness(p, expected)
    level = soft * lag[0] * static  # what the lag hands on at once; the rest is s[0]
    free = (4.0 * s[3] - s[4]) / 3.0  # y = free + 2/3 dt dy/dt
    kept, stiff = creeping(p, dt_s)
    arm = kept * s[5] - stiff * s[3]  # z = arm + stiff y
    inertia = soft * p[1] + 2.0 / 3.0 * dt_s * (1.0 + soft * stiff)
    # What is left to solve: rest - inertia v1 = level g(v1).
    tangent = 2.0 / 3.0 * (1.0 - soft / p[0]) * expected  # where it meets no force
    rest = inertia * velocity_m_s + free - tangent + soft * (arm + stiff * free - s[0] - beside_n)
    inertia += soft * beside_n_s_m
    low, high = 0, len(tables.shape)
    while low < high:
        middle = (low + high) // 2
        if rest - inertia * tables.velocity_m_s[middle] >= level * tables.shape[middle]:
            low = middle + 1
        else:
            high = middle
    if low == 0:
        piston = (rest - level * tables.shape[0]) / inertia
    elif low == len(tables.shape):
        piston = (rest - level * tables.shape[low - 1]) / inertia
    else:
        v0, g0 = tables.velocity_m_s[low - 1], tables.shape[low - 1]
        slope = (tables.shape[low] - g0) / (tables.velocity_m_s[low] - v0)
        piston = (rest - level * (g0 - slope * v0)) / (inertia + level * slope)
    mount = free + 2.0 / 3.0 * dt_s * (velocity_m_s - piston)
    s[4] = s[3]
    s[3] = mount
    s[5] = arm + stiff * mount
    iir_step(lag, s, static * interpolate(piston, tables.velocity_m_s, tables.shape))
    return piston, displacement_m - mount


def start(
    p: Sequence[float],
    velocity_m_s: float,
    displacement_m: float,  # noqa: ARG001 - the stage's
    current_a: float,
    temperature_c: float,
    factor: float,
    beside_n: float,  # noqa: ARG001 - the stage's; a stop's would bend a soft mount for miles
    beside_n_s_m: float,  # noqa: ARG001 - the stage's
    tables: StaticTables,
    lag: Coefficients,
    dt_s: float,  # noqa: ARG001 - the stage's
) -> list[float]:
    """The mount is bent as far as the first sample's static force gets it, and no longer moves nor creeps."""
    force = factor * backbone_force(velocity_m_s, current_a, temperature_c, tables)
    bent = _bent(p, _reach(p) * p[0] * force)
    return [*settled_state(inside(p, lag), force), bent, bent, 0.0]


def _bent(p: Sequence[float], plain_m: float) -> float:
    """How far a force bends the mount that would bend it by so much if it did not harden."""
    bent = plain_m
    for _ in range(SOLVED):
        harder = p[2] * bent * bent
        step_m = (bent + harder * bent - plain_m) / (1.0 + 3.0 * harder)
        bent -= step_m
        if abs(step_m) <= CLOSE * abs(plain_m):
            break
    return bent


def _reach(p: Sequence[float]) -> float:
    """How far a mount follows its force in a motion of 1 Hz: one that yields slowly hardly at all."""
    phase = USUAL_RAD_S * p[0] * p[1]
    return 1.0 / (1.0 + phase * phase)


def give_way(
    p: Sequence[float],
    s: list[float],
    force_n: float,
    damping_n_s_m: float,
    stiffness_n_m: float,
    bent_m: float,
    lag: Coefficients,
    dt_s: float,
) -> tuple[float, float]:
    """The step's derivative: how the piston's velocity in m/s and displacement in m move."""
    free = (4.0 * s[3] - s[4]) / 3.0
    soft = softness(p, bent_m)
    level = soft * lag[0]
    kept, stiff = creeping(p, dt_s)
    arm = kept * s[5] - stiff * s[3]
    springs = 1.0 + soft * stiff + level * stiffness_n_m
    inertia = soft * p[1] + level * damping_n_s_m + 2.0 / 3.0 * dt_s * springs
    piston = (springs * free + soft * (arm - force_n - s[0])) / inertia
    s[4] = s[3]
    s[3] = free - 2.0 / 3.0 * dt_s * piston
    s[5] = arm + stiff * s[3]
    iir_step(lag, s, damping_n_s_m * piston - stiffness_n_m * s[3])
    return piston, -s[3]


def give_way_start(p: Sequence[float], force_n: float, bent_m: float) -> list[float]:
    """The mount is bent by as much more as that gets it, and no longer moves."""
    bent = _reach(p) * softness(p, bent_m) * force_n
    return [0.0, 0.0, 0.0, bent, bent, 0.0]


def bears(
    p: Sequence[float], s: list[float], before_m: float, bent_m: float, bending_m_s: float, dt_s: float
) -> float:
    """The force in N of a mount that is bent so: spring, damping and the arm that creeps."""
    kept, stiff = creeping(p, dt_s)
    s[5] = kept * s[5] + stiff * (bent_m - before_m)
    return bent_m * (1.0 + p[2] * bent_m * bent_m) / p[0] + p[1] * bending_m_s + s[5]


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    return {"mount stiffness": (1.0 / p[0], "N/m")} if p[0] > 0.0 else {}


def _guesses(ranges: Ranges) -> list[Vector]:
    # Soft or stiff, much or little damped: a fit hardly finds its way from one to the other.
    return [
        *(
            (soft, damping, 0.0, 1.0, 0.0, ARM_S, 0.0)
            for soft in (2e-7, 6e-7, 2e-6)
            for damping in (1e3, 5e3)
        ),
        *_dashpot(ranges),
    ]


def _dashpot(ranges: Ranges) -> list[Vector]:
    """Hardly a spring: the force rises with the speed until the damper yields, whatever the current."""
    damping = ranges.force_n / max(KNEE_SHARE * ranges.velocity_m_s, 1e-3)
    return [(SLOW_S / damping, damping, 0.0, 1.0, 0.0, ARM_S, 0.0)]


EFFECT = Effect(
    name="mount_compliance",
    stage=Stage.MOTION,
    summary="Rubber mounts and bearings in series with the damper take part of the stroke.",
    equation=(
        "y (1 + hardening y^2) / compliance + damping dy/dt + z = lag[f g(v1) h factors] + forces beside, "
        "v1 = v - dy/dt, x1 = x - y, dz/dt = (arm / compliance) dy/dt - z / creep"
    ),
    source=(
        "Kelvin-Voigt mount in series with the damper; Dixon, The Shock Absorber Handbook, 2nd ed. Rubber "
        "that relaxes has a Maxwell arm beside it, as Zener's solid. With "
        "hardly a spring it is the dashpot in series of Spencer et al., J. Eng. Mech. 123 (1997): a damper "
        "behind it yields at a speed in proportion to its force. "
        "The mount carries the fluid's force behind one lag as long as H's or two, or the part of it that is "
        "no load cell's, and what acts at the piston beside it; what makes that force elastic, or limits it, "
        "is left out."
    ),
    parameters=(
        Parameter(
            "compliance_m_n", "m/N", 0.0, 0.0, 1e-2, 5e-7, "one over the mount's stiffness", endless=True
        ),
        Parameter("damping_n_s_m", "N*s/m", 1e3, 0.0, 1e7, 1e3, "damping of the mount", partial=True),
        Parameter(
            "hardening_per_m2",
            "1/m^2",
            0.0,
            0.0,
            1e9,
            0.0,
            "how soon rubber stiffens as it is bent",
            1e5,
            optional=True,
            endless=True,
        ),
        Parameter(
            "lag_inside",
            "1",
            1.0,
            0.0,
            1.0,
            1.0,
            "how much of H's lag is the damper's own, the rest the load cell's",
            0.3,
            optional=True,
        ),
        Parameter(
            "arm",
            "1",
            0.0,
            0.0,
            10.0,
            0.0,
            "stiffness of a spring that creeps beside the mount's, over that",
            0.3,
            optional=True,
        ),
        Parameter("creep_s", "s", ARM_S, 1e-3, 1.0, ARM_S, "time in which that creeps", optional=True),
        Parameter(
            "lag_split",
            "1",
            0.0,
            0.0,
            0.5,
            0.0,
            "share of the lag inside that is a second one's",
            0.2,
            optional=True,
        ),
    ),
    step=step,
    inverse=Undo.OBSERVE,
    inverse_note="The piston's motion is followed with the currents commanded; g is taken at its velocity.",
    start=start,
    states=("lag, N", "0", "0", "mount's deflection, m", "the one before, m", "the arm's force, N"),
    guesses=_guesses,
    far=_dashpot,
    derived=_derived,
    gives_way=GivesWay(give_way, give_way_start, inside, bears),
    # A fluid that is elastic in series with its flow is this spring, as stiff as f h has it.
    alike_at_one_level=frozenset({"preyield_stiffness"}),
)
