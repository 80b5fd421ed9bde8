"""A calibration as YAML that explains itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrctl.calibration.effects import known_effects
from mrctl.calibration.models import SCHEMA, Provenance
from mrctl.model.damper import Damper, Span
from mrctl.model.filters import Filter
from mrctl.yaml_source.writer import render

_HEAD = """Calibration of one magnetorheological damper: from current, motion and temperature to force,
    F = H(z)[ f(i) g(v) h(i, T) ]
Relative velocity v > 0 is extension (rebound); force > 0 resists extension. Tables are linear between
their rows and keep the end value outside them. `mrctl check` reads this file and says what is wrong.
A column may have `std: [...]` beside its values: their standard deviation, in the same unit."""

_F = "f(i): the force at full shape (g = 1) and nominal temperature (h = 1). From 0 A, strictly increasing."
_G = "g(v): the shape of the force over relative velocity, -1 to 1, with the velocity's sign, 0 at rest."
_H = """h(i, T): the force at a temperature against that at the nominal one. 'off' holds up to off_below, 'on'
from on_above; between them h goes over linearly. Measured at the damper's case."""
_FORWARD = """H(z): hysteresis filter from static to real force, polynomials in falling powers of z at its
own sample rate (carried to the loop's rate when loaded). Stable, gain 1 at 0 Hz."""
_INVERSE = """The inverse of H(z), from desired to static force. Below refine_cutoff the error that it leaves
is corrected in a second pass; without refine_cutoff it is used as it is."""
_LIMITS = "What coil and driver bear; commands never go beyond these."
_VALID = "Where the numbers were measured. Outside the model still answers, and health says so."
_EFFECTS = "Effects beyond the equation above, each with its parameters and their units."


def render_calibration(
    name: str, provenance: Provenance, damper: Damper, std: Mapping[str, tuple[float, ...]]
) -> str:
    """The calibration's YAML text; every float keeps all its digits."""
    static = damper.static

    def column(unit: str, values: Sequence[float], key: str) -> dict[str, Any]:
        block: dict[str, Any] = {"unit": unit, "values": list(values)}
        if key in std:
            block["std"] = list(std[key])
        return block

    return render(
        [
            (_HEAD, {"schema": SCHEMA}),
            ("", {"name": name}),
            ("", {"provenance": provenance.model_dump(exclude_none=True, mode="json")}),
            (
                _F,
                {
                    "f": {
                        "current": column("A", static.current_a, "f.current"),
                        "force": column("N", static.force_n, "f.force"),
                    }
                },
            ),
            (
                _G,
                {
                    "g": {
                        "velocity": column("m/s", static.velocity_m_s, "g.velocity"),
                        "shape": column("1", static.shape, "g.shape"),
                    }
                },
            ),
            (
                _H,
                {
                    "h": {
                        "off_below": {"unit": "A", "value": static.off_below_a},
                        "on_above": {"unit": "A", "value": static.on_above_a},
                        "temperature": column("degC", static.temperature_c, "h.temperature"),
                        "off": column("1", static.h_off, "h.off"),
                        "on": column("1", static.h_on, "h.on"),
                    }
                },
            ),
            (_FORWARD, {"forward_filter": _filter(damper.forward_filter)}),
            (_INVERSE, {"inverse_filter": _inverse_filter(damper)}),
            (
                _LIMITS,
                {
                    "limits": {
                        "current_max": {"unit": "A", "value": float(damper.current_max_a)},
                        "current_slew": {"unit": "A/s", "value": float(damper.current_slew_a_s)},
                    }
                },
            ),
            (
                _VALID,
                {
                    "valid": {
                        "velocity": _span("m/s", damper.velocity_valid_m_s),
                        "temperature": _span("degC", damper.temperature_valid_c),
                        "current": _span("A", damper.current_valid_a),
                    }
                },
            ),
            (_EFFECTS, {"effects": _effects(damper, std)}),
        ]
    )


def _filter(f: Filter) -> dict[str, Any]:
    return {
        "sample_rate": {"unit": "Hz", "value": f.sample_rate_hz},
        "numerator": list(f.b),
        "denominator": list(f.a),
    }


def _inverse_filter(damper: Damper) -> dict[str, Any]:
    block = _filter(damper.inverse_filter)
    if damper.refine_cutoff_hz is not None:
        block["refine_cutoff"] = {"unit": "Hz", "value": float(damper.refine_cutoff_hz)}
    return block


def _span(unit: str, span: Span) -> dict[str, Any]:
    return {"unit": unit, "from": float(span.low), "to": float(span.high)}


def _effects(damper: Damper, std: Mapping[str, tuple[float, ...]]) -> list[dict[str, Any]]:
    known = known_effects() if damper.effects else {}
    blocks = []
    for effect in damper.effects:
        parameters: dict[str, Any] = {}
        for name, value in effect.parameters.items():
            unit = known.get(effect.name, {}).get(name, "1")
            parameters[name] = {"value": float(value), "unit": unit}
            deviation = std.get(f"effects.{effect.name}.{name}")
            if deviation is not None:
                parameters[name]["std"] = deviation[0]
        blocks.append({"name": effect.name, "parameters": parameters})
    return blocks
