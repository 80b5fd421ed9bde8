"""What a model leaves over the noise: how much of it is certain, and what is known of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.proof import Proof
from mrctl.discover.noise.indifference import APART_TWO_S, by_steepness, is_indifferent, swells
from mrctl.discover.noise.input_noise import steepness
from mrctl.discover.noise.lines import Line, hums_of, line_of, steady_noise
from mrctl.discover.noise.noise_floor import NoiseFloor
from mrctl.discover.noise.shared_motion import shared_n2
from mrctl.discover.noise.spectral_floor import mean_square
from mrctl.discover.verdict.courses import Course
from mrctl.discover.verdict.structure import Structure
from mrctl.discover.verdict.worth import LEAST_OF_FORCE, force_n2
from mrctl.identify.noise import SCALE

Array = NDArray[np.float64]

TRUE_TO = 2e-3  # of the force in RMS, what load cells are true to: without effects, less is nothing left
LEFT_OF_NOISE = 0.15  # of what is left, that maps may predict before it counts, ...
OF_SWELLING = (
    0.02  # of the force, what comes with its size and does not repeat: less, and a load cell's gain may
)
STRANGE = 0.05  # ... or a course that no effect has
IN_BURSTS, BURST = 0.4, 6.0  # of what is left in the usual record, beyond so many of its robust scales, ...
OF_MOTION = 3.0  # ... times what the motion's noise makes, which comes and goes as the damper is steep, ...
SLOW = 0.05  # ... and where it is faster than this share of its largest speed
OF_THE_MOTION = "with the measured motion's: what is left is louder where the damper is steep, nowhere else"
MOSTLY_BY_RUN = 0.5  # of what is left, that the runs' means must be to be told


@dataclass(frozen=True, slots=True)
class Balance:
    """Mean squares in N² at full rate: the model's, the noise's, and what of the difference is certain."""

    total: float
    noise: float
    measured: bool  # the noise, from cycle to cycle
    how: str  # the noise is known, in words
    left: float
    line: Line | None = None  # that stands out of the spectrum of what is left, and swells with the motion
    hums: Sequence[Line] = ()  # that do not: the measurement's own
    bursts: float = 0.0  # of moments that no noise has, where they are most of it
    courses: Sequence[Course] = ()  # that no effect has, of what is left; most first
    by_run: float = 0.0  # of the runs' means, where they are most of what is left
    swelling: float = 0.0  # of what does not repeat from cycle to cycle, but comes with the force
    alike: float = 0.0  # of what no signal tells, but runs of one motion leave alike

    @property
    def cleared(self) -> bool:
        """Whether nothing but noise is left."""
        return self.left <= 0.0


def balance_of(
    evidence: Evidence, final: Proof, left: Structure, courses: Sequence[Course], *, bare: bool = False
) -> Balance:
    """What a model leaves over the noise, beyond the doubt about the noise and the form of its tables.

    bare: no effect was found, and what no signal and no course predicts needs no effect to make up for it.
    Where it is as loud whatever the damper does, it is noise, however long that remembers itself.
    """
    budget = evidence.budget(final.fit)
    # What the motion's noise makes goes with the motion as measured: no signal tells it from physics.
    told = left.significant and not budget.drowned
    certain = [c for c in courses if c.certain and c.share > STRANGE and not budget.drowned]
    unknown = not told and not certain
    structured = left.explained_n2 if told and left.share > LEFT_OF_NOISE else 0.0
    rates = [r.rate_hz / r.finer for r in evidence.full]
    errors = evidence.steady_errors(final.fit)
    speeds = evidence.at_samples_of(errors, [r.velocity_m_s for r in evidence.full])
    hums, quiet = hums_of(errors, rates, speeds)
    repeated, errors = repeated_n2(evidence.floors, errors, quiet), quiet
    line = line_of(errors, rates)
    if line is not None and steady_noise(line, errors, rates, [r.force_n for r in evidence.full], speeds):
        hums, line = [*hums, line], None
    shaken = 0.0 if line is None else line.mean_square_n2
    strange = max((c.share for c in certain), default=0.0)
    over = budget.unseen if bare and unknown else budget.excess
    noise, how = budget.noise, budget.how
    if budget.measured:
        over = max(over - repeated, 0.0)
    if budget.drowned:
        over = budget.certain
    elif over > 0.0 and unknown and not budget.measured:
        signals = _signals(evidence, errors)
        if is_indifferent(errors, signals, rates):
            over = 0.0
        elif _is_of_the_motion(evidence, final, errors, signals, rates):
            over, noise, how = 0.0, budget.total, OF_THE_MOTION
    swelling = 0.0
    if bare and budget.measured:
        swelling = swells(errors, evidence.at_samples_of(errors, [r.force_n for r in evidence.full]))
    swelling = swelling if swelling > OF_SWELLING**2 * force_n2(final) else 0.0
    alike = 0.0
    if bare and unknown and not (budget.measured or budget.drowned):
        alike = shared_n2(errors, speeds)
        alike = alike if alike > LEFT_OF_NOISE * final.mean_square else 0.0
    over = max(over, swelling, structured, shaken, strange * final.mean_square, alike)
    least = (TRUE_TO if bare else LEAST_OF_FORCE) ** 2 * force_n2(final)
    bursts = bursts_n2(errors, speeds)
    if bursts < OF_MOTION * budget.brought:
        bursts = 0.0
    left_n2, bursts = (x if x > least else 0.0 for x in (over, bursts))
    by_run = mean_square([np.full(e.size, e.mean()) for e in errors])
    by_run = by_run if by_run > MOSTLY_BY_RUN * left_n2 > 0.0 else 0.0
    return Balance(
        budget.total,
        noise,
        budget.measured,
        how,
        left_n2,
        line,
        hums,
        bursts,
        courses,
        by_run,
        swelling,
        alike if left_n2 else 0.0,
    )


def _is_of_the_motion(
    evidence: Evidence,
    final: Proof,
    errors: Sequence[Array],
    signals: Sequence[Sequence[Array]],
    rates_hz: Sequence[float],
) -> bool:
    """Whether errors are as loud wherever the damper is as steep, as noise of load cell and motion is."""
    steep = evidence.at_samples_of(errors, steepness(final.fit, evidence.full))
    return is_indifferent(by_steepness(errors, steep), [*signals, steep], rates_hz, APART_TWO_S)


def _signals(evidence: Evidence, errors: Sequence[Array]) -> list[list[Array]]:
    """Speed in m/s, size of the force in N and current in A at the samples of errors."""
    speeds = [np.abs(r.velocity_m_s) for r in evidence.full]
    forces = [np.abs(r.force_n) for r in evidence.full]
    return [evidence.at_samples_of(errors, x) for x in (speeds, forces, [r.current_a for r in evidence.full])]


def repeated_n2(floors: Sequence[NoiseFloor], errors: Sequence[Array], quiet: Sequence[Array]) -> float:
    """The mean square in N² of hums that are the same in each cycle, in runs whose noise these tell.

    quiet: the errors (n each) without hums. What comes again as the motion does is not in the noise that is
    told by what does not, but it is the measurement's all the same.
    """
    found, samples = 0.0, 0
    for floor, error, rest in zip(floors, errors, quiet, strict=True):
        hum = error - rest
        unrepeated = floor.unrepeated(hum)
        if unrepeated is not None:
            found += max(float(hum @ hum) - hum.size * unrepeated, 0.0)
            samples += hum.size
    return found / max(samples, 1)


def bursts_n2(errors: Sequence[Array], speeds: Sequence[Array]) -> float:
    """The mean square in N² of moments that no noise has in errors (n each); 0 where they are few or small.

    speeds (n each): about standstill, where a damper is steep, noise of its motion makes none.
    """
    fast = [e[np.abs(v) > SLOW * np.max(np.abs(v))] for e, v in zip(errors, speeds, strict=True)]
    moving = [e for e in fast if e.any()]
    beyond = [np.where(np.abs(e) > BURST * SCALE * np.median(np.abs(e)), e, 0.0) for e in moving]
    shares = [float(b @ b) / float(e @ e) for b, e in zip(beyond, moving, strict=True)]
    return mean_square(beyond) if shares and float(np.median(shares)) > IN_BURSTS else 0.0
