"""Of places where a model may settle as well, which are tried with all records."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover.fits import settle

HERE, BETTER, SAME, WORSE = (np.array([float(k)]) for k in range(4))
ENDS = {0.0: 50.0, 1.0: 40.0, 2.0: 50.0 - 1e-3, 3.0: 60.0}  # total costs on the few records


@pytest.fixture
def fit(monkeypatch):
    def few_fit(theta, **_):
        solution = SimpleNamespace(converged=True, last_gain=0.0)
        return SimpleNamespace(theta=theta + 0.5, total=ENDS[float(theta[0])], solution=solution)

    few = SimpleNamespace(fit=few_fit, records=[range(10)])
    model = SimpleNamespace(records=[range(100)], effects=SimpleNamespace(chosen=()))
    monkeypatch.setattr(settle, "sampled", lambda *_, **__: few)
    monkeypatch.setattr(settle, "in_processes", lambda what, of, _: [what(one) for one in of])
    return SimpleNamespace(model=model, theta=HERE, penalties=(), moving=np.ones(1, dtype=bool))


def test_only_those_that_end_lower_on_a_few_records_go_on_from_there(fit):
    assert settle._worth_going(fit, [SAME, BETTER, WORSE]) == [BETTER + 0.5]


def test_where_all_records_are_few_all_do(fit, monkeypatch):
    monkeypatch.setattr(settle, "sampled", lambda model, *_, **__: model)
    assert settle._worth_going(fit, [SAME, WORSE]) == [SAME, WORSE]
