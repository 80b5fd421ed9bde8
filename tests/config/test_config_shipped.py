"""The shipped configurations: sound, explicit, and what an integrator expects of them."""

from __future__ import annotations

import json
import re

import pytest
import yaml

from mrctl.can.frames import FRAMES_OUT
from mrctl.config import load_config
from mrctl.config.json_schema import config_json_schema
from mrctl.config.models import ConfigFile
from mrctl.control.laws import LAWS
from mrctl.control.maps import CURRENT_MAPS
from mrctl.share_path import share_file

SHIPPED = ("vehicle", "vehicle_fd", "bench")


@pytest.fixture(scope="module", params=SHIPPED)
def shipped(request):
    return load_config(share_file(f"config/{request.param}.yaml"))


def vehicle():
    return load_config(share_file("config/vehicle.yaml"))


def test_each_loads_without_a_warning_and_within_the_bus(shipped):
    assert shipped.warnings == ()
    assert 0.2 < shipped.bus_load.total <= 0.6
    assert len(shipped.sha256) == 64


def test_each_carries_everything_the_controller_needs(shipped):
    assert set(shipped.calibrations) == set(shipped.dampers)
    for damper in shipped.dampers.values():
        assert {"relative_velocity", "temperature"} <= set(damper.signals)
        assert damper.calibration.is_file()
    assert shipped.database.is_file()
    assert set(shipped.frames.send) == set(FRAMES_OUT)


def test_the_car_has_four_dampers_at_500_hz_on_classic_can():
    config = vehicle()
    assert list(config.dampers) == ["front_left", "front_right", "rear_left", "rear_right"]
    assert (config.loop.rate_hz, config.bus.bitrate, config.bus.fd) == (500.0, 500_000, False)
    assert config.frames.receive["RelativeVelocity"] == 500.0


def test_the_fast_car_runs_at_1_khz_on_can_fd():
    config = load_config(share_file("config/vehicle_fd.yaml"))
    assert (config.loop.rate_hz, config.bus.fd, config.bus.data_bitrate) == (1000.0, True, 2_000_000)
    assert config.frames.send["CurrentCommand"] == 1000.0


def test_the_bench_has_one_damper():
    config = load_config(share_file("config/bench.yaml"))
    assert len(config.dampers) == 1


def test_safety_holds_a_medium_current_in_limp():
    config = vehicle()
    largest = min(c.damper.current_max_a for c in config.calibrations.values())
    assert 0.2 * largest < config.safety.limp_current_a < 0.6 * largest


def test_a_late_relative_velocity_is_noticed_after_five_periods_and_limps_after_fifty_milliseconds(shipped):
    rules = shipped.signals["relative_velocity"]
    assert rules.timeout_ms == 5000.0 / shipped.loop.rate_hz
    assert rules.limp_after_ms == 50.0


def test_body_velocity_and_temperature_can_be_stood_in_for_for_ever(shipped):
    for role in ("body_velocity", "body_acceleration", "temperature"):
        assert shipped.signals[role].limp_after_ms is None


def test_the_car_s_file_spells_out_every_default():
    """Left out or as shipped, the values are the same."""
    written = yaml.safe_load(share_file("config/vehicle.yaml").read_text())
    file = ConfigFile.model_validate(written)
    bare = ConfigFile.model_validate({"schema": written["schema"], "dampers": written["dampers"]})
    for name in ConfigFile.model_fields:
        key = "schema" if name == "schema_" else name
        assert key in written, key
        if name not in {"schema_", "database", "dampers", "frames", "control"}:
            assert getattr(file, name) == getattr(bare, name), name
            given = written[key]
            if isinstance(given, dict):
                assert set(given) == set(type(getattr(file, name)).model_fields), name
    defaults = {p.name: p.default for p in LAWS[file.control.law].parameters}
    assert file.control.parameters == defaults
    assert file.control.law == bare.control.law
    assert file.control.current_map == bare.control.current_map


def test_the_least_that_a_configuration_may_say_is_its_dampers(tmp_path):
    (tmp_path / "calibration.yaml").write_text(share_file("config/calibration.yaml").read_text())
    (tmp_path / "least.yaml").write_text(
        """\
schema: mrctl/config/1
dampers:
  one:
    signals: {relative_velocity: RelVel_RL, body_acceleration: BodyAcc_RL, temperature: CaseTemp_RL}
    command: Cur_RL
"""
    )
    config = load_config(tmp_path / "least.yaml")
    assert config.database == share_file("dbc/mrctl.dbc")
    # As the DBC's cycle times say.
    assert dict(config.frames.receive) == {
        "RelativeVelocity": 500.0,
        "BodyAcceleration": 200.0,
        "CaseTemperature": 10.0,
    }
    assert dict(config.frames.send) == {
        "CurrentCommand": 500.0,
        "ControllerState": 50.0,
        "Health": 10.0,
        "HealthTiming": 1.0,
        "HealthRejects": 1.0,
    }


def test_a_damper_may_have_its_own_calibration(tmp_path):
    text = share_file("config/calibration.yaml").read_text()
    (tmp_path / "calibration.yaml").write_text(text)
    (tmp_path / "other.yaml").write_text(text.replace("name: MagneRide-like damper", "name: rear one"))
    vehicle_text = (
        share_file("config/vehicle.yaml")
        .read_text()
        .replace("../dbc/mrctl.dbc", str(share_file("dbc/mrctl.dbc")))
        .replace("    command: Cur_RR\n", "    command: Cur_RR\n    calibration: other.yaml\n")
    )
    (tmp_path / "v.yaml").write_text(vehicle_text)
    config = load_config(tmp_path / "v.yaml")
    assert config.calibrations["rear_right"].name == "rear one"
    assert config.calibrations["rear_left"].name == "MagneRide-like damper"
    assert config.calibrations["rear_left"] is config.calibrations["front_left"]


def test_another_channel_changes_nothing_else():
    config = vehicle()
    other = config.on_bus("can7")
    assert other.bus.channel == "can7"
    assert other.on_bus("vcan0") == config
    assert config.on_bus("x", "virtual").bus.interface == "virtual"


def test_a_configuration_cannot_be_changed_afterwards():
    config = vehicle()
    with pytest.raises(TypeError):
        config.dampers["x"] = None
    with pytest.raises(ValueError, match="frozen"):
        config.bus.channel = "x"


def test_every_law_and_map_is_named_in_the_car_s_comments():
    text = share_file("config/vehicle.yaml").read_text()
    for name in (*LAWS, *CURRENT_MAPS):
        assert re.search(rf"\b{name}\b", text), name


def test_the_shipped_json_schema_is_current():
    text = share_file("config/config.schema.json").read_text()
    # After a change of the models: Path("config/config.schema.json").write_text(config_json_schema())
    assert text == config_json_schema()
    assert set(json.loads(text)["required"]) == {"schema", "dampers"}
