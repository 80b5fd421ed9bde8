"""A velocity column that is the file's own stroke, differentiated and smoothed: told by its noise.

Smoothing takes off a differentiated stroke's noise, and with it the corners of the motion, where a damper is
steep: what it took would seem to be missing from the damper. Two sensors share the motion but not their
noise; a column made from the other shares both, at every frequency. Then the share H(f) that it kept is
known, and with it what it is worth: of a motion of density S in differentiated noise of density N, it misses
|1 - H|² S + |H|² N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrctl.measurements.derivative import differentiate, noise_sigma
from mrctl.measurements.run import KINEMATICS, FloatArray, Run
from mrctl.measurements.shared_spectra import ComplexArray, can_be_shared, rounding_density, shared

ROUNDING = 30.0  # times a column's rounding: less says nothing
SAME = 0.985  # coherence of what shares its noise
NOISY = 1.5  # times the stroke's white noise: less is noise for the most part
SMOOTHED = 0.7  # share of that noise that is kept, at most
FEWEST = 5  # frequencies
BETTER = 0.9  # of the mean square that the column misses, to be derived anew
NOTE = "velocity_m_s is displacement_m differentiated and smoothed too much: derived anew"
_DERIVED = {"velocity_m_s", "displacement_m"}


@dataclass(frozen=True, slots=True)
class Missed:
    """What a velocity misses of a run's motion, in sums of squares over frequency."""

    bent: float  # of the motion itself
    noise: float  # and what the stroke's noise adds

    @property
    def whole(self) -> float:
        """Both together."""
        return self.bent + self.noise


def less_smoothed(runs: Sequence[Run]) -> list[Run]:
    """The runs, their velocity derived anew where that column is the stroke's, smoothed too much.

    One program made it in all runs: they decide together, so that all have noise of one kind. A run that does
    not tell goes with the others.
    """
    asked = [k for k, run in enumerate(runs) if not run.averaged_s and not _DERIVED & set(run.derived)]
    made = [
        made_of_stroke(runs[k].velocity_m_s, runs[k].displacement_m, 1.0 / runs[k].sample_rate_hz)
        for k in asked
    ]
    told = [pair for pair in made if isinstance(pair, tuple)]
    if not told or made.count(False) > len(told):
        return list(runs)
    kept, anew = (
        Missed(sum(m.bent for m in own), sum(m.noise for m in own)) for own in zip(*told, strict=True)
    )
    if not (anew.bent < kept.bent and anew.whole < BETTER * kept.whole):
        return list(runs)
    return [_anew(run) if k in asked else run for k, run in enumerate(runs)]


def made_of_stroke(
    velocity_m_s: FloatArray, displacement_m: FloatArray, dt_s: float
) -> tuple[Missed, Missed] | bool | None:
    """What the velocity (n) misses where it is the displacement (n) smoothed, and what it would derived anew.

    False where it is not; None where the run does not tell.
    """
    v, x = velocity_m_s, displacement_m
    if not can_be_shared(v, x):
        return None
    raw = np.gradient(x, dt_s)
    f, kept, alike, power = shared(v, raw, dt_s)
    noise = 2.0 * dt_s * (noise_sigma(x) * np.sin(2.0 * np.pi * f * dt_s) / dt_s) ** 2
    shown = power * np.abs(kept) ** 2 > ROUNDING * rounding_density(v, dt_s)
    told = shown & (power < NOISY * noise)
    if np.count_nonzero(told) < FEWEST:
        return None
    if float(np.median(alike[told])) < SAME or float(np.median(np.abs(kept[told]))) > SMOOTHED:
        return False
    _, anew, _, _ = shared(differentiate(x, dt_s), raw, dt_s)
    motion = np.maximum(power - noise, 0.0)

    def missed(share: ComplexArray) -> Missed:
        bent, noisy = np.abs(1.0 - share) ** 2 @ motion, np.abs(share) ** 2 @ noise
        return Missed(float(bent), float(noisy))

    return missed(kept), missed(anew)


def _anew(run: Run) -> Run:
    """The run with its velocity, and its acceleration if that was made of it, from its displacement."""
    dt_s = 1.0 / run.sample_rate_hz
    x, own = run.displacement_m, "acceleration_m_s2" not in run.derived
    return replace(
        run,
        velocity_m_s=differentiate(x, dt_s),
        acceleration_m_s2=run.acceleration_m_s2 if own else differentiate(x, dt_s, order=2),
        derived=tuple(name for name in KINEMATICS if name in {*run.derived, "velocity_m_s"}),
        notes=(*run.notes, NOTE),
    )
