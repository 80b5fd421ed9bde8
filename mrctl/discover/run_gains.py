"""The scale of the force, which may be another in each run: an amplifier's, a current's, a damper's day.

No run repeats another to better than some tenths of a percent. What is left in each run in proportion to the
modelled force, without any rule among the runs, is no physics that an effect could follow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.run_zeros import CHANCE, by_a_rule
from mrctl.identify.records import Record
from mrctl.identify.run_scatter import FEWEST_RUNS, scales_apart

Array = NDArray[np.float64]

LEAST = 2e-3  # of the force: what scatters less does no harm
LARGEST = 0.03  # no rig scatters further
CERTAIN = 2.0  # standard errors


def run_gains(
    errors: Sequence[Array],
    modelled: Sequence[Array],
    records: Sequence[Record],
    fewest: int = FEWEST_RUNS,
) -> Array:
    """How much larger each run's force is measured than modelled, as a share (runs); zeros if all are alike.

    errors, modelled: what a model leaves of each run's force, and the model's (n each, N); fewest: runs, to
    have any. There is none either where the shares go with the runs' conditions, alone, squared or two
    together: then it is physics. Each share is drawn towards none by how little its run tells.
    """
    none = np.zeros(len(errors))
    if len(errors) < fewest:
        return none
    apart, doubts, chance = scales_apart(errors, modelled)
    if chance > CHANCE or float(np.max(np.abs(apart))) < LEAST:
        return none
    scatter = max(float(np.average(apart**2 - doubts**2, weights=1.0 / doubts**2)), 0.0)
    weights = 1.0 / (doubts**2 + scatter)
    apart = apart - float(np.average(apart, weights=weights))
    if float(np.max(np.abs(apart) - CERTAIN * doubts)) > LARGEST or by_a_rule(apart, weights, records):
        return none
    return np.asarray(apart * scatter * weights, dtype=np.float64)
