"""What a model takes for warmth must thin its fluid: no damper's force grows as it warms."""

from __future__ import annotations

import numpy as np

from mrctl.identify.effects_fit import bare_damper
from mrctl.identify.joint_fit import JointFit
from mrctl.simulate import stages

COLD, WARM = 0.05, 0.95  # of all samples, that are colder than what counts as cold and as warm
FIRMER = 0.02  # of the force, by which it may grow from cold to warm: as surely as h is known


def thins_as_it_warms(fit: JointFit) -> bool:
    """Whether a model's force is no larger where its fluid is warm; so of one in which no fluid warms up.

    What begins low in each run and recovers on the way, as particles do that settle and are mixed again, can
    be told by a warmth as well as what fades; but only with an h that grows.
    """
    model = fit.model
    if not model.effects.warm:
        return True
    traces = model.traces(fit.theta)
    cold_c, warm_c = np.quantile(np.concatenate([t.temperature_c for t in traces]), (COLD, WARM))
    static = bare_damper(model.layout, fit.tables, 1.0 / traces[0].run.dt_s).static
    cold_n = warm_n = 0.0
    for one in traces:
        i, shape = one.current_a, np.abs(one.shape)
        cold_n += float(stages.level(i, np.full(i.size, cold_c), static) @ shape)
        warm_n += float(stages.level(i, np.full(i.size, warm_c), static) @ shape)
    return warm_n <= (1.0 + FIRMER) * cold_n
