from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrctl.report.quantity import (
    MISSING,
    format_column,
    format_duration,
    format_interval,
    format_number,
    format_quantity,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12.3456, "12.3"), (9.996, "10.0"), (0.001234, "0.00123"), (1234.5, "1234"), (0.0, "0"), (-0.0, "0"),
        (1.234e-5, "1.23e-05"), (2.5e6, "2.50e+06"), (40, "40"), (1234567, "1234567"), (-3.21, "-3.21"),
        (None, MISSING), (math.nan, MISSING), (math.inf, "∞"), (-math.inf, "-∞"), (np.int64(7), "7"),
        (np.float32(0.5), "0.500"),
    ],
)  # fmt: skip
def test_a_number_keeps_its_significant_figures(value: float | None, text: str) -> None:
    assert format_number(value) == text


@given(st.floats(min_value=1e-4, max_value=9.9e5), st.integers(min_value=1, max_value=6))
def test_a_written_number_is_within_half_a_unit_of_its_last_figure(value: float, digits: int) -> None:
    assert (
        abs(float(format_number(value, digits)) - value)
        <= 0.5000001 * 10 ** (math.floor(math.log10(value)) + 1 - digits)
        or value >= 10**digits
    )


@pytest.mark.parametrize(
    ("value", "unit", "si_prefix", "text"),
    [
        (12.34, "N", False, "12.3 N"), (55.0, "degC", False, "55.0 °C"), (0.4, "1", False, "0.400"),
        (None, "N", False, MISSING), (math.nan, "N", False, MISSING), (1.2e6, "N/m", True, "1.20 MN/m"),
        (0.0123, "s", True, "12.3 ms"), (3.5, "%", True, "3.50 %"), (0.02, "kg", True, "0.0200 kg"),
        (999.9, "N", True, "1.00 kN"), (math.inf, "N", False, "∞ N"), (0.0, "A", True, "0 A"),
    ],
)  # fmt: skip
def test_a_quantity_has_its_unit_and_on_wish_a_prefix(
    value: float | None, unit: str, *, si_prefix: bool, text: str
) -> None:
    assert format_quantity(value, unit, si_prefix=si_prefix) == text


def test_an_interval_sets_the_decimals_of_its_value() -> None:
    assert format_interval(481.23, 462.94, 499.52, "N·s/m") == "481 (463 … 500) N·s/m"
    assert format_interval(0.01234, 0.0119, 0.0128, "s") == "0.01234 (0.01190 … 0.01280) s"
    assert format_interval(2.0, None, 3.0, "A") == "2.00 A"
    assert format_interval(math.nan, 1.0, 2.0, "A") == MISSING
    assert format_interval(-0.001, -0.9, 0.9, "N") == "0.00 (-0.90 … 0.90) N"  # no -0.00


def test_numbers_below_each_other_share_their_decimals() -> None:
    assert format_column([38.1, 9.2, 2.6, None]) == ["38.1", "9.2", "2.6", MISSING]
    assert format_column([1.2, 1.34]) == ["1.20", "1.34"]
    assert format_column([4, 12, None]) == ["4", "12", MISSING]
    assert format_column([512.0, 0.0, math.nan]) == ["512", "0", MISSING]


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.82, "0.8 s"),
        (9.97, "10 s"),
        (59.6, "1 min 00 s"),
        (185, "3 min 05 s"),
        (7800, "2 h 10 min"),
        (None, MISSING),
    ],
)
def test_a_duration_reads_as_people_say_it(seconds: float | None, text: str) -> None:
    assert format_duration(seconds) == text
