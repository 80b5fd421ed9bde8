"""Many effects that explain little are told as such as they were found: none of them can be named."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mrctl.discover.verdict.stands import by_rounds, in_vain

BASE_N2, NOISE_N2 = 800.0, 10.0
EVIDENCE = SimpleNamespace(budget=lambda fit: SimpleNamespace(excess=fit - NOISE_N2))


def _proof(mean_square: float) -> SimpleNamespace:
    return SimpleNamespace(mean_square=mean_square, fit=mean_square)


@pytest.mark.parametrize(
    ("found", "left_n2", "vain"),
    [(3, 130.0, True), (4, 130.0, True), (2, 130.0, False), (3, 40.0, False), (3, NOISE_N2, False)],
)
def test_more_than_two_that_leave_more_than_a_tenth_are_in_vain(found, left_n2, vain):
    assert in_vain(EVIDENCE, _proof(BASE_N2), _proof(left_n2), found) is vain


def test_each_stands_in_the_round_that_it_was_found_in():
    first, second, other = (SimpleNamespace(name=name) for name in ("first", "second", "other"))
    rounds = [SimpleNamespace(trials=[first, other]), SimpleNamespace(trials=[other, second])]
    assert by_rounds([second, first], rounds) == [(second, rounds[1]), (first, rounds[0])]
