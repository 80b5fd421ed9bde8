"""The compiled runs: the plain model's numbers, quickly, and stages taken over where nothing changed."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from bisect import bisect_right
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.calibration import load_calibration
from mrctl.model.damper import EffectSetting
from mrctl.model.effects.base import EffectError
from mrctl.model.effects.registry import effects
from mrctl.model.forward import ForwardModel
from mrctl.model.static import backbone_force
from mrctl.share_path import share_file
from mrctl.simulate import Run, simulate, stages, trace

DAMPER = load_calibration(share_file("config/calibration.yaml")).damper
DT_S = 0.0005


def motion(n: int) -> Run:
    t = np.arange(n) * DT_S
    v = 0.3 * np.sin(15.0 * t) + 0.05 * np.sin(111.0 * t)
    current = 1.5 + 1.5 * np.sin(4.0 * t)
    x = -0.02 * np.cos(15.0 * t) - 0.05 / 111.0 * np.cos(111.0 * t)
    return Run.of(DT_S, v, current, 50.0 + 20.0 * np.sin(0.1 * t), x)


def with_typical(*names: str):
    chosen = (EffectSetting(name, effects()[name].mapping(effects()[name].typical)) for name in names)
    return replace(DAMPER, effects=tuple(chosen))


def test_a_run_is_what_the_forward_model_gives_sample_by_sample():
    run = motion(3000)
    model = ForwardModel(DAMPER, DT_S)
    signals = run.velocity_m_s.tolist(), run.current_a.tolist(), run.temperature_c.tolist()
    expected = [model.step(*sample) for sample in zip(*signals, strict=True)]
    ours = simulate(DAMPER, DT_S, *(np.array(s) for s in signals), settled=False)
    assert ours == pytest.approx(expected, rel=1e-9, abs=1e-9 * max(map(abs, expected)))


def test_a_settled_run_starts_without_a_transient():
    steady = simulate(DAMPER, DT_S, np.full(50, 0.2), 1.0, 40.0)
    assert steady == pytest.approx(backbone_force(0.2, 1.0, 40.0, DAMPER.static), rel=1e-9)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=40, unique=True), st.floats(-2e3, 2e3))
def test_the_compiled_bisection_is_the_standard_librarys(knots, x):
    @numba.njit(cache=False)
    def compiled(a, u):
        return bisect_right(a, u)

    compiled = test_the_compiled_bisection_is_the_standard_librarys.__dict__.setdefault("compiled", compiled)
    knots = sorted(knots)
    for u in (x, *knots):
        assert compiled(np.array(knots), u) == bisect_right(knots, u)


def test_a_change_of_one_effect_leaves_the_stages_before_it():
    run = motion(500)
    before = trace(run, with_typical("gas_spring", "current_lag"))
    after = trace(run, with_typical("gas_spring", "current_lag", "force_offset"), like=before)
    assert after.filtered_n is before.filtered_n
    assert after.rod_n["gas_spring"] is before.rod_n["gas_spring"]
    assert after.force_n == pytest.approx(before.force_n + after.rod_n["force_offset"], abs=1e-9)
    lagless = trace(run, with_typical("gas_spring"), like=after)
    assert lagless.shape is after.shape
    assert lagless.level_n is not after.level_n


@pytest.mark.parametrize("name", sorted(effects()))
def test_stages_taken_over_never_change_a_result(name):
    run = motion(500)
    before = trace(run, with_typical("coulomb_friction", "preyield_stiffness", "current_lag"))
    names = sorted({"coulomb_friction", "preyield_stiffness", name})
    again = trace(run, with_typical(*names), like=before)
    assert np.array_equal(again.force_n, trace(run, with_typical(*names)).force_n)


def test_other_tables_or_filters_are_noticed():
    run, t = motion(500), DAMPER.static
    before = trace(run, with_typical("mount_compliance", "self_heating"))
    stiffer = replace(
        with_typical("mount_compliance", "self_heating"),
        static=t._replace(shape=tuple(0.9 * g for g in t.shape)),
    )
    assert np.array_equal(trace(run, stiffer, like=before).force_n, trace(run, stiffer).force_n)
    assert not np.array_equal(trace(run, stiffer, like=before).force_n, before.force_n)
    slower = replace(
        DAMPER, forward_filter=replace(DAMPER.forward_filter, b=(0.0, 0.0, 0.0, 1.0), a=(1.0, 0.0, 0.0, 0.0))
    )
    plain = trace(run, DAMPER)
    assert trace(run, slower, like=plain).static_n is plain.static_n
    assert not np.array_equal(trace(run, slower, like=plain).force_n, plain.force_n)


def test_a_trace_of_another_run_is_not_taken_over():
    one, other = motion(500), motion(500)
    assert trace(other, DAMPER, like=trace(one, DAMPER)).static_n is not trace(one, DAMPER).static_n


def test_an_effect_that_needs_displacement_refuses_a_run_without():
    run = Run.of(DT_S, np.zeros(10), 1.0, 40.0)
    with pytest.raises(EffectError, match="gas_spring needs the displacement"):
        trace(run, with_typical("gas_spring"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.0, np.zeros(5), 1.0, 40.0), "step"),
        ((DT_S, np.zeros(5), np.zeros(4), 40.0), "current has the shape"),
        ((DT_S, np.zeros((5, 2)), 1.0, 40.0), "velocity has the shape"),
        ((DT_S, np.array([0.0, math.nan]), 1.0, 40.0), "not finite"),
    ],
)
def test_unusable_signals_are_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        Run.of(*arguments)


def test_lists_views_and_read_only_arrays_are_all_taken():
    v = np.linspace(-0.3, 0.3, 40)
    frozen = v.copy()
    frozen.flags.writeable = False
    expected = simulate(DAMPER, DT_S, v, 1.0, 40.0)
    for given_as in (v.tolist(), np.repeat(v, 2)[::2], frozen, v.astype(object).astype(float)):
        assert np.array_equal(simulate(DAMPER, DT_S, given_as, 1, 40), expected)


def test_300_000_samples_with_two_effects_take_a_fraction_of_a_second():
    run, damper = motion(300_000), with_typical("gas_spring", "coulomb_friction")
    trace(run, damper)
    spent = []
    for _ in range(5):
        start = time.process_time()
        trace(run, damper)
        spent.append(time.process_time() - start)
    assert min(spent) < 0.25  # 0.03 s on an idle machine


def test_compiled_code_is_kept_in_the_users_folder_and_used_again(tmp_path):
    code = (
        "from mrctl.simulate import loops; from mrctl.simulate.compiled import compiled as c;"
        "from mrctl.model.tables import interpolate; import numpy as np;"
        "k = c(loops.table, interpolate, 'table');"
        "k(np.zeros(3), np.arange(2.0), np.arange(2.0), np.zeros(3));"
        "print(sum(k.stats.cache_hits.values()), sum(k.stats.cache_misses.values()))"
    )
    environment = os.environ | {"MRCTL_CACHE_DIR": str(tmp_path)}
    runs = [
        subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
        )
        for _ in range(2)
    ]
    assert [run.stdout.split() for run in runs] == [["0", "1"], ["1", "0"]]
    assert any(Path(tmp_path).rglob("*.nbc"))


def test_an_unwritable_cache_folder_is_no_obstacle(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    code = (
        "from mrctl.simulate import stages; import numpy as np;"
        "print(stages.filtered(np.ones(3), (1.0, 0, 0, 0, 0, 0, 0), settled=True)[0])"
    )
    environment = os.environ | {"MRCTL_CACHE_DIR": str(blocked / "below")}
    out = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert float(out.stdout) == 1.0


def test_single_stages_can_be_called():
    run = motion(100)
    level = stages.level(run.current_a, run.temperature_c, DAMPER.static)
    assert level * stages.shape(run.velocity_m_s, DAMPER.static) == pytest.approx(trace(run, DAMPER).static_n)
