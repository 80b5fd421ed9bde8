"""What a campaign could not tell, in words."""

from __future__ import annotations

import numpy as np

from mrctl.identify.findings import _stretches


def test_currents_in_a_row_are_named_by_their_ends():
    current = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    vague = np.array([True, False, True, True, True, False, True])
    assert _stretches(current, vague) == ["0 A", "1 to 2 A", "3 A"]
    assert _stretches(current, ~vague) == ["0.5 A", "2.5 A"]
    assert _stretches(current, np.zeros(7, dtype=bool)) == []
