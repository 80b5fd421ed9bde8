"""Changes carried through the yield stage are those that the stage itself makes of a small step."""

from dataclasses import replace

import numpy as np
import pytest
from effects.equations import TABLES

from mrctl.model.effects.registry import effects
from mrctl.simulate.stages import yielding
from mrctl.simulate.step_slopes import limit_slopes, yield_chain, yield_slopes

N, DT_S = 3000, 1e-3
STARTS = np.array([0, 1100, N])
T = np.arange(N) * DT_S
V = 0.2 * np.sin(14.0 * T) + 0.05 * np.sin(90.0 * T + 0.5)
X = -0.2 / 14.0 * np.cos(14.0 * T)
LEVEL = 900.0 + 300.0 * np.sin(3.0 * T)
FORCE = LEVEL * np.tanh(V / 0.03)
SMALL = 1e-5


@pytest.mark.parametrize(
    "p",
    [
        (5e-4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0),
        (2e-4, 3e-7, 0.6, 0.7, 0.2, 0.4, 0.3, 0.2, 0.0, 0.0),
        (1e-3, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0),
        (2e-4, 3e-7, 0.0, 0.7, 0.2, 0.4, 0.0, 0.2, 0.7, 0.0),
    ],
    ids=["elastic", "all of it", "plastic", "held"],
)
@pytest.mark.parametrize("times", [1, 2], ids=["once", "two effects in a row"])
def test_a_change_behind_the_stage_is_that_of_a_small_step(p, times):
    chosen = [(effects()["preyield_stiffness"], p)] * times
    by_level = 50.0 * np.cos(5.0 * T)
    rows = np.stack([by_level * FORCE / LEVEL, LEVEL / np.cosh(V / 0.03)])
    chain = yield_chain(chosen, (FORCE, V, X, LEVEL), TABLES, DT_S, STARTS)
    carried = yield_slopes(chain, rows, by_level[None])

    def stage(small: float, k: int) -> np.ndarray:
        level = LEVEL + small * by_level if k == 0 else LEVEL
        return yielding(chosen, FORCE + small * rows[k], V, X, level, DT_S, STARTS)

    for k in range(2):
        want = (stage(SMALL, k) - stage(-SMALL, k)) / (2.0 * SMALL)
        assert np.sqrt(np.mean((carried[k] - want) ** 2)) < 1e-3 * np.sqrt(np.mean(want**2))
    assert np.sqrt(np.mean((carried[0] - rows[0]) ** 2)) > 0.01 * np.sqrt(np.mean(rows[0] ** 2))


def test_without_an_effect_changes_go_through_as_they_are():
    rows = np.ones((2, N))
    assert yield_slopes([], rows, rows[:1]) is rows


@pytest.mark.parametrize(
    "p",
    [
        (5e-4, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8),
        (1e-3, 0.0, 0.0, 0.0, 0.3, 0.2, 0.3, 0.0, 0.0, 0.0),
        (2e-4, 3e-7, 0.0, 0.7, 0.0, 0.0, 0.0, 0.2, 0.7, 0.0),
    ],
    ids=["a spring in series", "plastic", "held"],
)
def test_states_that_are_idle_move_nothing(p):
    effect = effects()["preyield_stiffness"]
    assert effect.idle(p)
    rows = np.stack([50.0 * np.cos(5.0 * T) * FORCE / LEVEL, LEVEL / np.cosh(V / 0.03)])
    level, along = 50.0 * np.cos(5.0 * T)[None], ((FORCE, V, X, LEVEL), TABLES, DT_S, STARTS)
    chains = (yield_chain([(one, p)], *along) for one in (effect, replace(effect, idle=None)))
    known, whole = (yield_slopes(chain, rows, level) for chain in chains)
    assert np.array_equal(known, whole)


@pytest.mark.parametrize("loss", [0.0, 0.5])
@pytest.mark.parametrize("held", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("lag_s", [0.0, 2e-3])
def test_states_of_a_cavity_that_are_idle_move_nothing(loss, held, lag_s):
    effect = effects()["cavitation"]
    given = {"limit_n": 600.0, "knee_n": 50.0, "loss": loss, "closing_m": 1e-3, "held": held, "lag_s": lag_s}
    p = effect.vector(given)
    rows = np.stack([50.0 * np.cos(5.0 * T) * FORCE / LEVEL, LEVEL / np.cosh(V / 0.03)])
    signals = FORCE, V, X, np.full(N, 25.0), FORCE, LEVEL
    known, whole = (
        limit_slopes([(one, p)], signals, TABLES, DT_S, STARTS, rows, rows)
        for one in (effect, replace(effect, idle=None))
    )
    assert np.array_equal(known, whole)
    assert not np.array_equal(known, rows)
