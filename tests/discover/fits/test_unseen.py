"""Which runs share a motion, and whether effects foretell motions that were left out."""

from hidden import one_frequency, rich

from mrctl.discover.fits.refit import fitted, with_one_more
from mrctl.discover.fits.unseen import MOST_PARTS, Unseen, motion_parts
from mrctl.identify.records import records_of
from mrctl.model.effects.registry import effects

SPRING = {"preload_n": 0.0, "stiffness_n_m": 4000.0, "progression_per_m": 0.0}


def test_runs_of_one_motion_are_left_out_together():
    runs = rich().runs
    parts = motion_parts(records_of(runs))
    by_motion = {run.name: set() for run in runs if run.name.startswith("steps")}
    by_motion |= {run.name.split("_")[0]: set() for run in runs if "Hz" in run.name}
    for run, part in zip(runs, parts, strict=True):
        by_motion[run.name if run.name in by_motion else run.name.split("_")[0]].add(part)
    assert len(by_motion) == 5
    assert all(len(own) == 1 for own in by_motion.values())
    assert set(parts) == set(range(MOST_PARTS))


def test_one_motion_cannot_be_left_out():
    records = records_of(one_frequency().runs)
    assert motion_parts(records) is None
    assert Unseen.of(fitted(records, (), {}), records, records) is None


def test_a_true_effect_foretells_motions_that_it_was_not_fitted_to():
    runs = rich({"gas_spring": SPRING}).runs
    records = records_of([r for r in runs if "Hz_0A" in r.name or "Hz_3A" in r.name])
    spring = effects()["gas_spring"]
    fit = fitted(records, (), {})
    sprung = with_one_more(fit, records, spring, (*SPRING.values(), 0.0))
    plain, with_spring = (Unseen.of(one, records, records) for one in (fit, sprung))
    assert with_spring.level < plain.level - 0.5
    assert len(plain.errors_n) == 3
