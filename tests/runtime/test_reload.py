"""Calibrations taken over by a running controller: what is taken, what is refused, and no jump."""

from __future__ import annotations

import math
import os
import select
import shutil
import signal
from itertools import pairwise

import pytest
from runtime.bench import Sender, currents

from mrctl.config import load_config
from mrctl.runtime.build import plan_of
from mrctl.runtime.reload import Reloader, read_again
from mrctl.runtime.swap import CalibrationSwap
from mrctl.runtime.tick import Tick
from mrctl.share_path import share_file


class FakeLog:
    def __init__(self):
        self.lines = []

    def info(self, event, **fields):
        self.lines.append((event, fields))

    warning = info


@pytest.fixture
def folder(tmp_path):
    for name in ("config/vehicle.yaml", "config/calibration.yaml", "dbc/mrctl.dbc"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(share_file(name), tmp_path / name)
    return tmp_path / "config"


@pytest.fixture
def config(folder):
    return load_config(folder / "vehicle.yaml")


def edit(folder, *changes, file="calibration.yaml"):
    text = (folder / file).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / file).write_text(text)


OTHER_FORCES = ("values: [290.0, 530.0, 760.0,", "values: [290.0, 500.0, 700.0,")


class Controller:
    """A tick with its side of the reload, driven with good frames on a wavy road."""

    def __init__(self, config):
        self.log = FakeLog()
        self.tick = Tick(plan_of(config))
        self.reloader = Reloader(config)
        self.swap = CalibrationSwap(config, self.tick, self.reloader, self.log)
        self.sender = Sender()
        self.sent = []

    def run(self, ticks):
        for _ in range(ticks):
            t = self.tick.now / 500.0
            frames = self.sender.all(
                velocity=0.3 * math.sin(9 * t), body=0.4 * math.sin(7 * t), temperature=60.0
            )
            self.sent.append(currents(self.tick.step(frames)))
            if self.swap.active:
                self.swap.advance()

    def reload(self):
        """Ask, and run on until it is over: no more than the answer is waited for."""
        self.swap.wanted = True
        self.run(1)
        assert select.select([self.reloader._helper.from_child], [], [], 20.0)[0]
        while self.swap.active:
            self.run(1)


@pytest.fixture
def controller(config):
    made = Controller(config)
    yield made
    made.reloader.close()


def test_a_changed_calibration_is_taken_over_between_two_ticks_without_a_jump(controller, folder, config):
    controller.run(300)
    maps = [corner._map for corner in controller.tick.corners]
    edit(folder, OTHER_FORCES)
    controller.reload()
    (event, fields), *more = controller.log.lines
    assert (event, more) == ("calibration taken over", [])
    assert fields["calibrations"]
    assert "not_taken" not in fields
    assert not {id(corner._map) for corner in controller.tick.corners} & {id(old) for old in maps}
    controller.run(300)
    step_a = config.calibrations["front_left"].damper.current_slew_a_s / 500.0
    for before, after in pairwise(controller.sent):
        assert all(abs(b - a) <= step_a + 0.0011 for a, b in zip(before, after, strict=True))


def test_after_a_reload_the_controller_commands_what_a_fresh_one_would(controller, folder):
    edit(folder, OTHER_FORCES)
    controller.run(30)
    controller.reload()
    fresh = Controller(load_config(folder / "vehicle.yaml"))
    fresh.run(controller.tick.now)
    for one in (controller, fresh):
        one.run(1500)
    fresh.reloader.close()
    for reloaded, new in zip(controller.sent[-500:], fresh.sent[-500:], strict=True):
        assert reloaded == pytest.approx(new, abs=0.0021)


def test_a_broken_calibration_is_refused_with_its_line_and_the_old_one_goes_on(controller, folder):
    controller.run(50)
    maps = [corner._map for corner in controller.tick.corners]
    edit(folder, ("schema: mrctl/calibration/1", "schema: mrctl/calibration/1\nnonsense: 1"))
    controller.reload()
    ((event, fields),) = controller.log.lines
    assert event == "calibration kept"
    assert "calibration.yaml:" in fields["refused"]
    assert [corner._map for corner in controller.tick.corners] == maps
    edit(folder, ("\nnonsense: 1", ""))
    controller.reload()
    assert [event for event, _ in controller.log.lines] == ["calibration kept", "calibration taken over"]


def test_a_missing_file_and_changed_limits_are_refused(folder, config):
    text = (folder / "calibration.yaml").read_text()
    (folder / "calibration.yaml").unlink()
    assert "there is no file" in read_again(config).refused
    (folder / "calibration.yaml").write_text(text)
    edit(folder, ("current_slew: {unit: A/s, value: 400.0}", "current_slew: {unit: A/s, value: 200.0}"))
    refused = read_again(config).refused
    assert "current_slew_a_s changed from" in refused
    assert refused.endswith("limits change with a restart only")


def test_what_else_changed_in_the_configuration_is_named_and_left(folder, config):
    edit(folder, ("limp_current_a: 1.0", "limp_current_a: 0.5"), file="vehicle.yaml")
    again = read_again(config)
    assert not again.refused
    assert again.not_taken == ("safety",)
    edit(folder, ("  rear_right:", "  behind_right:"), file="vehicle.yaml")
    assert "has no damper rear_right any more" in read_again(config).refused


def test_a_helper_that_has_died_refuses_and_does_not_stop_the_controller(controller):
    os.kill(controller.reloader._helper.pid, signal.SIGKILL)
    os.waitid(os.P_PID, controller.reloader._helper.pid, os.WEXITED | os.WNOWAIT)
    controller.reload()
    ((event, fields),) = controller.log.lines
    assert event == "calibration kept"
    assert "has ended; restart" in fields["refused"]
    controller.run(10)
