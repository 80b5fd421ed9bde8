import sys
from pathlib import Path

import numpy as np
import pytest

from mrctl.identify.best import fit_base
from mrctl.identify.records import records_of

sys.path.insert(0, str(Path(__file__).parent))
from virtual import NOISE_N, Bench, protocol, random_damper

KINDS = ("single", "several frequencies", "rates", "sweep", "steps", "road", "only off")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 2])
def test_a_damper_inside_the_class_is_predicted_to_its_noise(kind, seed):
    bench = Bench(random_damper(seed), np.random.default_rng(seed))
    training, held_out = protocol(kind, bench), protocol(kind, bench)
    fit = fit_base(records_of(training.runs))
    model = fit.model.on(records_of(held_out.runs))
    assert model.rmse_n(fit.theta) <= 1.05 * NOISE_N
