"""What the better method makes of the published protocol: forwards, and through the inverse and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.extend import extend
from mrctl.identify.paper.prepare import Preparation
from mrctl.measurements.run import Campaign, Run
from mrctl.model.damper import Damper
from mrctl.model.effects.registry import effect
from mrctl.model.pipeline import ForwardPipeline, InversePipeline
from mrctl.simulate import simulate

Array = NDArray[np.float64]

EFFECTS = ("off_state_backbone", "gas_spring")  # the off state's own shape, and the gas that every damper has


@dataclass(frozen=True, slots=True, eq=False)
class Best:
    """Each (runs): percent of the largest force, forwards, and to the inverse and back; mean current."""

    damper: Damper
    forward_percent: Array
    returned_percent: Array
    mean_current_a: Array


def best_of(campaign: Campaign, preparation: Preparation) -> Best:
    """Fit with the effects, then judge every run that the preparation kept.

    Forwards against the force as measured, which is what was fitted; back against the filtered one, the wish.
    """
    found = extend(campaign, (), [effect(name) for name in EFFECTS])
    forward, returned, current = [], [], []
    for record in preparation.records:
        run = campaign.runs[record.run]
        model = simulate(
            found.damper,
            run.dt_s,
            run.velocity_m_s,
            run.current_a,
            run.temperature_c,
            run.displacement_m,
            run.acceleration_m_s2,
        )
        peak = float(np.max(np.abs(record.cut(record.force_n))))
        forward.append(100.0 * _rms(record.cut(run.force_n - model)) / peak)
        back, asked = _retraced(found.damper, run, record.force_n)
        returned.append(100.0 * _rms(record.cut(record.force_n - back)) / peak)
        current.append(float(np.mean(record.cut(asked))))
    return Best(found.damper, np.array(forward), np.array(returned), np.array(current))


def _retraced(damper: Damper, run: Run, wish_n: Array) -> tuple[Array, Array]:
    """(force that comes back, current asked for), n each, as the controller works it out."""
    inverse, forward = InversePipeline(damper, run.dt_s), ForwardPipeline(damper, run.dt_s)
    inverse.reset(float(wish_n[0]))
    force, current = np.empty(len(run)), np.empty(len(run))
    signals = (wish_n, run.velocity_m_s, run.temperature_c, run.displacement_m, run.acceleration_m_s2)
    for k, (f, v, t, x, a) in enumerate(zip(*(s.tolist() for s in signals), strict=True)):
        current[k] = inverse.step(f, v, t, x, a)
        force[k] = forward.step(v, float(current[k]), t, x, a)
    return force, current


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))
