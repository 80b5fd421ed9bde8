"""The paper's method from end to end, on a damper that is inside its model class."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest
from identify_paper.stand_in import CURRENTS_A, TEMPERATURES_C, damper, protocol

from mrctl.calibration import Provenance, calibration_from_damper, dump_calibration, load_calibration
from mrctl.identify.paper import PaperOptions, identify_paper


@pytest.fixture(scope="module")
def truth():
    return damper()


@pytest.fixture(scope="module")
def result(truth):
    return identify_paper(protocol(truth), PaperOptions(passes=200))


def test_every_run_is_used_over_six_cycles(result):
    records = result.steps.preparation.records
    assert result.left_out == ()
    assert [r.cycles for r in records] == [6] * (len(CURRENTS_A) * len(TEMPERATURES_C))
    assert {r.kept.stop - r.kept.start for r in records} == {5027}


def test_f_is_found_within_the_rounding_of_the_knee_by_the_low_pass(result, truth):
    assert result.damper.static.current_a == CURRENTS_A
    true = np.interp(CURRENTS_A, truth.static.current_a, truth.static.force_n)
    assert np.array(result.damper.static.force_n) == pytest.approx(true, rel=0.04)


def test_h_is_found_on_and_off(result, truth):
    t = result.damper.static
    for table in ("h_on", "h_off"):
        true = np.interp(TEMPERATURES_C, truth.static.temperature_c, getattr(truth.static, table))
        assert np.array(getattr(t, table)) == pytest.approx(true, abs=0.005)


def test_inside_its_class_the_forward_model_is_better_than_the_two_percent_that_the_paper_begins_at(result):
    errors = result.steps.forward_errors
    assert np.max(errors.percent(errors.iir_n)) < 2.0
    assert np.all(errors.iir_n < errors.lowpass_n)


def test_the_calibration_made_of_it_loads_again(result, tmp_path):
    made = Provenance(source="a test", created=date(2026, 1, 1).isoformat(), method="paper")
    path = tmp_path / "cal.yaml"
    dump_calibration(calibration_from_damper("test", result.damper, made), path)
    loaded = load_calibration(path)
    assert loaded.damper == result.damper
    assert loaded.warnings == ()
