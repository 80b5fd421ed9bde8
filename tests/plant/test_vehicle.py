"""The vehicle between frames in and frames out: rates, protection, obedience; and the controller on it."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from mrctl.can import e2e
from mrctl.can.codec import make_decoder, make_encoder
from mrctl.config import load_config
from mrctl.plant.vehicle import Vehicle
from mrctl.runtime.build import frame_specs, input_signals, plan_of
from mrctl.runtime.tick import LoopFigures, Tick
from mrctl.share_path import share_file

CONFIG = load_config(share_file("config/vehicle.yaml"))
SPECS = {spec.linux_id: spec for spec, _ in input_signals(CONFIG)}
COMMAND = frame_specs(CONFIG)["CurrentCommand"]
FIGURES = LoopFigures()


def vehicle(config=CONFIG, **update):
    noisy = update.pop("noisy", False)
    return Vehicle(config, config.plant.model_copy(update=update), noisy=noisy)


def drive(car, seconds, frames=lambda _tick: ()):
    out = []
    for tick in range(round(seconds / car.period_s)):
        out += car.step(frames(tick), 1, FIGURES)
    return out


def commands(current_a):
    encode = make_encoder(COMMAND)
    return lambda tick: [(COMMAND.linux_id, encode((current_a,) * 4, tick))]


def test_frames_come_at_their_configured_rates():
    sent = Counter(SPECS[can_id].name for can_id, _ in drive(vehicle(), 2.0))
    for name, rate_hz in CONFIG.frames.receive.items():
        assert sent[name] == pytest.approx(2.0 * rate_hz, abs=1)


def test_every_frame_is_protected_and_counted_in_order():
    counters = {}
    for can_id, data in drive(vehicle(), 0.5):
        assert e2e.check(data, SPECS[can_id].data_ids)
        counter = e2e.counter_of(data)
        assert counter == (counters.get(can_id, -1) + 1) & 0xF
        counters[can_id] = counter


def test_signals_carry_what_is_true():
    car = vehicle(temperature_c=47.0)
    last = dict(drive(car, 3.0))
    for spec, users in input_signals(CONFIG):
        values = make_decoder(spec)(last[spec.linux_id])
        for value, signal, [(corner, role)] in zip(values, spec.signals, users, strict=True):
            state = car._corners[corner].state()
            truth = {
                "relative_velocity": state.relative_velocity_m_s,
                "body_velocity": state.body_velocity_m_s,
                "temperature": state.temperature_c,
            }[role]
            # The temperature was sent up to a tenth of a second ago.
            assert value == pytest.approx(truth, abs=0.51 * signal.factor + 0.01 * (role == "temperature"))


def test_left_and_right_differ_and_the_rear_follows_the_front():
    car = vehicle(speed_m_s=27.0)  # the wheelbase of 2.7 m in 0.1 s
    heights = [[], [], [], []]
    for _ in range(1000):
        car.step((), 1, FIGURES)
        for corner, of_corner in zip(car._corners, heights, strict=True):
            of_corner.append(corner.car._road_m)
    front_left, front_right, rear_left, rear_right = heights
    assert max(abs(a - b) for a, b in zip(front_left, front_right, strict=True)) > 0.002
    lag = round(0.1 / car.period_s)
    assert rear_left[lag:] == pytest.approx(front_left[:-lag], abs=1e-9)
    assert rear_right[lag:] == pytest.approx(front_right[:-lag], abs=1e-9)


def test_commands_reach_the_coils_and_silence_takes_them_back():
    car = vehicle()
    drive(car, 0.5, commands(1.5))
    assert all(corner.damper.current_a == pytest.approx(1.5, abs=0.01) for corner in car._corners)
    drive(car, 0.3)
    assert all(corner.damper.current_a < 0.01 for corner in car._corners)
    assert car.summary()["timeouts"] == 1


def test_rubbish_on_the_commands_identifier_is_counted_and_changes_nothing():
    car = vehicle()
    drive(car, 0.05, lambda _tick: [(COMMAND.linux_id, bytes(8)), (COMMAND.linux_id, b"1")])
    assert all(corner.damper.current_a == 0.0 for corner in car._corners)
    assert car.summary()["rejected"] == {"crc": 25, "malformed": 25}


def test_remote_and_foreign_frames_are_not_commands():
    car = vehicle()
    command = commands(1.0)(0)[0][1]
    drive(car, 0.02, lambda _tick: [(COMMAND.linux_id | 0x40000000, command), (0x7FF, command)])
    assert car.summary()["commands"] == 0


def test_late_step_drives_the_missed_way_but_sends_no_burst():
    slow, quick = vehicle(), vehicle()
    drive(quick, 0.1)
    frames = slow.step((), 50, FIGURES)
    assert len(frames) == len(SPECS)
    assert slow._corners[0].state() == quick._corners[0].state()
    assert slow.lost_periods == 0


def test_suspended_vehicle_does_not_drive_the_whole_way_it_missed():
    car = vehicle()
    car.step((), 5_000, FIGURES)
    assert car.summary()["lost_seconds"] == pytest.approx(10.0 - 0.25)


def test_same_seed_same_drive():
    assert drive(vehicle(noisy=True), 0.2) == drive(vehicle(noisy=True), 0.2)
    assert drive(vehicle(noisy=True), 0.2) != drive(vehicle(noisy=True, seed=2), 0.2)


def test_bench_configuration_gets_its_displacement_and_force():
    bench = load_config(share_file("config/bench.yaml"))
    sent = {spec.linux_id: spec.name for spec, _ in input_signals(bench)}
    names = {sent[can_id] for can_id, _ in drive(vehicle(bench), 0.1)}
    assert names == set(bench.frames.receive)


def test_controller_and_vehicle_ride_better_together_than_the_vehicle_alone():
    def ride(controlled):
        car, tick, answers = vehicle(), Tick(plan_of(CONFIG)), []
        for _ in range(round(8.0 / car.period_s)):
            frames = car.step(answers, 1, FIGURES)
            answers = tick.step(frames, 1, FIGURES) if controlled else []
        return car.summary()

    alone, together = ride(controlled=False), ride(controlled=True)
    assert together["rejected"] == {}
    assert together["timeouts"] == 0
    assert together["commands"] > 3900

    def acceleration(summary):
        dampers = summary["dampers"].values()
        return math.sqrt(sum(d["body_acceleration_rms_m_s2"] ** 2 for d in dampers) / len(dampers))

    assert acceleration(together) < 0.9 * acceleration(alone)
