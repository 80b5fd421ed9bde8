"""The file that `mrctl effects --new NAME` writes."""

from __future__ import annotations

TEMPLATE = '''\
"""NAME: say here in a line what happens in the damper."""

from __future__ import annotations

from mrctl.model.effects.base import Effect, Parameter, Stage, Undo


def step(
    p,  # the parameters below, in their order
    s,  # the state: what the effect remembers, a list that this function may change; empty here
    velocity_m_s,  # the piston's; > 0 is extension
    displacement_m,  # 0 unless EFFECT.needs has "displacement"
    acceleration_m_s2,
    current_a,  # of the field, after lag and hysteresis
    temperature_c,  # of the fluid
    dt_s,
):
    """The force in N that comes on top of the static one; > 0 resists extension.

    This runs as it is in every tick on the vehicle, and compiled at the desk. Keep to floats, the math
    module, if, for, while, and plain functions of this file; divide by nothing that can be 0. With the
    neutral values below it has to return exactly 0.
    """
    return p[0] * velocity_m_s * velocity_m_s * velocity_m_s


# Other stages take other arguments (mrctl.model.effects.base lists them all):
#   Stage.FACTOR  (p, s, velocity_m_s, displacement_m, current_a, temperature_c, dt_s)
#                 -> the factor on the static force; 1 where neutral
#   Stage.CURRENT (p, s, current_a, dt_s) -> the current that makes the field
#   Stage.OUTPUT  (p, s, force_n, dt_s) -> the force as measured
#
# An effect that remembers something has a start, which takes what step takes except s, at the first
# sample, and returns the state as a list of floats; give it to EFFECT as start=start, and say what the
# numbers are in states=("...",).

EFFECT = Effect(
    name="NAME",
    stage=Stage.ADDITIVE,
    summary="A force with the cube of velocity; say what it is and where it comes from.",
    equation="F = coefficient v^3",
    source="The book or paper that the equation stands in.",
    parameters=(
        Parameter(
            name="coefficient_n_s3_m3",
            unit="N*s^3/m^3",
            neutral=0.0,  # the value at which the effect is not there
            low=0.0,  # the bounds that physics sets: a fit never leaves them
            high=1e5,
            typical=500.0,  # the usual size: a fit starts here
            help="force at 1 m/s",
            linear=True,  # the force is proportional to it
        ),
    ),
    step=step,
    inverse=Undo.SUBTRACT,  # for Stage.FACTOR it is Undo.DIVIDE; Undo.NOT_UNDONE is always honest
    inverse_note="Its force at the measured velocity is taken off the wish.",
    needs=frozenset(),  # "displacement", "acceleration"
    shape_over=frozenset({"velocity"}),  # there, nature's form may be another; elsewhere its size is one
)
'''


def template(name: str) -> str:
    """The text of a commented effect file of that name, which runs as it is."""
    return TEMPLATE.replace("NAME", name)
