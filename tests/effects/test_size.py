"""An effect in a damper of another size: newtons go with it, lengths and times do not."""

import pytest

from mrctl.model.effects.base import Ranges, force_power
from mrctl.model.effects.registry import effects
from mrctl.model.effects.size import LARGEST_N, SMALLEST_N, sized


@pytest.mark.parametrize(
    ("unit", "power"),
    [
        *((unit, 1) for unit in ("N", "N*s/m", "N*s^2/m^2", "kg", "N/K", "N·s/m", "N s/m")),
        *((unit, -1) for unit in ("m/N", "K/J", "m/N/s", "m/(N*s)", "K/(J*s)")),
        ("N^2", 2),
        *((unit, 0) for unit in ("s", "1/K", "1", "ohm", "m")),
    ],
)
def test_how_often_a_unit_counts_in_newtons(unit, power):
    assert force_power(unit) == power


@pytest.mark.parametrize("effect", effects().values(), ids=list(effects()))
def test_a_usual_damper_s_effects_stay_as_they_are(effect):
    assert all(sized(effect, force_n) is effect for force_n in (SMALLEST_N, 3e3, LARGEST_N, 0.0))


@pytest.mark.parametrize("factor", [0.1, 20.0])
@pytest.mark.parametrize("effect", effects().values(), ids=list(effects()))
def test_a_fit_begins_in_another_size_where_it_would_in_the_usual_one(effect, factor):
    force_n = factor * (LARGEST_N if factor > 1.0 else SMALLEST_N)
    other = sized(effect, force_n)
    usual = Ranges(0.02, 0.5, 2.0, force_n / factor, 0.8 * force_n / factor, 1e-3)
    here = usual._replace(force_n=force_n, compression_force_n=0.8 * force_n)
    by = [factor ** force_power(p.unit) for p in effect.parameters]
    for point, there in zip(effect.starting_points(usual), other.starting_points(here), strict=True):
        assert there == pytest.approx([x * own for x, own in zip(point, by, strict=True)])
        if effect.plausible:
            assert effect.plausible(point, usual) == other.plausible(there, here)
    for p, q, own in zip(effect.parameters, other.parameters, by, strict=True):
        assert (q.low, q.high, q.neutral) == pytest.approx((p.low * own, p.high * own, p.neutral * own))
        assert p.reach[0] <= q.low
        assert q.high <= p.reach[1]


@pytest.mark.parametrize("effect", effects().values(), ids=list(effects()))
def test_an_effect_is_sized_once_however_often_it_is_asked(effect):
    small = sized(effect, 40.0)
    for again in (sized(small, 40.0), sized(sized(small, 2e5), 40.0)):
        assert again.parameters == small.parameters
    assert sized(small, 3e3) is effect


def test_a_calibration_may_hold_what_a_large_damper_has():
    friction = effects()["coulomb_friction"]
    values = {"friction_n": 9e3, "presliding_m": 1e-4, "breakaway": 0.0, "slow_m_s": 5e-3}
    assert friction.vector(values)[0] == 9e3
    with pytest.raises(ValueError, match="friction_n = 9e\\+06 is outside 0 to 200000 N"):
        friction.vector(values | {"friction_n": 9e6})
