"""A round in which nothing was found is searched once more from a valley that is worth it only."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.search import rounds
from mrctl.discover.search.levels import Level
from mrctl.discover.verdict.worth import least_accepted_n2

WHOLE, LEFT_N2, FORCE_N = 4e4, 100.0, np.full(1000, 500.0)
EVIDENCE = SimpleNamespace(folds=(), budget=lambda _fit: SimpleNamespace(excess=0.0))


def _model(total: float) -> SimpleNamespace:
    model = SimpleNamespace(records=[SimpleNamespace(force_n=FORCE_N)])
    return SimpleNamespace(fit=SimpleNamespace(total=total, model=model), mean_square=LEFT_N2)


LEAST = 0.5 * WHOLE * least_accepted_n2(_model(0.0)) / LEFT_N2  # of log-likelihood, to be an effect


@pytest.mark.parametrize(
    ("won", "searched"),
    [(0.0, 1), (0.1 * LEAST, 1), (0.4 * LEAST, 2), (3.0 * LEAST, 2)],
    ids=lambda x: f"{x:g}",
)
def test_a_valley_is_searched_where_what_it_wins_is_near_an_effect_s(won, searched, monkeypatch):
    ends = [WHOLE / 2 - won] * 2
    begun = []

    def search_level(before, *_):
        begun.append(before.fit.total)
        return Level(_model(ends[len(begun) - 1]), WHOLE, [], [])

    monkeypatch.setattr(rounds, "search_level", search_level)
    level, good = rounds._round(EVIDENCE, _model(WHOLE / 2), [], lambda _proof: False)
    assert not good
    assert len(begun) == searched
    assert begun[-1] == (WHOLE / 2 if searched == 1 else ends[0])
    assert level.before.fit.total == ends[0]
