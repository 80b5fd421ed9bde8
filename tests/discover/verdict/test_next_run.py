"""The next run to make: what a rival may adapt is what this campaign leaves open, no more."""

from __future__ import annotations

from dataclasses import replace

from discover.campaigns import campaign, shipped, sine, with_effect

from mrctl.discover.evidence import Evidence
from mrctl.discover.fits.refit import fitted
from mrctl.discover.verdict.next_run import propose
from mrctl.identify.joint_fit import JointFit
from mrctl.model.effects.registry import effect


def test_tables_that_the_campaign_holds_stiff_cannot_adapt_to_the_new_run():
    spring, mass = effect("gas_spring"), effect("fluid_inertia")
    damper = with_effect(shipped(), "gas_spring", preload_n=0.0, stiffness_n_m=8e3, progression_per_m=0.0)
    runs = [
        sine(damper, frequency_hz=4.0, amplitude_m=0.01, current_a=i, name=f"{i}.csv", seed=int(i))
        for i in (1.0, 3.0)
    ]
    records = Evidence.of(campaign(*runs)).records
    fit = fitted(records, (spring,), {spring.name: (0.0, 8e3, 0.0, 0.0)})
    soft, stiff = (
        JointFit(fit.model, fit.solution, [replace(p, weight=by * p.weight) for p in fit.penalties])
        for by in (1e-6, 1e6)
    )
    apart = [propose(one, spring, [mass], colour=1.0).separation for one in (soft, stiff)]
    assert apart[1] > 1.1 * apart[0]
