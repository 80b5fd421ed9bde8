"""Every fault of the matrix (faults.py) on every damper: its state in time, named, and unaided back."""

from __future__ import annotations

from functools import cache

import pytest
from runtime.faults import FAULT_AT, FAULTS, RATE_HZ, TEMPERATURE, Bench, config

from mrctl.can.frames import State

TICK_MS = 1000.0 / RATE_HZ
DAMPERS = tuple(config().dampers)


@cache
def ran(fault, corner):
    return Bench(fault, corner).run()


@pytest.fixture(params=FAULTS, ids=lambda fault: fault.name)
def fault(request):
    return request.param


@pytest.fixture(params=range(4), ids=DAMPERS)
def corner(request):
    return request.param


@pytest.fixture
def bench(fault, corner):
    """A fault of a whole frame hits all dampers in one run."""
    return ran(fault, corner if fault.only else 0)


def test_the_defined_state_is_reached_in_time_and_the_cause_is_named(fault, corner, bench):
    before, during = bench.states[FAULT_AT - 1], bench.states[FAULT_AT:]
    assert set(before) == {State.ACTIVE}
    length = round(fault.seconds * RATE_HZ)
    if fault.state is None:
        assert {states[corner] for states in during[:length]} == {State.ACTIVE}
    else:
        first = next(n for n, states in enumerate(during, 1) if states[corner] is not State.ACTIVE)
        assert during[first - 1][corner] is fault.state
        assert first * TICK_MS <= fault.within_ms + TICK_MS
        assert fault.cause in bench.causes()
    if fault.then is not None:
        assert bench.reached_after(fault.then) <= fault.then_ms + 2 * TICK_MS


def test_no_other_damper_is_touched(fault, corner, bench):
    if fault.only:
        others = {states[k] for states in bench.states[FAULT_AT:] for k in range(4) if k != corner}
        assert others == {State.ACTIVE}
    else:
        assert {len(set(states)) for states in bench.states[FAULT_AT:]} == {1}


def test_it_recovers_unaided_within_the_good_frames_that_it_takes(fault, bench):
    cycle_ms = 100.0 if "temperature" in fault.name.lower() or fault.name.endswith("dead") else TICK_MS
    assert bench.recovered_after() <= (config().safety.reentry_good_frames + 1) * cycle_ms


def test_what_was_refused_is_counted(fault, bench):
    if fault.counted:
        assert bench.tick.rejected[fault.counted] > 0
    if fault.state is None and not fault.counted:
        assert not bench.tick.rejected


def test_every_command_keeps_range_and_slew(bench):
    damper = config().calibrations[DAMPERS[0]].damper
    assert all(0.0 <= current <= damper.current_max_a for command in bench.commands for current in command)
    assert bench.largest_step_a() <= damper.current_slew_a_s / RATE_HZ + 1e-9
    assert len(bench.commands) == len(bench.states)


def test_the_matrix_is_whole():
    assert len(FAULTS) >= 20
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)
    assert TEMPERATURE in bench_names()


def bench_names():
    return {name for name, _ in ran(FAULTS[0], 0).sent[49]}
