"""The few features of each sample, and what folds left out are predicted to be with them."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.discover.fits.map_sums import Features, MapSums

SAMPLES, FOLDS, NOISE = 4000, 8, 0.5
RNG = np.random.default_rng(4)
FIRST, SECOND = RNG.uniform(-1.0, 1.0, (2, SAMPLES))
FOLD = np.arange(SAMPLES) * FOLDS // SAMPLES


def _dense(features):
    out = np.zeros((SAMPLES, features.count))
    np.put_along_axis(out, features.which, features.values, axis=1)
    return out


def _all():
    maps = [Features.of([FIRST], 9), Features.of([FIRST, SECOND], 6)]
    return Features.beside([*maps, Features.constant(SAMPLES)])


def test_a_map_is_one_everywhere_in_sum_and_gives_its_signal_back():
    one, two = Features.of([FIRST], 9), Features.of([FIRST, SECOND], 6)
    assert _dense(one).sum(axis=1) == pytest.approx(np.ones(SAMPLES))
    assert _dense(two).sum(axis=1) == pytest.approx(np.ones(SAMPLES))
    inside = np.abs(FIRST) < 0.99  # beyond the outermost knots the value stays theirs
    back, *_ = np.linalg.lstsq(_dense(one), FIRST, rcond=None)
    assert (_dense(one) @ back)[inside] == pytest.approx(FIRST[inside], abs=2e-3)


def test_what_does_not_move_has_no_map():
    assert Features.of([np.full(SAMPLES, 3.0)], 9) is None
    assert Features.of([FIRST, np.full(SAMPLES, 3.0)], 6) is None


def test_the_sums_are_those_of_all_features_in_any_order_of_the_samples():
    features, rest = _all(), RNG.normal(size=SAMPLES)
    mixed = RNG.permutation(SAMPLES)
    fold = FOLD[mixed]
    sums, dense = MapSums.of(features, rest, fold), _dense(features)
    for k in range(FOLDS):
        own = dense[fold == k]
        assert sums.grams[k] == pytest.approx(own.T @ own)
        assert sums.rights[k] == pytest.approx(own.T @ rest[fold == k])
    assert sums.counts.sum() == SAMPLES


def test_what_a_map_shows_is_predicted_and_noise_is_not():
    course = np.sin(3.0 * FIRST)
    noise = NOISE * RNG.normal(size=SAMPLES)
    shown, error = MapSums.of(_all(), course + noise, FOLD).predicted()
    assert shown == pytest.approx(np.mean(course**2), rel=0.1)
    assert shown > 10.0 * error
    nothing, error = MapSums.of(_all(), noise, FOLD).predicted()
    assert nothing <= 3.0 * error + 1e-3 * NOISE**2
