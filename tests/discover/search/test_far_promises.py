"""A few records are fitted better by any model than all are: that is no effect's promise."""

from __future__ import annotations

from discover.hidden import rich

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.screen import Screen, reach_of
from mrctl.discover.fits.tangent import Tangent
from mrctl.discover.search.far_looks import far_points, promises
from mrctl.model.effects.registry import effects

LITTLE = 0.1  # of what the base leaves; a third of it comes off by the base's own steps


def test_what_the_base_itself_takes_off_a_few_records_is_not_promised():
    """A spring is missing, for which the base makes up in the strokes of a few runs, not in those of all."""
    spring = {"preload_n": 50.0, "stiffness_n_m": 6000.0, "progression_per_m": 1.0}
    evidence = Evidence.of(rich({"gas_spring": spring}))
    fit = evidence.base().fit
    tangent = Tangent.of(fit)
    screen = Screen(tangent, reach_of(fit.model))
    others = ("mount_compliance", "preyield_stiffness", "coulomb_friction", "cavitation")
    asked = far_points(screen, evidence.sized(effects()[name] for name in others))
    assert len(asked) == len(others)
    for effect, points in asked:
        assert tangent.few(effect) is not fit.model
        assert promises(screen, effect, points)[0].gain < LITTLE * 2.0 * fit.total


def test_far_points_that_end_alike_are_gone_on_with_once():
    """What tells them apart may not act in a campaign: each would be fitted to all records alike."""
    spring = {"preload_n": 50.0, "stiffness_n_m": 6000.0, "progression_per_m": 1.0}
    evidence = Evidence.of(rich({"gas_spring": spring}))
    fit = evidence.base().fit
    screen = Screen(Tangent.of(fit), reach_of(fit.model))
    ((effect, points),) = far_points(screen, evidence.sized([effects()["coulomb_friction"]]))
    once, twice = promises(screen, effect, points), promises(screen, effect, [*points, *points])
    assert [one.gain for one in once] == [one.gain for one in twice]
    assert len(once) <= len(points)
    costs = [one.gain for one in once]
    assert costs == sorted(costs, reverse=True)
