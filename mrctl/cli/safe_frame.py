"""`mrctl safe-frame`: a last 0 A command on behalf of a controller that is no more."""

from __future__ import annotations

import argparse
import time

from mrctl.can.codec import make_encoder
from mrctl.can.ports import open_port
from mrctl.config import load_config
from mrctl.errors import BusError
from mrctl.runtime.build import frame_specs

# The first frame after a jump of the counter only tells the receiver where the counter is now.
FRAMES = 3
APART_S = 0.01


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl safe-frame`."""
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="configuration, YAML")
    parser.add_argument("--channel", help="CAN channel, instead of the configuration's")
    parser.add_argument("--interface", help="interface of python-can, instead of the configuration's")
    parser.epilog = """\
For `ExecStopPost=` of a service: after a crash or a watchdog kill the power stages get 0 A at once instead of
after their own time-out.

example:
  mrctl safe-frame -c config/vehicle.yaml
"""


def run(args: argparse.Namespace) -> int:
    """Send the frames; returns 1 when the bus takes none."""
    config = load_config(args.config).on_bus(args.channel, args.interface)
    bus = config.bus
    spec = frame_specs(config)["CurrentCommand"]
    encode = make_encoder(spec)
    port = open_port(bus.interface, bus.channel, bus.bitrate, bus.fd, (), data_bitrate=bus.data_bitrate)
    try:
        sent = 0
        for counter in range(FRAMES):
            sent += port.send(spec.linux_id, encode([0.0] * len(spec.signals), counter))
            time.sleep(APART_S)
    finally:
        port.close()
    if not sent:
        raise BusError(f"{bus.channel} takes no frame; `ip -details link show {bus.channel}` says why")
    return 0
