"""Physics that no effect describes is seen for what it is, and beside a true effect nothing is seen."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from discover.hidden import among, few, one_current, rich
from scipy.signal import lfilter

from mrctl.discover.diagnose import diagnose
from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof
from mrctl.discover.reports.figures import diagnosis_figures
from mrctl.discover.verdict import balance as balances
from mrctl.discover.verdict.balance import STRANGE, bursts_n2
from mrctl.discover.verdict.courses import Course, courses_of
from mrctl.discover.verdict.judged import stranger
from mrctl.discover.verdict.structure import Structure, structure_of
from mrctl.discover.verdict.worth import force_n2
from mrctl.measurements.run import Campaign


def changed(campaign: Campaign, force) -> Campaign:
    """The campaign with what `force` makes of each run's own."""
    runs = tuple(replace(r, force_n=force(k, r)) for k, r in enumerate(campaign.runs))
    return replace(campaign, runs=runs)


def path(run):
    return np.cumsum(np.abs(run.velocity_m_s)) * run.dt_s


def since_turned(run):
    """The way from where the motion last turned."""
    turned, way, found = 0.0, path(run), []
    for before, v, here in zip(np.roll(run.velocity_m_s, 1), run.velocity_m_s, way, strict=True):
        turned = here if before * v < 0.0 else turned
        found.append(here - turned)
    return np.array(found)


def relaxed(run, time_s):
    """The stroke of a spring behind a dashpot, which gives way in that time."""
    keep = np.exp(-run.dt_s / time_s)
    gone = lfilter([1.0 - keep], [1.0, -keep], run.displacement_m, zi=[keep * run.displacement_m[0]])[0]
    return run.displacement_m - gone


def structure(run, rebuilt_s, broken_m):
    """What a fluid has of the structure that time builds and motion breaks, whole at first."""
    level, found = 1.0, []
    for speed in np.abs(run.velocity_m_s):
        found.append(level)
        level += run.dt_s * ((1.0 - level) / rebuilt_s - level * speed / broken_m)
    return np.array(found)


STRANGERS = {
    "is higher after a rest, until the motion has broken that down": lambda _, r: (
        r.force_n * (1.0 + 0.4 * structure(r, 0.7, 0.05))
    ),
    "has a stiffness that relaxes": lambda _, r: r.force_n + 4e3 * relaxed(r, 0.25) + 8e3 * relaxed(r, 0.02),
    "fades or grows with the path travelled": lambda _, r: r.force_n * (1.0 + 0.3 * np.exp(-path(r) / 0.1)),
    "fades or grows in the course of a run": lambda _, r: r.force_n * (1.0 + 0.2 * np.exp(-r.time_s / 1.0)),
    "has a stiffness that hangs on the current": lambda _, r: (
        r.force_n + 1e3 * r.displacement_m * r.current_a
    ),
    "has a friction or damping that hangs on the stroke": lambda _, r: (
        r.force_n + 3e3 * np.sqrt(np.abs(r.velocity_m_s)) * np.sign(r.velocity_m_s) * np.abs(r.displacement_m)
    ),
    "hangs on the way since the motion turned": lambda _, r: (
        r.force_n * (1.0 - 0.4 * np.interp(since_turned(r), [2e-4, 5e-4, 1e-3], [0.0, 1.0, 0.0]))
    ),
    "hangs on the stroke otherwise in rebound than in compression": lambda _, r: (
        r.force_n + 6.0 * np.abs(r.force_n) * r.displacement_m
    ),
}


@cache
def base_of(seed: int = 2) -> tuple[Evidence, Proof]:
    evidence = Evidence.of(rich(seed=seed))
    return evidence, evidence.base()


@pytest.mark.parametrize("words", STRANGERS)
def test_a_force_of_a_strange_course_is_seen_for_what_it_is(words):
    evidence = Evidence.of(changed(rich(), STRANGERS[words]))
    first, *_ = courses_of(evidence.base())
    assert first.words == words
    assert first.certain
    assert first.share > 0.3


def test_a_mass_is_no_stiffness_that_relaxes():
    base = Evidence.of(changed(rich(), lambda _, r: r.force_n + 4.0 * r.acceleration_m_s2)).base()
    (relaxing,) = (c for c in courses_of(base) if c.words == "has a stiffness that relaxes")
    assert relaxing.share < STRANGE


def test_noise_has_no_course():
    _, base = base_of()
    assert not [c for c in courses_of(base) if c.certain and c.share > STRANGE]


@pytest.mark.long
def test_a_force_that_fades_with_the_path_is_not_called_heating(monkeypatch):
    among(monkeypatch, "self_heating", "coulomb_friction")
    found = diagnose(changed(few(rich()), STRANGERS["fades or grows with the path travelled"]))
    assert (found.verdict, found.effects) == ("unexplained", ())
    figures = diagnosis_figures(found)
    assert figures["structure"]["courses"][0]["force"] == "fades or grows with the path travelled"
    assert "fades or grows with the path travelled" in figures["words"]


def course(words: str, share: float, gain: float, *alike: str, chance: float = 0.0) -> Course:
    return Course(words, share, gain, gain - 14.0, chance, 0.0, frozenset(alike))


WARMTH = SimpleNamespace(effect=SimpleNamespace(name="warmth"), parameters=2)


def proof(mean_square):
    """That a model leaves so much, in N², of a thousand samples."""
    return SimpleNamespace(
        mean_square=mean_square,
        inside=np.array([1000.0 * mean_square]),
        counts=np.array([1000.0]),
        colour=np.array([1.0]),
        independent=1000.0,
    )


@pytest.mark.parametrize(
    ("alone", "beside", "which"),
    [
        (course("fades", 0.92, 3000.0), (), "fades"),  # more than the effect takes, for its parameters
        (course("fades", 0.89, 2000.0), (), None),  # about as much, and gone beside it
        (course("fades", 0.89, 2000.0), (course("fades", 0.05, 50.0),), "fades"),  # and seen beside it
        (course("fades", 0.5, 700.0), (course("fades", 0.05, 50.0),), None),
        (course("fades", 0.92, 3000.0, "warmth"), (), None),  # the effect in another form
        (course("fades", 0.89, 2000.0), (course("fades", 0.05, 50.0, chance=0.1),), None),
        (course("fades", 0.89, 2000.0), (course("fades", 0.01, 50.0),), None),  # hardly any of it
    ],
)
def test_a_course_that_says_more_than_an_effect_takes_its_name_away(alone, beside, which):
    found = stranger(proof(100.0), proof(10.0), [(WARMTH, None)], [alone], beside)
    assert (found and found.words) == which


@pytest.mark.parametrize(("share", "which"), [(0.89, None), (0.899, "fades")])
def test_where_an_effect_leaves_but_noise_a_course_must_leave_as_little(share, which):
    """Nearly all of a large error may still be far from all of it: 11 N² are left, or 10.1, of 100."""
    alone = course("fades", share, 3000.0)
    found = stranger(proof(100.0), proof(10.0), [(WARMTH, None)], [alone], (), cleared=True)
    assert (found and found.words) == which


@pytest.mark.parametrize(
    ("share", "left", "unsaid_n2", "which"),
    [
        (0.5, 0.2, 3.0, "fades"),  # most of what is left unsaid, and more than half of what the effect takes
        (0.4, 0.2, 3.0, None),
        (0.5, 0.2, 4.0, None),
        (0.5, 0.2, np.inf, None),  # next to nothing is left unsaid
    ],
)
def test_an_effect_stands_in_for_the_course_that_it_leaves_unsaid(share, left, unsaid_n2, which):
    alone, beside = course("fades", share, 700.0), (course("fades", left, 50.0),)
    found = stranger(proof(100.0), proof(10.0), [(WARMTH, None)], [alone], beside, unsaid_n2)
    assert (found and found.words) == which


def test_bursts_are_no_noise():
    rng = np.random.default_rng(4)
    speeds = [np.sin(np.arange(4000) / 50.0)] * 5
    noise = [rng.normal(0.0, 5.0, 4000) for _ in range(5)]
    assert bursts_n2(noise, speeds) == 0.0
    struck = [n + 300.0 * (rng.random(n.size) < 0.002) for n in noise]
    assert bursts_n2(struck, speeds) == pytest.approx(300.0**2 * 0.002, rel=0.3)
    assert bursts_n2([*noise[:3], *struck[3:]], speeds) == 0.0  # two runs of five
    assert bursts_n2(struck, [np.zeros(4000)] * 5) == 0.0
    steep = [
        n + 50.0 * rng.normal(size=n.size) * (np.abs(v) < 0.02) for n, v in zip(noise, speeds, strict=True)
    ]
    assert bursts_n2(steep, speeds) == 0.0  # a noisy motion where the damper is steep


@pytest.mark.parametrize("zero_m", [0.0, 0.15])
def test_where_the_stroke_has_its_zero_is_no_course(zero_m):
    """An asymmetry is missing: wherever the stroke's zero lies, no stiffness hangs on the current."""
    plain = rich(
        {
            "rebound_asymmetry": {
                "compression_change": 0.0,
                "compression_change_per_a": -0.1,
                "bend_per_a": 0.0,
            }
        }
    )
    moved = replace(
        plain, runs=tuple(replace(r, displacement_m=r.displacement_m + zero_m) for r in plain.runs)
    )
    found = {c.words: c for c in courses_of(Evidence.of(moved).base())}
    assert not found["has a stiffness that hangs on the current"].certain


def test_what_one_run_says_against_all_others_is_no_course():
    """A force that fades in one run of fourteen only: of many samples, but of one witness."""
    odd = changed(rich(), lambda k, r: r.force_n * (1.0 + 0.3 * (k == 3) * np.exp(-r.time_s / 0.5)))
    fading = next(c for c in courses_of(Evidence.of(odd).base()) if "course of a run" in c.words)
    assert fading.share > STRANGE
    assert fading.disagreement > 0.01
    assert not fading.certain


def test_nothing_hangs_on_what_does_not_change():
    """One current and one temperature: a spring is no stiffness that hangs on them."""
    plain = one_current({"gas_spring": {"preload_n": 0.0, "stiffness_n_m": 6000.0, "progression_per_m": 0.0}})
    still = replace(plain, runs=tuple(replace(r, temperature_c=np.full(len(r), 40.0)) for r in plain.runs))
    hanging = [
        c for c in courses_of(Evidence.of(still).base()) if "current" in c.words or "warmer" in c.words
    ]
    assert hanging
    assert all(c.share == 0.0 for c in hanging)


@pytest.mark.long
def test_a_load_cell_that_is_struck_is_not_called_sound():
    def struck(k, run):
        rng = np.random.default_rng(k)
        return run.force_n + 400.0 * (rng.random(run.force_n.size) < 0.003) * rng.choice([-1.0, 1.0])

    found = diagnose(changed(few(rich()), struck))
    assert found.verdict == "unexplained"
    assert "bursts" in diagnosis_figures(found)["words"]


@pytest.mark.parametrize(("brought", "counts"), [(0.0, True), (100.0, False)])
def test_bursts_of_the_motion_s_own_noise_are_not_the_load_cell_s(monkeypatch, brought, counts):
    """A damper that is steep makes bursts of a noisy motion: here 150 N², beside `brought` of the motion."""
    evidence, base = base_of()
    budget = evidence.budget(base.fit)
    monkeypatch.setattr(Evidence, "budget", lambda *_: replace(budget, brought=brought))
    monkeypatch.setattr(balances, "bursts_n2", lambda *_: 150.0)
    left = structure_of(base.fit, evidence.folds)
    assert bool(balances.balance_of(evidence, base, left, []).bursts) is counts


@pytest.mark.parametrize(("share", "counts"), [(0.5, True), (1.0, False)])
def test_what_the_motion_s_noise_may_make_alone_is_no_structure(monkeypatch, share, counts):
    """share: of what is left, that the motion's noise makes, which goes with the motion as measured."""
    evidence, base = base_of()
    budget = evidence.budget(base.fit)
    noisy = replace(budget, brought=share * budget.judged, most_noise=budget.judged, certain=0.0)
    monkeypatch.setattr(Evidence, "budget", lambda *_: noisy)
    left = Structure(budget.judged, 0.3 * budget.judged, 0.01 * budget.judged, ())
    assert (balances.balance_of(evidence, base, left, []).left > 0.0) is counts


def test_what_repeats_beside_as_much_of_the_motion_s_noise_is_not_certain(monkeypatch):
    """A fit to a noisy motion is blurred where the damper is steep, and misses the same in each cycle."""
    evidence, base = base_of()
    budget = evidence.budget(base.fit)
    budget = replace(budget, measured=True, most_noise=0.5 * budget.judged, certain=0.0)
    nothing = Structure(budget.judged, 0.0, 0.0, ())
    for brought, counts in ((0.0, True), (1.1 * budget.judged, False)):
        noisy = replace(budget, brought=brought)
        monkeypatch.setattr(Evidence, "budget", lambda *_, noisy=noisy: noisy)
        assert (balances.balance_of(evidence, base, nothing, [], bare=True).left > 0.0) is counts


@pytest.mark.parametrize(("share", "counts"), [(0.01, False), (0.2, True)])
def test_a_course_of_next_to_nothing_makes_no_more_of_what_may_be_noise(monkeypatch, share, counts):
    """Of 4000 N² 2800 or up to 3400 are noise: the rest counts where a course says that it is none."""
    evidence, base = base_of()
    budget = replace(evidence.budget(base.fit), judged=4000.0, noise=2800.0, most_noise=3400.0)
    budget = replace(budget, measured=False, certain=0.0, brought=0.0)
    monkeypatch.setattr(Evidence, "budget", lambda *_: budget)
    monkeypatch.setattr(balances, "is_indifferent", lambda *_: False)
    nothing = Structure(budget.judged, 0.0, 0.0, ())
    found = balances.balance_of(evidence, base, nothing, [course("fades", share, 3000.0)], bare=True)
    assert (found.left > 0.0) is counts


@pytest.mark.parametrize(("of_force", "counts"), [(1.5e-3, False), (3e-3, True)])
@pytest.mark.parametrize("named", [False, True])
def test_less_than_a_load_cell_is_true_to_needs_no_explanation(monkeypatch, of_force, counts, named):
    """of_force: what is certainly left of the force, in RMS; where an effect is named, that it is not all."""
    evidence, base = base_of()
    left_n2 = of_force**2 * force_n2(base)
    budget = replace(evidence.budget(base.fit), certain=left_n2, brought=0.0)
    budget = replace(budget, most_noise=budget.judged)
    monkeypatch.setattr(Evidence, "budget", lambda *_: budget)
    monkeypatch.setattr(balances, "is_indifferent", lambda *_: False)
    nothing = Structure(budget.judged, 0.0, 0.0, ())
    balance = balances.balance_of(evidence, base, nothing, [], bare=not named)
    assert (balance.left > 0.0) is (counts or named)
