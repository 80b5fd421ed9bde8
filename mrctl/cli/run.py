"""`mrctl run`: the daemon."""

from __future__ import annotations

import argparse

from mrctl.config import load_config
from mrctl.runtime.daemon import Daemon
from mrctl.runtime.log import daemon_logger


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl run`."""
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="configuration, YAML")
    parser.add_argument("--channel", help="CAN channel, instead of the configuration's")
    parser.add_argument("--interface", help="interface of python-can, instead of the configuration's")
    parser.add_argument("--duration", type=float, metavar="SECONDS", help="stop by itself after so long")
    parser.epilog = """\
Reads sensor frames, sends current commands. SIGTERM or Ctrl-C ramps every current to 0 A, sends a last 0 A
frame and ends. SIGHUP takes changed calibrations over between two ticks, or says why not and keeps the old
ones. Under systemd (Type=notify) it reports readiness, status and a watchdog from the tick.

examples:
  sudo ip link add vcan0 type vcan && sudo ip link set vcan0 up
  mrctl run -c config/vehicle.yaml                 # the controller
  mrctl plant -c config/vehicle.yaml               # in another terminal: a car to control
  candump vcan0                                    # in a third: the frames
"""


def run(args: argparse.Namespace) -> int:
    """Run the daemon until it is told to stop."""
    config = load_config(args.config).on_bus(args.channel, args.interface)
    with daemon_logger(config.log.level) as log:
        return Daemon(config, log).run(args.duration)
