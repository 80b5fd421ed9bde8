"""Roads have the spectrum of their class."""

from __future__ import annotations

import numpy as np
import pytest

from mrctl.plant.road import ROUGHNESS_M3, Bump, Flat, IsoRoad, Sum, road_psd_m3

LENGTH_M, GRID_M = 2000.0, 0.02


@pytest.mark.parametrize("road_class", ROUGHNESS_M3)
def test_profile_has_the_spectrum_of_its_class(road_class):
    road = IsoRoad(road_class, seed=3)
    height = np.array([road.height_m(x) for x in np.arange(0.0, LENGTH_M, GRID_M)])
    power = np.abs(np.fft.rfft(height) / height.size) ** 2 * 2.0 * LENGTH_M  # one-sided, m^3
    wavenumber = np.arange(power.size) / LENGTH_M
    for octave in 0.0125 * 2.0 ** np.arange(7):
        band = (wavenumber >= octave) & (wavenumber < 2.0 * octave)
        wanted = np.mean([road_psd_m3(n, road_class) for n in wavenumber[band]])
        assert np.mean(power[band]) == pytest.approx(wanted, rel=1e-6)


def test_each_class_is_four_times_as_rough_as_the_one_before():
    roads = [IsoRoad(c, 1) for c in "ABCDE"]
    rms = [np.std([road.height_m(0.5 * k) for k in range(4000)]) for road in roads]
    assert np.array(rms[1:]) / np.array(rms[:-1]) == pytest.approx(np.full(4, 2.0), rel=1e-9)


def test_same_seed_same_road_other_seed_other_road():
    places = np.arange(0.0, 100.0, 0.37)
    one, again, other = (
        [road.height_m(float(x)) for x in places]
        for road in (IsoRoad("C", 1), IsoRoad("c", 1), IsoRoad("C", 2))
    )
    assert one == again
    assert np.corrcoef(one, other)[0, 1] < 0.9


def test_road_repeats_and_goes_backwards_too():
    road = IsoRoad("B", 5)
    assert road.height_m(12.345 + LENGTH_M) == pytest.approx(road.height_m(12.345), abs=1e-12)
    assert road.height_m(-1.0) == pytest.approx(road.height_m(LENGTH_M - 1.0), abs=1e-12)


def test_bump_is_a_smooth_hump_where_it_stands():
    bump = Bump(start_m=10.0, length_m=4.0, height_m=0.05)
    assert bump.height_m(12.0) == pytest.approx(0.05)
    assert [bump.height_m(x) for x in (9.0, 10.0, 14.0, 20.0)] == [0.0] * 4
    assert abs(bump.height_m(10.001)) < 1e-6


def test_bump_comes_again_where_it_is_told_to():
    bump = Bump(start_m=10.0, length_m=4.0, height_m=0.05, every_m=50.0)
    assert bump.height_m(12.0) == pytest.approx(bump.height_m(62.0)) == pytest.approx(0.05)
    assert bump.height_m(-38.0) == 0.0
    with pytest.raises(ValueError, match="further apart"):
        Bump(0.0, 4.0, 0.05, every_m=3.0)


def test_sum_adds():
    bump = Bump(0.0, 2.0, 0.1)
    assert Sum(bump, bump, Flat()).height_m(1.0) == pytest.approx(0.2)


def test_unknown_class_and_flat_bump_are_refused():
    with pytest.raises(ValueError, match="there are A, B, C, D, E"):
        IsoRoad("X", 1)
    with pytest.raises(ValueError, match="give a length above 0"):
        Bump(0.0, 0.0, 0.1)
