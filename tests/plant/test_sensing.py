"""Sensors: perfect, or with the faults they are told to have."""

from __future__ import annotations

import random

import numpy as np
import pytest

from mrctl.config.models import SignalRulesFile
from mrctl.plant.sensing import NOISY, TRUTHS, Sensor


def test_sensor_adds_what_it_is_told():
    source = random.Random(1)
    assert Sensor(offset=0.5).read(1.0, source) == 1.5
    assert Sensor(quantum=0.25).read(0.9, source) == 1.0
    noisy = [Sensor(noise=0.1).read(2.0, source) for _ in range(4000)]
    assert np.mean(noisy) == pytest.approx(2.0, abs=0.01)
    assert np.std(noisy) == pytest.approx(0.1, rel=0.1)


def test_every_role_of_the_configuration_is_measured():
    assert set(TRUTHS) == set(SignalRulesFile.model_fields)
    assert NOISY.keys() <= TRUTHS.keys()
