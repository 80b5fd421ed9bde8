"""The live view: what it makes of the frames on the bus, what it shows, and the command."""

from __future__ import annotations

import io
import json
import threading

import pytest

from mrctl.can.ports import open_port
from mrctl.cli.main import main
from mrctl.config import load_config
from mrctl.plant.vehicle import Vehicle
from mrctl.runtime.build import plan_of
from mrctl.runtime.loop import Loop
from mrctl.runtime.tick import LoopFigures, Tick
from mrctl.share_path import share_file
from mrctl.top.screen import fit, lines
from mrctl.top.watch import Watch

CONFIG_FILE = str(share_file("config/vehicle.yaml"))
FIGURES = LoopFigures(40.0, 160.0, 700.0, 3, 400.0, 60.0, 110.0, 350.0, 2, 17)


@pytest.fixture(scope="module")
def config():
    return load_config(CONFIG_FILE)


def drive(watch, config, seconds=2.2, spoil=lambda _n, frames: frames):
    """Controller and car in lock step on a clock of the test's; returns the end."""
    tick, car = Tick(plan_of(config)), Vehicle(config, config.plant)
    to_car = []
    now_s = 0.0
    for n in range(round(seconds * 500)):
        now_s = n / 500
        to_tick = spoil(n, car.step(to_car, 1, FIGURES))
        to_car = tick.step(to_tick, 1, FIGURES)
        watch.take([*to_tick, *to_car], now_s)
    watch.measure_rates(now_s)
    return now_s


def text_of(snapshot, **more):
    return "\n".join(lines(snapshot, stream=io.StringIO(), **more))


def test_a_controller_at_work_is_shown_with_all_its_figures(config):
    watch = Watch.of(config, 0.0)
    snapshot = watch.snapshot(drive(watch, config))
    assert snapshot["alive"]
    assert {damper["state"] for damper in snapshot["dampers"].values()} == {"ACTIVE"}
    assert all(damper["current_a"] is not None for damper in snapshot["dampers"].values())
    assert snapshot["lateness_us"] == {"p50": 40.0, "p99": 160.0, "p99.9": 400.0, "max": 700.0}
    assert snapshot["duration_us"] == {"p50": 60.0, "p99": 110.0, "max": 350.0}
    assert (snapshot["skipped_periods"], snapshot["long_ticks"]) == (3, 2)
    assert snapshot["rejected_by_reason"]["Dropped"] == 17
    for frame in snapshot["frames"].values():
        assert frame["rate_hz"] == pytest.approx(frame["expected_hz"], rel=0.15, abs=0.5)
        assert frame["bad"] == frame["lost"] == 0
    text = text_of(snapshot)
    assert "commands come" in text
    assert text.count("ACTIVE") == 4
    json.dumps(snapshot, allow_nan=False)


def test_a_broken_input_is_named_in_its_dampers_row_and_among_the_rejected(config):
    def spoil(n, frames):
        return [(i, bytes([d[0] ^ 1, *d[1:]]) if i == 0x110 and n > 600 else d) for i, d in frames]

    watch = Watch.of(config, 0.0)
    snapshot = watch.snapshot(drive(watch, config, 2.4, spoil))
    for damper in snapshot["dampers"].values():
        assert (damper["state"], damper["cause"]) == ("LIMP", "RELATIVE_VELOCITY_CRC")
    assert snapshot["rejected_by_reason"]["RejectedCRC"] == 62  # saturated
    assert snapshot["frames"]["RelativeVelocity"]["bad"] > 500
    text = text_of(snapshot)
    assert "RELATIVE_VELOCITY_CRC" in text
    assert "CRC 62" in text


def test_a_controller_that_falls_silent_is_called_so(config):
    watch = Watch.of(config, 0.0)
    assert "no controller on the bus" in text_of(watch.snapshot(5.0))
    end_s = drive(watch, config, 0.5)
    late = watch.snapshot(end_s + 3.0)
    assert not late["alive"]
    assert "no command for 3.0 s" in text_of(late)


def test_lost_frames_are_counted_by_their_counter(config):
    watch = Watch.of(config, 0.0)

    def spoil(n, frames):
        return [frame for frame in frames if not (frame[0] == 0x111 and n in {100, 101, 200})]

    drive(watch, config, 1.0, spoil)
    assert watch.frames[0x111].lost == 3


def test_lines_are_cut_to_the_terminal_without_leaving_a_colour_on():
    cut = fit(["\x1b[32mgreen text\x1b[0m", "plain text", "third"], 5, 2)
    assert cut == ["\x1b[32mgreen\x1b[0m", "plain"]


@pytest.fixture
def bus():
    """A controller and a car on a virtual bus, in threads: its channel."""
    config = load_config(CONFIG_FILE).on_bus("test-top", "virtual")
    tick, car = Tick(plan_of(config)), Vehicle(config, config.plant)
    stop = threading.Event()
    threads, ports = [], []
    for side, rate_hz in ((tick, 500.0), (car, 1.0 / car.period_s)):
        port = open_port("virtual", "test-top", 500_000, False, side.wanted_ids)
        run = Loop(side, port, rate_hz).run
        threads.append(threading.Thread(target=run, args=(stop.is_set,)))
        ports.append(port)
    for thread in threads:
        thread.start()
    yield "test-top"
    stop.set()
    for thread in threads:
        thread.join()
    for port in ports:
        port.close()


def test_once_prints_json_or_text_and_ends(bus, capsys):
    argv = ["top", "-c", CONFIG_FILE, "--interface", "virtual", "--channel", bus, "--once"]
    assert main([*argv, "--json", "-"]) == 0
    snapshot = json.loads(capsys.readouterr().out)
    assert snapshot["alive"]
    assert snapshot["lateness_us"]["p50"] is not None
    assert main([*argv, "--log", "no-such.log"]) == 0
    text = capsys.readouterr().out
    assert "CurrentCommand" in text
    assert "no-such.log: No such file or directory" in text


def test_a_bus_without_a_controller_is_one_line_and_status_1(capsys):
    argv = ["top", "-c", CONFIG_FILE, "--interface", "virtual", "--channel", "test-empty", "--once"]
    assert main(argv) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: no command of a controller on test-empty in 2.2 s; ")
