"""From a cell to SI: unit, scale, offset and sign as one straight line."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from mrctl.measurements.run import FloatArray
from mrctl.measurements.units import UNITS, units_of

_PER_VOLT = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S+?)\s*/\s*(m?V)\s*")


@dataclass(frozen=True, slots=True)
class Conversion:
    """SI value = factor * cell + offset."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, cells: FloatArray) -> FloatArray:
        """The cells (n,) in SI; untouched, to the last bit, where nothing is to be done."""
        if self.factor == 1.0 and self.offset == 0.0:
            return cells
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused as no measured value
            return self.factor * cells + self.offset


def conversion_of(
    si: str, unit: str | None, scale: float | str = 1.0, offset: float = 0.0, sign: int = 1
) -> Conversion:
    """The line behind `sign * (scale * cell + offset)` in `unit`, for a channel counted in `si`.

    `scale` may be given per volt, `10 mm/V`, which names the unit too. ValueError, "what; mend", where units
    do not fit.
    """
    factor, wanted = scale, unit
    if isinstance(scale, str):
        match = _PER_VOLT.fullmatch(scale)
        if match is None:
            raise ValueError(
                f"scale {scale!r} is not understood; write a number, or a number per volt like `10 mm/V`"
            )
        number, per_volt, volt = match.groups()
        if unit not in {None, "V", "mV", per_volt}:
            raise ValueError(f"unit {unit} does not go with scale {scale}; leave `unit` out")
        factor, wanted = float(number) * (1.0 if volt == "V" else 1e3), per_volt
    elif unit in {"V", "mV"}:
        raise ValueError(f"{unit} says nothing about {si}; write what a volt is, like scale: 10 {si}/V")
    known = UNITS.get(wanted or si)
    if known is None or known.si != si:
        raise ValueError(f"unit {wanted} is not understood here; it may be {', '.join(units_of(si))}")
    return Conversion(known.factor * sign * float(factor), known.factor * sign * offset + known.offset)


def unit_of_file(conversion: Conversion, unit: str, si: str) -> tuple[Conversion, str | None]:
    """`conversion` of a channel in `si` for which its file states `unit`; and that unit, where it is not SI.

    A unit that does not fit the channel (files state odd ones) changes nothing.
    """
    known = UNITS.get(unit)
    if known is None or known.si != si or (known.factor == 1.0 and known.offset == 0.0):
        return conversion, None
    return Conversion(known.factor * conversion.factor, known.factor * conversion.offset + known.offset), unit
