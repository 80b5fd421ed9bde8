"""The daemon's start and end, on a bus inside the process."""

from __future__ import annotations

from uuid import uuid4

import pytest
import structlog

from mrctl.can.codec import make_decoder, make_encoder
from mrctl.can.frames import State
from mrctl.can.quiet_import import can
from mrctl.config import load_config
from mrctl.runtime.build import frame_specs, input_signals
from mrctl.runtime.daemon import Daemon
from mrctl.share_path import share_file

VALUES = {"temperature": 50.0}


@pytest.fixture
def config(tmp_path):
    text = share_file("config/bench.yaml").read_text(encoding="utf-8")
    for source in (share_file("config/calibration.yaml"), share_file("dbc/mrctl.dbc")):
        (tmp_path / source.name).write_bytes(source.read_bytes())
    text = text.replace("../dbc/", "").replace("interface: socketcan", "interface: virtual")
    text = text.replace("channel: vcan0", f"channel: {uuid4()}")
    text += "\nrealtime: {lock_memory: false, freeze_gc: false, cpu_awake: false}\n"
    (tmp_path / "bench.yaml").write_text(text, encoding="utf-8")
    loaded = load_config(tmp_path / "bench.yaml")
    assert loaded.bus.interface == "virtual"
    return loaded


def good_frames(config, counter):
    for spec, users in input_signals(config):
        values = [VALUES.get(of_signal[0][1], 0.1) if of_signal else 0.0 for of_signal in users]
        yield can.Message(
            arbitration_id=spec.linux_id, is_extended_id=False, data=make_encoder(spec)(values, counter)
        )


def states_reached(config, *, before_start):
    """The states that the daemon tells of on a bus where 40 good frames of each kind come, and no more."""
    spec = frame_specs(config)["ControllerState"]
    daemon = Daemon(config, structlog.get_logger())
    port = daemon._port
    with can.Bus(interface="virtual", channel=config.bus.channel) as car:

        def lay():
            for counter in range(40):
                for message in good_frames(config, counter):
                    car.send(message)

        if before_start:
            lay()
        else:
            discard = port.discard

            def discard_then_lay():
                discard()
                lay()

            port.discard = discard_then_lay
        daemon.run(0.4)
        told = [
            message for message in iter(lambda: car.recv(0), None) if message.arbitration_id == spec.linux_id
        ]
    assert len(told) >= 3
    return {State(int(make_decoder(spec)(bytes(message.data))[0])) for message in told}, port.counters


def test_frames_that_waited_since_before_the_first_tick_are_not_used(config):
    states, counters = states_reached(config, before_start=True)
    assert states <= {State.INIT, State.OFF}  # OFF: it was stopped
    assert (counters.received, counters.stale) == (0, 40 * len(input_signals(config)))


def test_the_same_frames_after_the_start_are(config):
    states, counters = states_reached(config, before_start=False)
    assert states & {State.ACTIVE, State.SUBSTITUTE, State.LIMP}
    assert (counters.received, counters.stale) == (40 * len(input_signals(config)), 0)
