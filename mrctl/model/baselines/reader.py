"""Reader's inverse (Eq. 3.1 to 3.4): separable at one temperature, behind a first-order lead.

    F_back = (s + a)/a * b/(s + b) F_wish         Eq. 3.4, corrected: unit gain at 0 Hz, b > a
    i = i_max                  F_back/g above f(i_max)
        f^-1(F_back / g)       F_back/g > 0                Eq. 3.3
        0                      F_back/g <= 0

f and g are the damper's, at room temperature (h = 1). `a` is the corner of the first-order low-pass that is
nearest to the damper's hysteresis filter (Eq. 6.5). Where g is 0 the quotient has no value and the current
is 0. The first two lines of Eq. 3.3 can both hold for a large force that would drive; 0 A is right there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mrctl.model.baselines.slew import slewed
from mrctl.model.damper import Damper
from mrctl.model.filters import Filter, iir_step, settled_state
from mrctl.model.static_inverse import Reach
from mrctl.model.tables import interpolate

LEAD_RATIO = 5.0  # b / a; the same largest gain as the inverse filter of Eq. 8.2


def nearest_lowpass_rad_s(hysteresis: Filter, upper_hz: float = 100.0) -> float:
    """The corner a in rad/s of a/(s + a) that is nearest to the filter in the least-squares sense (Eq. 6.5).

    The complex responses are compared from 0 to upper_hz, above which race dampers damp little.
    """
    f = np.linspace(0.0, upper_hz, 401)
    target = hysteresis.response(f)
    s = 2j * np.pi * f

    def misfit(log_corner: float) -> float:
        corner = math.exp(log_corner)
        return float(np.sum(np.abs(corner / (s + corner) - target) ** 2))

    low, high = math.log(2.0 * math.pi * 0.5), math.log(2.0 * math.pi * 1000.0)
    starts = np.linspace(low, high, 101)
    best = min(starts, key=misfit)
    width = starts[1] - starts[0]
    for _ in range(6):  # each round narrows the search tenfold
        best = min(np.linspace(best - width, best + width, 21), key=misfit)
        width /= 10.0
    return math.exp(best)


def lead_filter(corner_rad_s: float, ratio: float, sample_rate_hz: float) -> Filter:
    """(s + a)/a * b/(s + b), b = ratio a, through Tustin's rule: gain 1 at 0 Hz, `ratio` far above b."""
    k = 2.0 * sample_rate_hz
    a, b = corner_rad_s, ratio * corner_rad_s
    return Filter.of(sample_rate_hz, (ratio * (k + a), ratio * (a - k)), (k + b, b - k))


class ReaderInverse:
    """One damper's current by Reader's inverse, sample by sample."""

    __slots__ = (
        "_current_max_a",
        "_lead",
        "_lead_state",
        "_static",
        "_step_max_a",
        "_strongest_n",
        "current_a",
        "reach",
    )

    def __init__(self, damper: Damper, dt_s: float, parameters: Mapping[str, float] | None = None) -> None:
        """parameters: corner_hz, a in Hz, 0 fits it to the damper; lead_ratio, b over a, above 1."""
        given = parameters or {}
        corner_rad_s = 2.0 * math.pi * given.get("corner_hz", 0.0) or nearest_lowpass_rad_s(
            damper.forward_filter
        )
        self._static = damper.static
        self._current_max_a = damper.current_max_a
        self._step_max_a = damper.current_slew_a_s * dt_s
        self._strongest_n = interpolate(damper.current_max_a, self._static.current_a, self._static.force_n)
        self._lead = lead_filter(corner_rad_s, given.get("lead_ratio", LEAD_RATIO), 1.0 / dt_s).coefficients
        self.reset()

    def reset(self, force_wish_n: float = 0.0, current_a: float = 0.0) -> None:
        """Take the state that a constant wish leads to, with this current flowing."""
        self._lead_state = settled_state(self._lead, force_wish_n)
        self.current_a = current_a
        self.reach = Reach.WITHIN

    def step(self, force_wish_n: float, velocity_m_s: float, temperature_c: float) -> float:  # noqa: ARG002  # interface
        """The current command in A: within 0 and the largest, within the slew limit of the last."""
        static = self._static
        back = iir_step(self._lead, self._lead_state, force_wish_n)
        g = interpolate(velocity_m_s, static.velocity_m_s, static.shape)
        if back * g <= 0.0:
            wanted, self.reach = 0.0, Reach.WITHIN if back == 0.0 else Reach.BELOW
        elif abs(back) > self._strongest_n * abs(g):
            wanted, self.reach = self._current_max_a, Reach.ABOVE
        else:
            wanted = interpolate(back / g, static.force_n, static.current_a)
            self.reach = Reach.BELOW if back / g < static.force_n[0] else Reach.WITHIN
        self.current_a = slewed(self.current_a, wanted, self._current_max_a, self._step_max_a)
        return self.current_a
