"""The scale of the force, which may be another in each run: an amplifier's, a current's, a damper's day.

No run repeats another to better than some tenths of a percent. What is left in each run in proportion to the
modelled force, without any rule among the runs, is no physics that an effect could follow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.channels.run_zeros import by_a_rule
from mrctl.discover.channels.runs_own import Own
from mrctl.identify.records import Record
from mrctl.identify.run_scatter import FEWEST_RUNS

Array = NDArray[np.float64]

CHANCE = 1e-4  # that runs of one scale differ so
LEAST = 2e-3  # of the force: what scatters less does no harm
LARGEST = 0.03  # no rig scatters further
CERTAIN = 2.0  # standard errors


def run_gains(seen: Own, records: Sequence[Record], fewest: int = FEWEST_RUNS) -> Array:
    """How much larger each run's force is measured than modelled, as a share (runs); zeros if all are alike.

    seen: each run's share, drawn towards none by how little its run tells; fewest: runs, to have any. None is
    taken where the shares go with the runs' conditions, alone, squared or two together: that is physics.
    """
    none = np.zeros(seen.values.size)
    if none.size < fewest or seen.chance > CHANCE:
        return none
    apart = seen.values - float(seen.values.mean())
    sure = np.abs(apart) - CERTAIN * seen.doubts
    if float(np.max(np.abs(apart))) < LEAST or float(np.max(sure)) > LARGEST:
        return none
    return none if by_a_rule(apart, 1.0 / (seen.doubts**2 + float(np.var(apart))), records) else apart
