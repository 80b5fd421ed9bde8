"""The tick: states, their causes, and what leaves under each fault."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from runtime.bench import DAMPER, GOOD_FRAMES, LIMP_A, RATE_HZ, SPECS, Sender, active, currents, plan

from mrctl.can.frames import State
from mrctl.control.base import Motion
from mrctl.runtime.tick import Tick

STEP_A = DAMPER.current_slew_a_s / RATE_HZ


@pytest.fixture
def tick():
    return Tick(plan())


@pytest.fixture
def sender():
    return Sender()


def states(tick):
    return {corner.state for corner in tick.corners}


def causes(tick):
    return {tick.cause_of(corner) for corner in tick.corners}


def run(tick, seconds, frames=list):
    out = []
    for _ in range(round(seconds * RATE_HZ)):
        out = tick.step(frames())
    return out


def test_no_current_before_a_run_of_good_frames(tick, sender):
    for k in range(GOOD_FRAMES):
        out = tick.step(sender.all())
        assert currents(out) == (0.0,) * 4 or k == GOOD_FRAMES - 1
    assert states(tick) == {State.ACTIVE}
    assert run(tick, 0.1, sender.all)
    assert all(c.current_a > 0.0 for c in tick.corners)


def test_without_any_frame_it_starts_then_limps_then_goes_off(tick):
    run(tick, 1.9)
    assert states(tick) == {State.INIT}
    out = run(tick, 0.5)
    assert states(tick) == {State.LIMP}
    assert currents(out) == pytest.approx((LIMP_A,) * 4)
    out = run(tick, 3.0)
    assert states(tick) == {State.OFF}
    assert currents(out) == (0.0,) * 4


def test_lost_velocity_holds_then_limps_and_comes_back_by_itself(tick, sender):
    active(tick, sender)
    run(tick, 0.2, sender.all)
    held = tick.corners[0].current_a
    without = lambda: sender.all()[1:]  # noqa: E731
    run(tick, 0.010, without)  # five periods: still within the time-out
    assert states(tick) == {State.ACTIVE}
    tick.step(without())
    assert states(tick) == {State.SUBSTITUTE}
    assert causes(tick) == {"RELATIVE_VELOCITY_MISSING"}
    assert tick.corners[0].current_a == pytest.approx(held, abs=0.05)
    run(tick, 0.040, without)
    assert states(tick) == {State.LIMP}
    run(tick, 0.1, without)
    assert tick.corners[0].current_a == pytest.approx(LIMP_A)
    for _ in range(GOOD_FRAMES):  # the first only finds the counter again
        tick.step(sender.all())
    assert states(tick) == {State.LIMP}
    tick.step(sender.all())
    assert states(tick) == {State.ACTIVE}


def test_lost_body_velocity_is_replaced_by_constant_damping(tick, sender):
    active(tick, sender)
    run(tick, 0.2, lambda: [sender.all()[0], sender.all()[2]])
    assert states(tick) == {State.SUBSTITUTE}
    assert causes(tick) == {"BODY_MOTION_MISSING"}
    passive = plan().corners[0].substitute_law(Motion(0.1, 0.0, 50.0))
    assert passive > 0.0
    assert [corner.wish_n for corner in tick.corners] == [pytest.approx(passive)] * 4


def test_lost_temperature_holds_its_last_value(tick, sender):
    active(tick, sender)
    run(tick, 3.0, lambda: sender.all()[:2])
    assert states(tick) == {State.SUBSTITUTE}
    assert causes(tick) == {"CASE_TEMPERATURE_MISSING"}
    assert tick.corners[0].channels["temperature"].value == pytest.approx(50.0)
    assert tick.corners[0].current_a > 0.0


def test_one_damper_limps_alone(tick, sender):
    active(tick, sender)

    def frames():
        velocity = sender.frame("RelativeVelocity", [math.nan, 0.1, 0.1, 0.1])
        return [velocity, *sender.all()[1:]]

    run(tick, 0.1, frames)
    assert [c.state for c in tick.corners] == [State.LIMP, State.ACTIVE, State.ACTIVE, State.ACTIVE]
    assert tick.cause_of(tick.corners[0]) == "RELATIVE_VELOCITY_NOT_AVAILABLE"


def corrupt(frame):
    can_id, data = frame
    return can_id, bytes([data[0] ^ 1, *data[1:]])


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (corrupt, "RELATIVE_VELOCITY_CRC"),
        (lambda f: (f[0], f[1][:7]), "RELATIVE_VELOCITY_MALFORMED"),
        (lambda f: (f[0], f[1] + b"\0"), "RELATIVE_VELOCITY_MALFORMED"),
        (lambda f: (f[0], b""), "RELATIVE_VELOCITY_MALFORMED"),
    ],
    ids=["crc", "short", "long", "empty"],
)
def test_spoilt_frames_are_not_used_and_named(tick, sender, spoil, cause):
    active(tick, sender)
    run(tick, 0.1, lambda: [spoil(sender.all()[0]), *sender.all()[1:]])
    assert states(tick) == {State.LIMP}
    assert causes(tick) == {cause}


def test_a_repeated_frame_is_not_used(tick, sender):
    active(tick, sender)
    stuck = sender.all()[0]
    run(tick, 0.1, lambda: [stuck, *sender.all()[1:]])
    assert states(tick) == {State.LIMP}
    assert causes(tick) == {"RELATIVE_VELOCITY_COUNTER"}


def test_out_of_range_and_jumps_are_refused(tick, sender):
    active(tick, sender)
    run(tick, 0.1, lambda: [sender.frame("RelativeVelocity", [2.04] * 4), *sender.all()[1:]])
    assert causes(tick) == {"RELATIVE_VELOCITY_RANGE"}
    tick2, sender2 = Tick(plan()), Sender()
    active(tick2, sender2)
    tick2.step([*sender2.all()[:2], sender2.frame("CaseTemperature", [120.0] * 4)])
    assert tick2.rejected["rate"] == 4
    assert tick2.corners[0].channels["temperature"].value == pytest.approx(50.0)


def test_rubbish_changes_nothing(sender):
    """The same good frames with and without rubbish between them give the same bytes."""
    clean, dirty = Tick(plan()), Tick(plan())
    other = Sender()
    velocity_id = SPECS["RelativeVelocity"].linux_id
    rubbish = [
        (velocity_id | 0x40000000, b""),  # remote
        (0x20000040, bytes(8)),  # error frame: bus-off
        (0x7FF, bytes(8)),
        (velocity_id | 0x80000000, bytes(8)),
    ]
    for k in range(200):
        v = 0.2 * math.sin(k / 10.0)
        expected = clean.step(sender.all(velocity=v))
        assert [f for f in dirty.step([*rubbish, *other.all(velocity=v), *rubbish]) if f[0] != 1024] == [
            f for f in expected if f[0] != 1024
        ]
    assert dirty.rejected["remote_frame"] == dirty.rejected["error_frame"] == 400
    assert dirty.foreign == 800


def test_shutting_down_ramps_to_zero_and_stays(tick, sender):
    active(tick, sender)
    run(tick, 0.3, sender.all)
    before = [c.current_a for c in tick.corners]
    assert min(before) > 0.1
    tick.shut_down()
    previous = before[0]
    for _ in range(round(0.2 * RATE_HZ) + 1):
        now = currents(tick.step(sender.all()))[0]
        assert 0.0 <= previous - now <= STEP_A + 0.001
        previous = now
    assert tick.at_rest
    assert states(tick) == {State.OFF}
    assert causes(tick) == {"SHUTDOWN"}


def test_shutting_down_at_rest_still_sends_a_last_command(tick):
    tick.step([])
    assert tick.at_rest
    tick.shut_down()
    assert not tick.at_rest
    assert currents(tick.step([])) == (0.0,) * 4
    assert tick.at_rest


def test_skipped_periods_advance_the_filters(sender):
    """After a gap with held inputs, the command is the one of a controller that missed nothing."""
    whole, late = Tick(plan()), Tick(plan())
    other = Sender()
    for k in range(300):
        frames, same = sender.all(velocity=0.1 + k * 1e-4), other.all(velocity=0.1 + k * 1e-4)
        whole.step(frames)
        late.step(same)
    for _ in range(3):
        whole.step([])
    late.step([], periods=3)
    assert late.now == whole.now
    assert late.corners[0].current_a == pytest.approx(whole.corners[0].current_a, abs=0.002)


def test_state_changes_are_told_with_their_cause(tick, sender):
    active(tick, sender)
    run(tick, 0.1, lambda: sender.all()[1:])
    told = [(c.damper, c.before, c.after, c.cause) for c in tick.changes if c.damper == "FL"]
    assert told == [
        ("FL", State.INIT, State.ACTIVE, "NONE"),
        ("FL", State.ACTIVE, State.SUBSTITUTE, "RELATIVE_VELOCITY_MISSING"),
        ("FL", State.SUBSTITUTE, State.LIMP, "RELATIVE_VELOCITY_MISSING"),
    ]


def test_frames_leave_at_their_rates_with_running_counters(tick, sender):
    sent = [frame for _ in range(500) for frame in tick.step(sender.all())]
    for name, count in (("CurrentCommand", 500), ("ControllerState", 50), ("Health", 10)):
        counters = [data[1] & 0xF for can_id, data in sent if can_id == SPECS[name].linux_id]
        assert len(counters) == count
        assert all((b - a) & 0xF == 1 for a, b in pairwise(counters))


def test_after_a_silent_bus_no_current_flows_until_the_signals_have_shown(tick, sender):
    active(tick, sender)
    run(tick, 0.2, sender.all)
    run(tick, 6.0)
    assert states(tick) == {State.OFF}
    for _ in range(GOOD_FRAMES - 1):
        out = tick.step(sender.all())
        assert states(tick) == {State.INIT}
        assert currents(out) == (0.0,) * 4
    tick.step(sender.all())
    assert states(tick) == {State.ACTIVE}


def test_after_a_silent_bus_a_signal_that_stays_away_is_limped_without(tick, sender):
    active(tick, sender)
    run(tick, 6.0)
    run(tick, 1.9, lambda: sender.all()[1:])
    assert states(tick) == {State.INIT}
    run(tick, 0.2, lambda: sender.all()[1:])
    assert states(tick) == {State.LIMP}


def test_frames_that_were_held_up_and_come_at_once_are_no_jump(tick, sender):
    active(tick, sender)
    temperature = 50.0
    for _ in range(50):
        temperature += 1.0  # 10 K/s, at a frame every 100 ms
        held = [sender.frame("CaseTemperature", [temperature - 0.5] * 4)]
        held.append(sender.frame("CaseTemperature", [temperature] * 4))
        for _ in range(99):
            tick.step(sender.all()[:2])
        tick.step([*sender.all()[:2], *held])
    assert tick.rejected["rate"] == 0
    assert states(tick) == {State.ACTIVE}
