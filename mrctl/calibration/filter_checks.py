"""Whether a calibration's filters can be used: stable, unit gain, to be carried to the loop's rates."""

from __future__ import annotations

import numpy as np

from mrctl.calibration.models import FilterBlock
from mrctl.model.filters import BAND_HZ, Filter, FilterError
from mrctl.yaml_source import Findings

LOOP_RATES_HZ = (500.0, 1000.0, 2000.0)
DC_TOLERANCE = 0.01

# A cascade of forward and inverse filter that is worse than this below 20 Hz deserves a warning.
CASCADE_GAIN_DB = 1.5
CASCADE_PHASE_DEG = 10.0


def check_filter(block: FilterBlock, key: str, findings: Findings) -> None:
    """Add what keeps this filter from being used."""
    rate = block.sample_rate.value
    try:
        f = Filter.of(rate, block.numerator, block.denominator)
    except FilterError as error:
        findings.add((key,), f"`{key}`: {error}", "give numerator and denominator in falling powers of z")
        return
    if not np.all(np.isfinite([*f.b, *f.a])):
        findings.add(
            (key, "denominator", 0),
            f"`{key}`: the first denominator coefficient is too small to divide by",
            "scale the denominator to begin with 1",
        )
        return
    if not f.is_stable():
        radius = float(np.max(np.abs(f.poles())))
        findings.add(
            (key, "denominator"),
            f"`{key}` is unstable: a pole of magnitude {radius:.4g} lies not inside the unit circle",
            _coefficient_mend(block, f),
        )
        return
    gain = f.dc_gain()
    if not abs(gain - 1.0) <= DC_TOLERANCE:
        findings.add(
            (key, "numerator"),
            f"`{key}` has the DC gain {gain:.4g}, not 1",
            _sign_slip(block) or "scale its numerator, so that f alone sets the force",
        )
        return
    for rate_hz in LOOP_RATES_HZ:
        try:
            f.resampled(rate_hz)
        except FilterError as error:
            findings.add(
                (key, "sample_rate"), f"`{key}` {error}", "identify it at 500 Hz or more, and smoother"
            )
            return


def cascade_error(forward: Filter, inverse: Filter, upper_hz: float = BAND_HZ) -> tuple[float, float]:
    """How far forward times inverse filter is from 1, from 0 to upper_hz: (dB, degrees)."""
    f = np.linspace(0.0, upper_hz, 201)
    product = forward.response(f) * inverse.response(f)
    gain_db = 20.0 * np.log10(np.maximum(np.abs(product), 1e-12))
    return float(np.max(np.abs(gain_db))), float(np.max(np.abs(np.angle(product, deg=True))))


def _coefficient_mend(block: FilterBlock, f: Filter) -> str:
    """What may have gone wrong in copying the denominator: a lost term, a turned sign, or neither."""
    if any(a == 0.0 for a in block.denominator[1:-1]):
        power = len(block.denominator) - 1 - block.denominator.index(0.0, 1)
        # Unit DC gain tells what the lost coefficient must be.
        lost = sum(block.numerator) - sum(block.denominator)
        return f"is its coefficient of z^{power} lost? {lost:.6g} gives unit DC gain"
    return _sign_slip(block) or f"check its digits; the static gain as it stands is {f.dc_gain():.4g}"


def _sign_slip(block: FilterBlock) -> str:
    """The mend when turning one sign makes the filter stable with unit gain; empty otherwise."""
    for index, coefficient in enumerate(block.denominator[1:], start=1):
        turned = list(block.denominator)
        turned[index] = -coefficient
        try:
            trial = Filter.of(block.sample_rate.value, block.numerator, turned)
        except FilterError:
            continue
        if sum(trial.a) and trial.is_stable() and abs(trial.dc_gain() - 1.0) <= DC_TOLERANCE:
            return f"is the sign of {coefficient:g} right? with {-coefficient:g} it is stable with DC gain 1"
    return ""
