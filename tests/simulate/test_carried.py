"""Many changes side by side are carried as each would be by itself."""

import numpy as np
import pytest
from effects.equations import TABLES

from mrctl.model.effects.registry import effects
from mrctl.simulate import stages
from mrctl.simulate.carried import carried, heard
from mrctl.simulate.step_slopes import StepSlopes, limit_slopes

N, DT_S = 2400, 1e-3
STARTS = np.array([0, 800, N])
T = np.arange(N) * DT_S
V = 0.2 * np.sin(14.0 * T) + 0.05 * np.sin(90.0 * T + 0.5)
X = -0.2 / 14.0 * np.cos(14.0 * T)
TEMPERATURE = 40.0 + 20.0 * T
FORCE = 900.0 * np.tanh(V / 0.03) + 400.0 * V
STATIC = 1000.0 * np.tanh(V / 0.05)


def _one_by_one(by, first, starts, inputs, beside, factor):
    outputs = by.shape[1] - first.shape[1]
    out = np.zeros((outputs, inputs.shape[0], inputs.shape[1]))
    for r in range(inputs.shape[0]):
        for j in range(starts.size - 1):
            second = beside[r] if r < beside.shape[0] else np.zeros(inputs.shape[1])
            both = np.stack([inputs[r], second])
            state = first[j] @ both[:, starts[j]]
            for k in range(starts[j], starts[j + 1]):
                y = by[k] @ np.concatenate([both[:, k], state])
                out[:, r, k], state = y[:outputs], y[outputs:]
    return out.reshape(*out.shape[:2], out.shape[2] // factor, factor).mean(axis=-1)


@pytest.mark.parametrize("rows", [0, 1, 7, 8, 9, 20])
@pytest.mark.parametrize(("states", "outputs", "factor"), [(0, 1, 1), (2, 1, 3), (3, 3, 2)])
def test_rows_are_carried_as_one_by_one(rows, states, outputs, factor):
    random, n = np.random.default_rng(rows), 48
    by = 0.4 * random.normal(size=(n, outputs + states, 2 + states))
    by[random.random(by.shape) < 0.3] = 0.0
    first, starts = random.normal(size=(2, states, 2)), np.array([0, 18, n])
    inputs, beside = random.normal(size=(rows, n)), random.normal(size=(min(rows, 3), n))
    want = _one_by_one(by, first, starts, inputs, beside, factor)
    assert carried(by, first, starts, inputs, beside, factor) == pytest.approx(want, rel=1e-9, abs=1e-12)
    assert carried(*heard(by, first), starts, inputs, beside, factor) == pytest.approx(
        want, rel=1e-9, abs=1e-12
    )


def test_a_stretch_that_begins_within_a_block_is_refused():
    with pytest.raises(ValueError, match="within a block"):
        carried(np.ones((12, 1, 2)), np.zeros((2, 0, 2)), np.array([0, 5, 12]), np.ones((1, 12)), factor=2)


def test_states_that_nothing_moves_or_hears_are_left_out():
    by = np.zeros((5, 4, 5))
    by[:, 0, 0] = by[:, 0, 2] = by[:, 1, 0] = 1.0  # the first state is moved and heard
    by[:, 2, 1] = 1.0  # the second is only moved
    by[:, 0, 4] = 1.0  # the third is only heard
    few, first = heard(by, np.zeros((1, 3, 2)))
    assert few.shape == (5, 2, 3)
    assert first.shape == (1, 1, 2)


def _alike(got, want):
    assert np.sqrt(np.mean((got - want) ** 2)) < 1e-3 * np.sqrt(np.mean(want**2))


@pytest.mark.parametrize("held", [0.0, 0.4, 1.0])
def test_a_change_behind_a_limit_is_that_of_a_small_step(held):
    limit = {
        "limit_n": 700.0,
        "knee_n": 60.0,
        "loss": 0.5,
        "closing_m": 2e-3,
        "rise_per_m": 2.0,
        "refilled": 0.3,
        "warming_per_k": 3e-3,
        "held": held,
        "leak_m_s": 0.02,
        "lag_s": 2e-3,
        "swing": 0.3,
        "firming_per_m": 5.0,
        "slack": 0.3,
        "filling_per_s": 20.0,
        "by_flow": 0.6,
        "most_m": 8e-3,
        "turning": 0.4,
    }
    cavitation = effects()["cavitation"]
    assert set(limit) == {p.name for p in cavitation.parameters}
    chosen = [(cavitation, cavitation.vector(limit))]
    rows = np.stack([np.cos(5.0 * T), FORCE / 900.0, *(np.sin(k * T) for k in range(3, 12))])
    before = np.stack([np.sin(2.0 * T), -FORCE / 600.0, *(np.cos(k * T) for k in range(3, 10))])
    level = np.full(T.size, 800.0)
    rest = V, X, TEMPERATURE
    got = limit_slopes(chosen, (FORCE, *rest, STATIC, level), TABLES, DT_S, STARTS, rows, before)
    small = 1e-3
    for k, (row, own) in enumerate(zip(rows, got, strict=True)):
        static = before[k] if k < len(before) else np.zeros(T.size)
        ends = (
            stages.limited(chosen, FORCE + by * row, *rest, STATIC + by * static, level, TABLES, DT_S, STARTS)
            for by in (small, -small)
        )
        _alike(own, np.subtract(*ends) / (2.0 * small))


@pytest.mark.parametrize(
    ("name", "p"),
    [
        ("viscous_damping", (400.0, 3e-3, 0.0, 0.005)),
        ("gas_spring", (200.0, 4000.0, 8.0, 0.1)),
        ("coulomb_friction", (60.0, 2e-3, 0.3, 0.02, 2e-3, 0.4)),
    ],
)
def test_a_change_of_a_force_beside_the_filter_is_that_of_a_small_motion(name, p):
    one = effects()[name]
    signals = np.gradient(V, DT_S), np.ones(N), np.full(N, 40.0)
    by_v, by_x = np.cos(5.0 * T)[None], 0.2 * np.sin(5.0 * T)[None]
    got = StepSlopes.along(one, p, (V, X, *signals), (0, 1), (TABLES, DT_S), STARTS).through(
        (0, 1), by_v, by_x, 2
    )
    small = 1e-6

    def force(by):
        return stages.additive(one, p, V + by * by_v[0], X + by * by_x[0], *signals, DT_S, STARTS)

    want = (force(small) - force(-small)) / (2.0 * small)
    _alike(got[0], want.reshape(-1, 2).mean(axis=1))


def test_where_nothing_moves_a_friction_has_no_wild_slopes():
    still = 1e-12 * np.random.default_rng(1).normal(size=N)
    one = effects()["coulomb_friction"]
    signals = still, np.full(N, 0.02), still, np.zeros(N), np.full(N, 30.0)
    rows = np.ones((1, N))
    slopes = StepSlopes.along(one, one.typical, signals, (0, 1), (TABLES, DT_S), STARTS)
    got = slopes.through((0, 1), rows, 0.0 * rows)
    assert np.all(np.abs(got) < 1e9)
