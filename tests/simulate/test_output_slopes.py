"""Changes carried through the sensor are those that the sensor itself makes of a small step."""

from dataclasses import replace

import numpy as np
import pytest

from mrctl.model.effects.registry import effects
from mrctl.simulate.output_slopes import output_slopes
from mrctl.simulate.stages import measured

N, DT_S = 3000, 1e-3
T = np.arange(N) * DT_S
FORCE = 900.0 * np.tanh(np.sin(14.0 * T) / 0.3)
ROWS = np.stack([5.0 + np.cos(5.0 * T), np.random.default_rng(1).normal(size=N), np.zeros(N)])
DELAY = effects()["sensor_delay"]


@pytest.mark.parametrize("starts", [[0, N], [0, 1100, 1103, N]], ids=["one stretch", "one is short"])
@pytest.mark.parametrize("delays_s", [[0.0], [0.0123], [4.4e-3, 0.7e-3]])
def test_a_change_behind_the_sensor_is_that_of_a_step(delays_s, starts):
    starts = np.array(starts)
    chosen = [(DELAY, (delay_s,)) for delay_s in delays_s]
    carried = output_slopes(chosen, FORCE, DT_S, starts, ROWS)
    here = measured(chosen, FORCE, DT_S, starts)
    want = np.stack([measured(chosen, FORCE + row, DT_S, starts) - here for row in ROWS])
    assert np.max(np.abs(carried - want)) < 1e-9 * np.max(np.abs(FORCE))


def test_an_effect_that_is_not_said_to_be_linear_is_pushed_to_the_same():
    starts = np.array([0, 1700, N])
    pushed = output_slopes([(replace(DELAY, linear=False), (4.4e-3,))], FORCE, DT_S, starts, ROWS)
    assert np.allclose(pushed, output_slopes([(DELAY, (4.4e-3,))], FORCE, DT_S, starts, ROWS), atol=1e-6)
