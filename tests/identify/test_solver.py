"""The solver in a narrow valley that bends, and with slopes that are alike."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.discover.fits.screen import _bounded_step
from mrctl.identify.penalties import Penalty
from mrctl.identify.solver import Normal, solve

FAR = np.full(2, np.inf)


class Valley:
    """Residuals (STEEP (y - x²), 1 - x): Rosenbrock's, and a good deal narrower."""

    STEEP = 300.0

    def residual(self, theta):
        return np.array([self.STEEP * (theta[1] - theta[0] ** 2), 1.0 - theta[0]])

    def slopes(self, theta):
        """Of the force, which is what the residual falls by."""
        return -np.array([[-2.0 * self.STEEP * theta[0], self.STEEP], [-1.0, 0.0]])

    def cost(self, theta):
        rest = self.residual(theta)
        return 0.5 * float(rest @ rest)

    def normal(self, theta):
        slopes = self.slopes(theta)
        return Normal(slopes.T @ slopes, slopes.T @ self.residual(theta), self.cost(theta))

    def bend(self, theta, step):
        second = np.array([2.0 * self.STEEP * step[0] ** 2, 0.0])  # of the force along the step
        return self.slopes(theta).T @ second


def test_a_step_that_follows_the_bend_gets_there_in_fewer():
    valley, start = Valley(), np.array([-1.9, 2.0])
    given = {"iterations": 500, "tolerance": 1e-12}
    plain = solve(valley.normal, valley.cost, start, -FAR, FAR, [], **given)
    bent = solve(valley.normal, valley.cost, start, -FAR, FAR, [], bend=valley.bend, **given)
    assert plain.theta == pytest.approx([1.0, 1.0], abs=1e-4)
    assert bent.theta == pytest.approx([1.0, 1.0], abs=1e-4)
    assert bent.iterations < 0.5 * plain.iterations


def test_a_bound_in_the_valley_holds():
    valley = Valley()
    found = solve(
        valley.normal, valley.cost, np.array([-1.9, 2.0]), -FAR, np.array([0.5, np.inf]), [],
        iterations=300, tolerance=1e-12, bend=valley.bend,
    )  # fmt: skip
    assert found.theta == pytest.approx([0.5, 0.25], abs=1e-3)
    assert found.held.tolist() == [True, False]


def test_a_start_from_afar_does_not_tell_when_a_step_is_no_longer_worth_it():
    valley, far = Valley(), np.array([-1.9, 200.0])
    share = 1e-6
    assert share * valley.cost(far) > 100.0  # more than any step along the valley wins
    found = solve(
        valley.normal, valley.cost, far, -FAR, FAR, [],
        iterations=300, tolerance=1e-12, share=share, bend=valley.bend,
    )  # fmt: skip
    assert found.converged
    assert found.theta == pytest.approx([1.0, 1.0], abs=1e-3)


def test_slopes_that_rounding_made_parallel_still_give_a_step():
    rows = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [0.5, -1.0, 2.0]])
    gram = rows @ rows.T
    gram[0, 0] -= 1e-8  # what differences of rounded forces leave: not even positive
    right = rows @ np.array([1.0, 1.0, 1.0])
    step = _bounded_step(gram, right, np.full(3, -10.0), np.full(3, 10.0))
    assert np.all(np.isfinite(step))
    assert rows.T @ step == pytest.approx(
        rows.T @ np.linalg.lstsq(rows.T, np.array([1.0, 1.0, 1.0]), rcond=1e-6)[0], abs=1e-3
    )


def test_a_fit_that_goes_on_elsewhere_asks_for_no_slopes_where_it_stops():
    valley, asked = Valley(), []

    def normal(theta):
        asked.append(theta.copy())
        return valley.normal(theta)

    start = np.array([-1.9, 2.0])
    given = {"iterations": 4, "tolerance": 1e-12}
    whole = solve(normal, valley.cost, start, -FAR, FAR, [], **given)
    slopes_at, asked = asked, []
    passing = solve(normal, valley.cost, start, -FAR, FAR, [], passing=True, **given)
    assert np.array_equal(passing.theta, whole.theta)
    assert np.array_equal(slopes_at[-1], whole.theta)
    assert np.array_equal(asked, slopes_at[:-1])


def test_a_prior_does_not_hold_up_a_fit_at_a_kink():
    """A switch between two currents moves the force only past one of them, where its prior leads."""
    steep, pulled = 1e4, Penalty("prior", np.array([[0.0, 1.0]]), np.array([2.0]), 1.0, adapts=False)

    def residual(theta):
        return np.array([3.0 - theta[0], steep * max(theta[1] - 1.0, 0.0)])

    def cost(theta):
        rest = residual(theta)
        return 0.5 * float(rest @ rest)

    def normal(theta):
        slopes = np.diag([1.0, -steep if theta[1] > 1.0 else 0.0])
        return Normal(slopes.T @ slopes, slopes.T @ residual(theta), cost(theta))

    found = solve(normal, cost, np.array([0.0, 1.0]), -FAR, FAR, [pulled])
    assert found.theta == pytest.approx([3.0, 1.0], abs=1e-4)


@pytest.mark.parametrize(
    ("known", "least", "most"), [(np.inf, 20, 20), (2.0, 20, 20), (0.5, 5, 19), (50.0, 20, 20)]
)
def test_a_fit_that_would_not_come_below_what_is_known_ends(known, least, most):
    """Each step goes a tenth of the way: from 100 it is at 1.5 after 20."""
    distance = np.sqrt(2.0 * 100.0)

    def cost(theta):
        return 0.5 * float((distance - theta[0]) ** 2)

    def normal(theta):
        return Normal(np.array([[10.0]]), distance - theta, cost(theta))

    found = solve(normal, cost, np.zeros(1), -FAR[:1], FAR[:1], [], iterations=20, known=known)
    assert least <= found.iterations <= most
    assert not found.converged
    assert cost(found.theta) == pytest.approx(100.0 * 0.9 ** (2 * found.iterations), rel=1e-3)
