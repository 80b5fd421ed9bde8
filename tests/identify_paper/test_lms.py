"""The LMS algorithm: padasip's coefficients, faster; many passes as if each had been done; its limit."""

from __future__ import annotations

import numpy as np
import padasip
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.bench.lms import measure_lms, one_run
from mrctl.identify.paper import PaperOptions
from mrctl.identify.paper.fir import adaptive_filter, least_squares, normal_equations, stable_step
from mrctl.identify.paper.lms import lms, many_passes, pass_map, windows


def judged(inputs, wanted, step, taps, passes=1):
    peer = padasip.filters.FilterLMS(taps, mu=step, w="zeros")
    rows = np.array(windows(inputs, taps))
    for _ in range(passes):
        _, errors, _ = peer.run(wanted, rows)
    return peer.w, errors


def test_the_coefficients_are_those_of_padasip():
    inputs, wanted = one_run()
    weights = np.zeros(500)
    errors = lms(inputs, wanted, 1e-9, weights)
    peer_weights, peer_errors = judged(inputs, wanted, 1e-9, 500)
    assert weights == pytest.approx(peer_weights, rel=0, abs=1e-9)
    assert errors == pytest.approx(peer_errors, rel=0, abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(
    taps=st.integers(1, 40),
    count=st.integers(1, 120),
    strength=st.floats(0.01, 1.9),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_signal_gives_padasips_coefficients_and_errors(taps, count, strength, seed):
    random = np.random.default_rng(seed)
    inputs, wanted = random.normal(0.0, 100.0, count + taps - 1), random.normal(0.0, 100.0, count)
    step = strength / np.max(np.sum(windows(inputs, taps) ** 2, axis=1))
    weights = np.zeros(taps)
    errors = lms(inputs, wanted, step, weights)
    peer_weights, peer_errors = judged(inputs, wanted, step, taps)
    assert weights == pytest.approx(peer_weights, rel=1e-9, abs=1e-9)
    assert errors == pytest.approx(peer_errors, rel=1e-9, abs=1e-7)


def test_many_passes_at_once_end_where_padasip_ends_pass_by_pass():
    inputs, wanted = one_run(taps=60)
    inputs, wanted = inputs[:660], wanted[:601]
    history = dict(many_passes(pass_map(inputs, wanted, 1e-9, 60), 43))
    assert 43 in history
    for passes in (1, 5, 16, 43):
        weights, _ = judged(inputs, wanted, 1e-9, 60, passes)
        assert history[passes] == pytest.approx(weights, rel=0, abs=1e-9)


def test_one_pass_is_at_least_twenty_times_faster_than_padasips():
    cost = measure_lms(rounds=2)
    assert cost.difference < 1e-9
    assert cost.times_faster >= 20.0


def test_the_normal_equations_are_the_sums_over_all_windows():
    random = np.random.default_rng(5)
    inputs, wanted = random.normal(size=130), random.normal(size=101)
    X = np.array(windows(inputs, 30))
    gram, cross, power = normal_equations(inputs, wanted, 30)
    assert gram == pytest.approx(X.T @ X / 101, abs=1e-12)
    assert cross == pytest.approx(X.T @ wanted / 101, abs=1e-12)
    assert power == pytest.approx(np.mean(wanted**2))


def test_over_whole_cycles_the_normal_equations_are_toeplitz():
    inputs, wanted = one_run(taps=80)
    gram, _, _ = normal_equations(inputs, wanted, 80)
    for lag in (0, 1, 40, 79):
        diagonal = np.diagonal(gram, lag)
        assert diagonal == pytest.approx(np.full(diagonal.size, diagonal[0]), rel=1e-3, abs=1e-3 * gram[0, 0])


def test_least_squares_finds_a_fir_filter_exactly_where_its_input_is_rich():
    random = np.random.default_rng(2)
    true = random.normal(size=25)
    inputs = random.normal(size=1024)
    wanted = windows(inputs, 25) @ true
    gram, cross, _ = normal_equations(inputs, wanted, 25)
    assert least_squares(gram, cross) == pytest.approx(true, abs=1e-7)


def test_lms_comes_down_to_least_squares_and_not_below():
    inputs, wanted = one_run(taps=100)
    inputs, wanted = inputs[:2199], wanted[:2100]
    found = adaptive_filter(inputs, wanted, PaperOptions(taps=100, passes=2000))
    assert found.passes[-1] == 2000
    assert np.all(found.mse_n2 >= found.mse_least_squares_n2)
    assert found.mse_n2[-1] < 0.01 * found.mse_n2[0]
    assert found.mse_n2[-1] < 4.0 * found.mse_least_squares_n2
    rows = windows(inputs, 100)
    assert found.mse_n2[-1] == pytest.approx(np.mean((wanted - rows @ found.lms) ** 2), rel=1e-6)


def test_the_papers_step_stays_as_it_is_where_it_is_stable_and_shrinks_where_it_is_not():
    inputs, _ = one_run()
    assert stable_step(inputs, 500, 1e-9) == 1e-9
    assert (
        stable_step(3.0 * inputs, 500, 1e-9) * np.max(np.sum(windows(3.0 * inputs, 500) ** 2, axis=1)) < 2.0
    )


def test_a_long_record_takes_fewer_passes_for_the_same_updates():
    inputs, wanted = one_run(taps=10)
    options = PaperOptions(taps=10, passes=30)
    long = adaptive_filter(np.tile(inputs, 4)[: 4 * wanted.size + 9], np.tile(wanted, 4), options)
    assert adaptive_filter(inputs, wanted, options).passes[-1] == 30
    assert long.passes[-1] == 8
