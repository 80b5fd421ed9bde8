from types import SimpleNamespace

import numpy as np
import pytest

from mrctl.discover import discover as module
from mrctl.identify.effects_fit import Effects
from mrctl.model.effects.registry import effects

HEATING = effects()["self_heating"]


def _found(verdict, warmer_k=0.0):
    look = SimpleNamespace(free=np.ones(len(HEATING.parameters), dtype=bool))
    one = SimpleNamespace(trial=SimpleNamespace(effect=HEATING, look=look), rivals=[], others=[])
    fit = SimpleNamespace(
        effect_values={HEATING.name: HEATING.typical}, model=SimpleNamespace(effects=Effects((HEATING,)))
    )
    evidence = SimpleNamespace(
        measured=[SimpleNamespace(warmer_k=warmer_k)], cell=SimpleNamespace(gains=np.zeros(1))
    )
    return SimpleNamespace(verdict=verdict, found=[one], final=SimpleNamespace(fit=fit), evidence=evidence)


def _extension(refused, rmse_after_n):
    return SimpleNamespace(refused=refused, rmse_after_n=rmse_after_n)


@pytest.mark.parametrize(
    ("verdict", "made", "taken"),
    [
        ("found", [_extension((), 9.0)], 0),
        ("warm", [_extension((), 9.0), _extension((), 8.0)], 1),
        ("warm", [_extension((), 9.0), _extension((), 10.0)], 0),
        ("found", [_extension((HEATING.name,), 9.0), _extension((), 5.0)], 1),
        ("found", [_extension((HEATING.name,), 9.0), _extension((HEATING.name,), 8.0)], 1),
        ("found", [_extension((HEATING.name,), 9.0), _extension((HEATING.name,), 10.0)], 0),
        ("unexplained", [_extension((HEATING.name,), 9.0)], 0),
    ],
)
def test_what_was_found_and_foretells_nothing_is_tried_without_what_the_runs_say_of_themselves(
    verdict, made, taken, monkeypatch
):
    asked = iter(made)
    monkeypatch.setattr(module, "extend", lambda *_, **__: next(asked))
    monkeypatch.setattr(module, "motion_parts", lambda _: None)
    found = _found("found", warmer_k=3.0) if verdict == "warm" else _found(verdict)
    assert module.extension_of(None, found) is made[taken]
    assert not list(asked)


def test_what_is_tried_again_goes_on_from_where_the_first_trial_was(monkeypatch):
    def told(*_, report=None, **__):
        if report is not None:
            report(0.0, "")
            report(1.0, "")
        return _extension((HEATING.name,), 9.0)

    monkeypatch.setattr(module, "extend", told)
    monkeypatch.setattr(module, "motion_parts", lambda _: None)
    shares = []
    module.extension_of(None, _found("found"), lambda share, _: shares.append(share))
    assert shares == pytest.approx([2.0 / 3.0, 1.0])  # from the last that one effect is told
