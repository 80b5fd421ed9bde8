"""The hysteresis filter has more than one valley: fits begun anew with plain lags, and the best of them."""

from __future__ import annotations

from typing import Final

from mrctl.identify import hysteresis
from mrctl.identify.joint import JointFit
from mrctl.model.filters import ORDER

LAGS_HZ: Final = (5.0, 15.0, 40.0)
STEPS: Final = 10  # from each of them
TOLERANCE: Final = 1e-3  # share of the cost that another step must win


def from_other_lags(fit: JointFit) -> JointFit:
    """The best of a fit and those that begin with its tables and effects behind a plain lag."""
    model = fit.model
    part = model.layout.parts["filter"]
    if model.layout.order < ORDER:
        return fit
    free = ~fit.solution.held
    free[: model.layout.size] = True
    found = fit
    for hz in LAGS_HZ:
        theta = fit.theta.copy()
        theta[part] = hysteresis.lag(hz)
        other = model.fit(
            theta,
            penalties=fit.penalties,
            free=free & model.free(),
            rounds=1,
            iterations=STEPS,
            tolerance=TOLERANCE,
        )
        if other.total < found.total:
            found = other
    return found
