"""A calibration's g goes up to 1, a fit's further: what an effect is told of f goes along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from discover.hidden import rich

from mrctl.discover.fits.refit import fitted, thinned
from mrctl.identify.effects_fit import Effects
from mrctl.identify.finish import at_full_shape, damper_of, full_shape
from mrctl.identify.forward import modelled
from mrctl.identify.joint import JointModel
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import records_of
from mrctl.model.effects.registry import effect

ELASTIC = (
    4e-4,
    2e-7,
    0.0,
    0.7,
    0.3,
    0.0,
    0.0,
    0.2,
    0.0,
    0.0,
)  # its plastic part and its compliance hang on f
CYCLE = 200  # samples


@pytest.fixture(scope="module")
def campaign():
    whole = rich()
    return replace(whole, runs=whole.runs[4:8])


@pytest.fixture(scope="module")
def low_gauge(campaign):
    """A fit whose g is 1 where the damper turns, and far above 1 beyond."""
    plain = fitted(thinned(records_of(campaign.runs)), (), {})
    layout = plain.model.layout
    near = replace(layout, gauge=int(np.argmin(np.abs(layout.velocity_m_s - 0.02))))
    model = JointModel(near, plain.model.records, Effects((effect("preyield_stiffness"),)))
    theta = model.pack(plain.tables, {"preyield_stiffness": ELASTIC})
    solution = replace(plain.solution, theta=theta, held=np.zeros(theta.size, dtype=bool))
    return JointFit(model, solution, model.penalties())


def test_a_damper_makes_the_force_of_its_fit(low_gauge, campaign):
    assert full_shape(low_gauge.tables) > 1.2
    damper = damper_of(low_gauge)
    assert max(map(abs, damper.static.shape)) == pytest.approx(1.0)
    for run, force in zip(campaign.runs, low_gauge.model.predict(low_gauge.theta), strict=True):
        # At another rate: f as it stood would be off by a tenth.
        apart = (modelled(damper, run) - force)[CYCLE:]  # begun as the measured force has it, not as the fit
        assert np.max(np.abs(apart)) < 0.01 * np.max(np.abs(force))


def test_what_creeps_alone_keeps_its_way(low_gauge):
    creeping = (4e-4, 2e-7, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    fit = JointFit(
        low_gauge.model,
        replace(
            low_gauge.solution, theta=low_gauge.model.pack(low_gauge.tables, {"preyield_stiffness": creeping})
        ),
        low_gauge.penalties,
    )
    scale, (length, compliance, *_) = full_shape(fit.tables), at_full_shape(fit)[0]
    assert length == pytest.approx(4e-4 * scale**0.5)
    assert compliance == pytest.approx(2e-7 * scale**-0.5)


def test_an_extended_model_is_fitted_as_it_is_written(campaign):
    fit = fitted(
        thinned(records_of(campaign.runs)), (effect("preyield_stiffness"),), {"preyield_stiffness": ELASTIC}
    )
    assert full_shape(fit.tables) == pytest.approx(1.0, abs=1e-3)
