"""Gas spring: the accumulator's pressure on the rod, rising with stroke."""
# ruff: noqa: ARG001 - all effects of a stage take the same arguments

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence

from mrctl.model.effects.base import Effect, Parameter, Ranges, Stage, Undo, Vector

REFERENCE_C = 25.0
SMALLEST_VOLUME = 0.1  # the gas is never compressed below this share of its volume
LONGEST_COLUMN_M = 3.0  # V0/A: a preload that hardly rises with stroke is no gas's


def step(
    p: Sequence[float],
    s: MutableSequence[float],
    velocity_m_s: float,
    displacement_m: float,
    acceleration_m_s2: float,
    current_a: float,
    temperature_c: float,
    dt_s: float,
) -> float:
    """The gas force in N."""
    volume = max(1.0 - p[2] * displacement_m, SMALLEST_VOLUME)
    return p[0] + p[1] * displacement_m / volume + p[3] * (temperature_c - REFERENCE_C)


def _plausible(p: Vector, _: Ranges) -> bool:
    """Whether the force rises with stroke as a gas's must: by its preload in a column's length at least."""
    return p[1] * LONGEST_COLUMN_M > abs(p[0])


def _derived(p: Vector) -> Mapping[str, tuple[float, str]]:
    if abs(p[2]) * LONGEST_COLUMN_M < 1.0:  # as good as straight: no length is told
        return {}
    return {"isothermal gas column V0/A": (1.0 / abs(p[2]), "m")}


EFFECT = Effect(
    name="gas_spring",
    stage=Stage.ROD,
    summary="The gas in the accumulator pushes on the rod, the harder the further it is compressed.",
    equation=(
        f"F = preload + warming (T - {REFERENCE_C:g}) + stiffness x / volume, "
        f"volume = 1 - progression x, at least {SMALLEST_VOLUME:g}"
    ),
    source=(
        "Accumulator law -p0 A (V0 / (V0 + A x))^kappa of a gas that pushes the rod out, in parameters that "
        "data determine: exact for kappa = 1, progression -A/V0; otherwise progression is near "
        "-(kappa + 1) A / (2 V0). With the other sign it is that of a gas that extension compresses. "
        "Dixon, The Shock Absorber Handbook, 2nd ed."
    ),
    parameters=(
        Parameter(
            "preload_n",
            "N",
            0.0,
            -5e3,
            5e3,
            0.0,
            f"force at x = 0 and {REFERENCE_C:g} degC; < 0 pushes the rod out",
            100.0,
            linear=True,
        ),
        Parameter("stiffness_n_m", "N/m", 0.0, 0.0, 2e5, 8e3, "slope of the force at x = 0", linear=True),
        Parameter("progression_per_m", "1/m", 0.0, -60.0, 60.0, 0.0, "how fast the slope grows with x", 2.0),
        Parameter(
            "warming_n_k",
            "N/K",
            0.0,
            -20.0,
            20.0,
            0.0,
            "what each kelvin adds to the preload: warm gas presses harder",
            0.5,
            linear=True,
            optional=True,
        ),
    ),
    step=step,
    shape_over=frozenset({"stroke"}),
    inverse=Undo.SUBTRACT,
    inverse_note="Its force at the measured displacement is taken off the wish.",
    needs=frozenset({"displacement"}),
    derived=_derived,
    plausible=_plausible,
)
