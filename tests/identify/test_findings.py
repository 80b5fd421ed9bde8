"""What a campaign could not tell, in words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from identify.test_portable import DRIFT

from mrctl.identify import hysteresis
from mrctl.identify.findings import _carried, _stretches
from mrctl.identify.portable import portable


def test_currents_in_a_row_are_named_by_their_ends():
    current = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    vague = np.array([True, False, True, True, True, False, True])
    assert _stretches(current, vague) == ["0 A", "1 to 2 A", "3 A"]
    assert _stretches(current, ~vague) == ["0.5 A", "2.5 A"]
    assert _stretches(current, np.zeros(7, dtype=bool)) == []


@pytest.mark.parametrize(("theta", "told"), [(hysteresis.lag(15.0), False), (DRIFT, True)])
def test_a_filter_that_is_not_the_fit_s_is_told(theta, told):
    fit = SimpleNamespace(tables=SimpleNamespace(filter=theta))
    found = _carried(fit, SimpleNamespace(forward_filter=portable(theta, 1000.0)))
    assert [f.part for f in found] == ["H"] * told
