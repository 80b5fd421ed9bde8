"""What a calibration must fulfil beyond its shape: physics, and one block against another."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from mrctl.calibration.columns import check_knots, check_lengths, more
from mrctl.calibration.filter_checks import check_filter
from mrctl.calibration.models import (
    CurrentBlock,
    FilterBlock,
    InverseFilterBlock,
    Limits,
    TemperatureBlock,
    Validity,
    VelocityBlock,
)
from mrctl.model.static import StaticTables, static_tables, transition_increases
from mrctl.model.tables import interpolate, strictly_increasing
from mrctl.yaml_source import Findings, quiet_model


def check_blocks(data: dict[str, Any], findings: Findings) -> None:
    """Judge each block of a calibration that has its shape, whatever is wrong with the others."""
    f = quiet_model(CurrentBlock, data.get("f"))
    g = quiet_model(VelocityBlock, data.get("g"))
    h = quiet_model(TemperatureBlock, data.get("h"))
    limits = quiet_model(Limits, data.get("limits"))
    valid = quiet_model(Validity, data.get("valid"))
    if f:
        check_current_block(f, findings)
    if g:
        check_velocity_block(g, findings)
    if h:
        check_temperature_block(h, findings)
    if limits:
        check_limits(limits, findings)
    if valid:
        check_validity(valid, f, g, h, findings)
    check_together(f, h, limits, findings)
    for key, model in (("forward_filter", FilterBlock), ("inverse_filter", InverseFilterBlock)):
        block = quiet_model(model, data.get(key))
        if block:
            check_filter(block, key, findings)


def check_current_block(f: CurrentBlock, findings: Findings) -> None:
    """f: knots from 0 A upwards, forces positive and strictly increasing."""
    check_knots(f.current, ("f", "current"), "current", findings)
    check_lengths(f.current, {"force": f.force}, "current", "f", findings)
    values = f.force.values
    for index, force in enumerate(values):
        if force <= 0.0:
            findings.add(
                ("f", "force", "values", index),
                f"`f.force` is {force:g} N",
                "f is the force at full shape and must be greater than 0, at 0 A too",
            )
            break
    falls = [index for index, (low, high) in enumerate(pairwise(values), start=1) if high <= low]
    if falls:
        index = falls[0]
        findings.add(
            ("f", "force", "values", index),
            f"`f.force` does not increase: {values[index]:g} N after {values[index - 1]:g} N" + more(falls),
            "the inverse needs a force that grows with every current; smooth it or leave out the row",
        )
    if len(f.current.values) < 2:
        findings.add(
            ("f", "current"), "`f` has one row only", "give at least the forces at 0 A and at one current"
        )
    elif f.current.values[0] != 0.0 and strictly_increasing(f.current.values):
        findings.add(
            ("f", "current", "values", 0),
            f"`f` starts at {f.current.values[0]:g} A",
            "add the force without current, at 0 A",
        )


def check_velocity_block(g: VelocityBlock, findings: Findings) -> None:
    """g: from -1 to 1, of the velocity's sign, zero at zero."""
    check_knots(g.velocity, ("g", "velocity"), "velocity", findings)
    check_lengths(g.velocity, {"shape": g.shape}, "velocity", "g", findings)
    v, shape = g.velocity.values, g.shape.values
    for index, value in enumerate(shape):
        if not -1.0 <= value <= 1.0:
            findings.add(
                ("g", "shape", "values", index),
                f"`g.shape` is {value:g}",
                "g lies in -1 to 1: divide it by its largest magnitude and multiply f by that",
            )
            break
    if len(v) != len(shape):
        return
    for index, (velocity, value) in enumerate(zip(v, shape, strict=True)):
        if velocity * value < 0.0:
            findings.add(
                ("g", "shape", "values", index),
                f"`g.shape` is {value:g} at {velocity:g} m/s",
                "g has the velocity's sign: > 0 in extension; turn the velocity or the force around",
            )
            break
    if not strictly_increasing(v):
        return
    if len(v) < 3 or not v[0] < 0.0 < v[-1]:
        findings.add(
            ("g", "velocity"),
            "`g` does not cover compression and extension",
            "give velocities below and above 0",
        )
    elif abs(interpolate(0.0, v, shape)) > 1e-9:
        findings.add(
            ("g", "shape"),
            f"`g.shape` is {interpolate(0.0, v, shape):.3g} at 0 m/s",
            "g must be 0 there: add the row 0 m/s, 0",
        )


def check_temperature_block(h: TemperatureBlock, findings: Findings) -> None:
    """h: positive, off and on of the temperature's length; the off state ends before the on state begins."""
    check_knots(h.temperature, ("h", "temperature"), "temperature", findings)
    check_lengths(h.temperature, {"off": h.off, "on": h.on}, "temperature", "h", findings)
    for key, column in (("off", h.off), ("on", h.on)):
        for index, value in enumerate(column.values):
            if value <= 0.0:
                findings.add(
                    ("h", key, "values", index),
                    f"`h.{key}` is {value:g}",
                    "h is a ratio to the nominal force and must be greater than 0",
                )
                break
    off, on = h.off_below.value, h.on_above.value
    if off < 0.0:
        findings.add(("h", "off_below", "value"), f"`h.off_below` is {off:g} A", "currents are 0 A or more")
    if on < off:
        findings.add(
            ("h", "on_above", "value"),
            f"`h.on_above` ({on:g} A) is below `h.off_below` ({off:g} A)",
            "the off state ends before the on state begins: swap them",
        )


def check_limits(limits: Limits, findings: Findings) -> None:
    """Largest current and slew are positive."""
    for key, value, unit in (
        ("current_max", limits.current_max.value, "A"),
        ("current_slew", limits.current_slew.value, "A/s"),
    ):
        if value <= 0.0:
            findings.add(
                ("limits", key, "value"), f"`limits.{key}` is {value:g} {unit}", "it must be greater than 0"
            )


def check_validity(
    valid: Validity,
    f: CurrentBlock | None,
    g: VelocityBlock | None,
    h: TemperatureBlock | None,
    findings: Findings,
) -> None:
    """Each range is one, and inside the table that it speaks of."""
    for key, span, column in (
        ("velocity", valid.velocity, g and g.velocity),
        ("temperature", valid.temperature, h and h.temperature),
        ("current", valid.current, f and f.current),
    ):
        if span.low >= span.high:
            findings.add(
                ("valid", key),
                f"`valid.{key}` goes from {span.low:g} to {span.high:g}",
                "`from` must be less than `to`",
            )
        elif column and not min(column.values) <= span.low <= span.high <= max(column.values):
            low, high = min(column.values), max(column.values)
            findings.add(
                ("valid", key),
                f"`valid.{key}` ({span.low:g} to {span.high:g}) leaves its table ({low:g} to {high:g})",
                "narrow it, or measure and add rows",
            )


def check_together(
    f: CurrentBlock | None, h: TemperatureBlock | None, limits: Limits | None, findings: Findings
) -> None:
    """F against h (the force grows all the way from off to on) and f against the limits."""
    if f and limits and limits.current_max.value > max(f.current.values):
        findings.add(
            ("limits", "current_max", "value"),
            f"`limits.current_max` ({limits.current_max.value:g} A) lies beyond `f`, "
            f"which ends at {max(f.current.values):g} A",
            "lower it, or add rows to f",
        )
    tables = _transition_tables(f, h)
    if tables is not None and not transition_increases(tables):
        findings.add(
            ("h", "on"),
            "from off to on the force does not increase with the current at every temperature",
            "lift `h.on` or lower `h.off` there, or widen `off_below` to `on_above`",
        )


def _transition_tables(f: CurrentBlock | None, h: TemperatureBlock | None) -> StaticTables | None:
    """The tables for the transition check; None where f or h is not fit for it."""
    if f is None or h is None or len(f.current.values) != len(f.force.values):
        return None
    if len({len(h.temperature.values), len(h.off.values), len(h.on.values)}) != 1:
        return None
    sound = (
        strictly_increasing(f.current.values)
        and f.current.values[0] == 0.0
        and strictly_increasing(f.force.values)
        and f.force.values[0] > 0.0
        and min(*h.off.values, *h.on.values) > 0.0
        and 0.0 <= h.off_below.value <= h.on_above.value
    )
    if not sound:
        return None
    return static_tables(
        f.current.values,
        f.force.values,
        (0.0,),
        (0.0,),
        h.temperature.values,
        h.off.values,
        h.on.values,
        h.off_below.value,
        h.on_above.value,
    )
