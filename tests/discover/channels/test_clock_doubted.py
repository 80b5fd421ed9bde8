"""A current that seems late, since it is, or since what is missing makes it seem so: then it takes little."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mrctl.discover import diagnose as module

PLAIN, EARLY = (SimpleNamespace(records=name) for name in ("as written", "earlier"))


def _found(verdict, effects, left_n2, total):
    return SimpleNamespace(
        verdict=verdict,
        found=["one"] * effects,
        balance=SimpleNamespace(left=left_n2, total=total),
        base=SimpleNamespace(mean_square=100.0),
    )


@pytest.mark.parametrize(
    ("left_by_the_clock", "plain", "early", "asked", "chosen"),
    [
        (0.1, None, ("none", 0, 0.0, 10.0), [EARLY], EARLY),  # all that seemed missing was the clock's
        (0.1, ("found", 1, 0.0, 11.0), ("found", 1, 0.0, 10.0), [EARLY, PLAIN], EARLY),
        (0.1, ("found", 1, 0.0, 9.0), ("found", 1, 0.0, 10.0), [EARLY, PLAIN], PLAIN),
        (0.9, ("found", 1, 4.0, 11.0), None, [PLAIN], PLAIN),  # less is left than the clock took
        (0.9, ("found", 1, 30.0, 40.0), ("found", 1, 0.0, 10.0), [PLAIN, EARLY], EARLY),
        (0.9, ("unexplained", 1, 4.0, 11.0), ("found", 1, 0.0, 11.5), [PLAIN, EARLY], EARLY),
        (0.9, ("none", 0, 0.0, 11.0), ("none", 0, 0.0, 10.0), [PLAIN, EARLY], EARLY),
    ],
)
def test_both_clocks_are_asked_only_where_one_leaves_a_doubt(
    monkeypatch, left_by_the_clock, plain, early, asked, chosen
):
    said = {id(PLAIN): plain and _found(*plain), id(EARLY): early and _found(*early)}
    searched = []

    def search(one):
        searched.append(one)
        return said[id(one)]

    totals = {"as written": 50.0, "earlier": 50.0 * left_by_the_clock}
    monkeypatch.setattr(module, "fitted_to", lambda records, _: SimpleNamespace(total=totals[records]))
    found = module._of_either_clock(search, PLAIN, EARLY, SimpleNamespace(fit=None))
    assert searched == asked
    assert found is said[id(chosen)]
