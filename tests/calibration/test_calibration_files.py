"""Calibrations on their way to and from files."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from mrctl.calibration import (
    Provenance,
    Step,
    calibration_from_damper,
    dump_calibration,
    known_effects,
    load_calibration,
)
from mrctl.calibration.json_schema import calibration_json_schema
from mrctl.errors import InputError
from mrctl.model.damper import EffectSetting, Span
from mrctl.model.effects.registry import effects
from mrctl.model.static import static_tables
from mrctl.share_path import share_file

DEFAULT = share_file("config/calibration.yaml")


@pytest.fixture(scope="module")
def default():
    return load_calibration(DEFAULT)


def test_the_shipped_file_is_what_dumping_it_writes(default, tmp_path):
    dump_calibration(default, tmp_path / "c.yaml")
    modeline, _, rest = DEFAULT.read_text().partition("\n")
    assert modeline == "# yaml-language-server: $schema=calibration.schema.json"
    assert (tmp_path / "c.yaml").read_text() == rest


def test_the_shipped_json_schema_is_current():
    # After a change of the models: DEFAULT.with_suffix(".schema.json").write_text(calibration_json_schema())
    assert share_file("config/calibration.schema.json").read_text() == calibration_json_schema()


def test_the_json_schema_names_every_block_and_fixes_the_units():
    schema = json.loads(calibration_json_schema())
    assert set(schema["required"]) == {
        "schema", "name", "provenance", "f", "g", "h", "forward_filter", "inverse_filter", "limits", "valid",
        "effects",
    }  # fmt: skip
    assert schema["$defs"]["VelocityColumn"]["properties"]["unit"]["const"] == "m/s"
    assert schema["additionalProperties"] is False


def test_any_yaml_reader_gets_the_same_tables(default):
    plain = yaml.safe_load(DEFAULT.read_text())
    assert tuple(plain["f"]["force"]["values"]) == default.damper.static.force_n
    assert tuple(plain["h"]["on"]["values"]) == default.damper.static.h_on
    assert tuple(plain["inverse_filter"]["numerator"]) == default.damper.inverse_filter.b


def test_path_and_hash_are_kept(default):
    assert default.path == DEFAULT
    assert len(default.sha256) == 64


finite = st.floats(0.01, 1e4, allow_nan=False)


@settings(max_examples=20, deadline=None)
@given(
    steps=st.lists(st.floats(1e-7, 500.0), min_size=2, max_size=12),
    first=finite,
    h=st.lists(st.floats(0.1, 2.0), min_size=1, max_size=6),
    low=st.floats(-60.0, 20.0),
    std=finite,
)
def test_what_is_dumped_is_loaded_to_the_same_floats(default, tmp_path_factory, steps, first, h, low, std):
    currents, forces = [0.0], [first]
    for step in steps:
        currents.append(currents[-1] + 0.1 + step / 1e3)
        forces.append(forces[-1] + step + 1e-3)
    temperatures = [low + 7.3 * k for k in range(len(h) + 1)]
    h = [h[0], *h]
    damper = replace(
        default.damper,
        static=static_tables(
            currents, forces, default.damper.static.velocity_m_s, default.damper.static.shape,
            temperatures, h, h, 0.0, currents[1],
        ),
        current_max_a=currents[-1],
        current_valid_a=Span(0.0, currents[-1]),
        temperature_valid_c=Span(temperatures[0], temperatures[-1]),
    )  # fmt: skip
    provenance = Provenance(
        source="bench: rig 2",
        created="2025-01-31",
        method="two\nlines, with: a colon, 'quotes' and # hash",
        history=(Step(what="identify", rmse_n=12.5, seed=7, effects=()), Step(what="by hand")),
    )
    calibration = calibration_from_damper(
        "rig 2 — Dämpfer", damper, provenance, {"f.force": tuple(std for _ in forces)}
    )
    path = tmp_path_factory.mktemp("round") / "c.yaml"
    dump_calibration(calibration, path)
    again = load_calibration(path)
    assert again.damper == calibration.damper
    assert again.provenance == provenance
    assert again.name == calibration.name
    assert dict(again.std) == dict(calibration.std)


def test_effects_keep_parameters_units_and_deviations(default, tmp_path):
    values = {"preload_n": 80.0, "stiffness_n_m": 12000.0, "progression_per_m": 0.0}
    damper = replace(default.damper, effects=(EffectSetting("gas_spring", values),))
    calibration = calibration_from_damper(
        "x", damper, default.provenance, {"effects.gas_spring.preload_n": (4.5,)}
    )
    dump_calibration(calibration, tmp_path / "c.yaml")
    again = load_calibration(tmp_path / "c.yaml")
    assert again.damper.effects == damper.effects
    assert dict(again.std) == {"effects.gas_spring.preload_n": (4.5,)}
    assert "stiffness_n_m: {value: 12000.0, unit: N/m}" in (tmp_path / "c.yaml").read_text()


def test_every_known_effect_can_be_kept(default, tmp_path):
    for name, effect in effects().items():
        setting = EffectSetting(name, effect.mapping(effect.typical))
        calibration = calibration_from_damper(
            name, replace(default.damper, effects=(setting,)), default.provenance
        )
        dump_calibration(calibration, tmp_path / "c.yaml")
        assert load_calibration(tmp_path / "c.yaml").damper.effects == (setting,)
        assert set(known_effects()[name]) == set(setting.parameters)


def test_a_dump_that_could_not_be_loaded_is_refused_and_leaves_the_old_file(default, tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text("precious")
    broken = replace(default, damper=replace(default.damper, current_max_a=-1.0))
    with pytest.raises(InputError, match=r"not written: .*current_max"):
        dump_calibration(broken, path)
    assert path.read_text() == "precious"
    assert [p.name for p in tmp_path.iterdir()] == ["c.yaml"]


def test_a_folder_that_is_not_there_is_an_input_error(default, tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        dump_calibration(default, tmp_path / "no" / "c.yaml")
