"""What every current map ends with: the range and the slew limit of the current."""

from __future__ import annotations


def slewed(current_a: float, wanted_a: float, current_max_a: float, step_max_a: float) -> float:
    """The next current in A: towards the wanted one, within 0 and the largest, by at most one step."""
    change = min(max(wanted_a, 0.0), current_max_a) - current_a
    return current_a + min(max(change, -step_max_a), step_max_a)
