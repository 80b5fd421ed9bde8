"""The forward model: from motion, current and temperature to force (Eq. 5.2 into H(z), Fig. 7.1)."""

from __future__ import annotations

from mrctl.model.damper import Damper
from mrctl.model.filters import iir_step, settled_state
from mrctl.model.static import backbone_force


class ForwardModel:
    """One damper's force, sample by sample, at a fixed step."""

    __slots__ = ("_coefficients", "_state", "_static")

    def __init__(self, damper: Damper, dt_s: float) -> None:
        """Raises FilterError when the filter cannot be carried to 1/dt_s."""
        self._static = damper.static
        self._coefficients = damper.forward_filter.resampled(1.0 / dt_s).coefficients
        self._state = [0.0, 0.0, 0.0]

    def step(self, velocity_m_s: float, current_a: float, temperature_c: float) -> float:
        """The damper force in N at this sample."""
        back = backbone_force(velocity_m_s, current_a, temperature_c, self._static)
        return iir_step(self._coefficients, self._state, back)

    def settle(self, velocity_m_s: float, current_a: float, temperature_c: float) -> None:
        """Take the state that this motion, held for ever, would lead to."""
        back = backbone_force(velocity_m_s, current_a, temperature_c, self._static)
        self._state = settled_state(self._coefficients, back)
