"""The next run to make: the one in which the rivals differ most, beyond what either could adapt.

Each proposal is simulated with the found model. Its rival is allowed to adapt all that the campaign leaves
open, signs too; what then still differs, in units of the noise, is how clearly the run would tell them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.effects_fit import Effects
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.penalties import total_weight, weighed_as
from mrctl.identify.records import Record
from mrctl.identify.solver import scaled_solution
from mrctl.model.effects.base import Effect

Array = NDArray[np.float64]

SECONDS, RATE_HZ, RAMP_S = 4.0, 500.0, 0.5
CYCLES = 4.0  # at least: of fewer, a displacement derived from the velocity is not to be trusted
FREQUENCIES_HZ = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
STROKE_SHARES = (1.0, 0.5, 0.2)
OPEN = 1e-10  # ridge for what the campaign leaves open, of each parameter's own information
CLEAR = 5.0  # standard deviations that count as clear


@dataclass(frozen=True, slots=True)
class NextRun:
    """A run to make, and how clearly (in standard deviations) it separates the worst pair of rivals."""

    amplitude_m: float
    frequency_hz: float
    current: str
    temperature_c: float
    seconds: float
    separation: float
    separates: tuple[str, ...]
    why: str
    record: Record

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "motion": "sine",
            "amplitude_m": self.amplitude_m,
            "frequency_hz": self.frequency_hz,
            "current": self.current,
            "temperature_c": self.temperature_c,
            "seconds": self.seconds,
            "separation_sigma": self.separation,
            "separates": list(self.separates),
            "why": self.why,
        }


def propose(
    fit: JointFit, chosen: Effect, rivals: Sequence[Effect], colour: float, *, other_current: bool = False
) -> NextRun | None:
    """The best next run within the speeds, strokes, currents and temperatures of the campaign.

    fit: base with `chosen`; colour: samples that count as one; other_current: only a current that is not the
    campaign's one tells them apart. None where no run would separate them.
    """
    best: NextRun | None = None
    others = [_Alternative(fit, chosen, rival) for rival in rivals]
    high = max(float(r.current_a.max()) for r in fit.model.records)
    for amplitude, hz, current, record in _proposals(fit.model):
        if other_current and float(record.current_a.min()) == high:
            continue
        scores = [other.separation(record) / np.sqrt(colour) for other in others]
        if best is None or min(scores) > best.separation:
            names = (chosen.name, *(r.name for r in rivals))
            best = NextRun(
                amplitude,
                hz,
                current,
                float(record.temperature_c[0]),
                len(record) / record.rate_hz,
                float(min(scores)),
                names,
                f"{' and '.join(names)} would differ by {min(scores):.0f} standard deviations, "
                "all else adapted",
                record,
            )
    return best if best is not None and best.separation >= CLEAR else None


class _Alternative:
    """The rival in place of the found effect, with all that it could adapt."""

    def __init__(self, fit: JointFit, chosen: Effect, rival: Effect) -> None:
        self._fit = fit
        model = fit.model
        both = Effects((*model.effects.chosen, rival))
        self._model = model.with_effects(both)
        values = dict(fit.effect_values)
        self._truth = np.concatenate([fit.theta, Effects((rival,)).pack({rival.name: rival.neutral})])
        # The alternative has none of the found effect and a typical rival; its base starts where the fit is.
        values[chosen.name] = chosen.neutral
        values[rival.name] = rival.typical
        layout = model.layout.size
        self._theta = np.concatenate([fit.theta[:layout], both.pack(values)])
        moves = np.ones(self._model.size, dtype=bool)
        moves[layout:] = [effect.name != chosen.name for effect, _ in both.parameters]
        self._move = np.flatnonzero(moves)
        size = self._model.size
        matrix, right, square = np.zeros((size, size)), np.zeros(size), 0.0
        for record, weight, target, (_, rows), start in zip(
            self._model.records,
            self._model.weights,
            self._model.predict(self._truth),
            self._model.jacobians(self._theta),
            self._model.predict(self._theta),
            strict=True,
        ):
            gap = self._model.weighed(record, target - start)[-rows.values.shape[1] :]
            rows.add_to(matrix, right, gap, weight)
            square += weight * float(gap @ gap)
        # At the weights that the campaign's evidence gave them: the new run is seen beside that campaign.
        self._matrix = matrix + total_weight(weighed_as(fit.penalties, self._model.penalties()))
        self._right, self._square = right, square
        self._without = _least(self._matrix, right, square, self._move)
        self._weight = float(np.median(self._model.weights))

    def separation(self, record: Record) -> float:
        """Root of what the new run adds to the misfit after the best adaptation, in units of the noise."""
        model = self._model.on([record])
        truth, start = model.predict(self._truth)[0], model.predict(self._theta)[0]
        _, rows = next(iter(model.jacobians(self._theta)))
        gap = model.weighed(record, truth - start)[-rows.values.shape[1] :]
        matrix, right = self._matrix.copy(), self._right.copy()
        rows.add_to(matrix, right, gap, self._weight)
        square = self._square + self._weight * float(gap @ gap)
        return float(np.sqrt(max(_least(matrix, right, square, self._move) - self._without, 0.0)))


def _least(matrix: Array, right: Array, square: float, move: NDArray[np.intp]) -> float:
    part, side = matrix[np.ix_(move, move)], right[move]
    return square - float(side @ scaled_solution(part, side, OPEN, np.diag(part)))


def _proposals(model: JointModel) -> list[tuple[float, float, str, Record]]:
    records = model.records
    stroke = max(0.5 * float(np.ptp(r.displacement_m)) for r in records)
    top = max(float(np.abs(r.velocity_m_s).max()) for r in records)
    high = max(float(r.current_a.max()) for r in records)
    warm = float(np.median([r.temperature_c.mean() for r in records]))
    made = []
    for hz, share in product(FREQUENCIES_HZ, STROKE_SHARES):
        amplitude = min(share * stroke, top / (2.0 * np.pi * hz))
        if amplitude < 0.02 * stroke or (share < 1.0 and amplitude < share * stroke):
            continue
        t = np.arange(int(max(SECONDS, CYCLES / hz) * RATE_HZ)) / RATE_HZ
        phase = 2.0 * np.pi * hz * t
        ramp = np.clip(t / RAMP_S, 0.0, 1.0)
        x = amplitude * ramp * np.sin(phase)
        v = np.gradient(x, 1.0 / RATE_HZ)
        for words, current in _profiles(high, t).items():
            made.append(
                (
                    amplitude,
                    hz,
                    words,
                    replace(
                        records[0],
                        rate_hz=RATE_HZ,
                        velocity_m_s=v,
                        current_a=current,
                        temperature_c=np.full(t.size, warm),
                        force_n=np.zeros(t.size),
                        displacement_m=x,
                        acceleration_m_s2=np.gradient(v, 1.0 / RATE_HZ),
                        finer=1,
                        averaged_s=0.0,
                        passed=None,
                    ),
                )
            )
    return made


def _profiles(high_a: float, t: Array) -> dict[str, Array]:
    """Courses of the current over the times of a run, in words and in A."""
    profiles = {f"{high_a:.3g} A": np.full(t.size, high_a), "0 A": np.zeros(t.size)}
    if high_a > 0.0:
        steps = np.where((t % 1.0) < 0.5, high_a, 0.0)
        profiles[f"steps between 0 and {high_a:.3g} A, twice a second"] = steps
        rising = high_a * (1.0 - np.abs(2.0 * t / t[-1] - 1.0))
        profiles[f"rising from 0 to {high_a:.3g} A and back"] = rising
    return profiles
