"""Measurements: CSV campaigns, foreign files, MAT, MDF4 and CAN logs in; checked runs in SI units out."""

from __future__ import annotations

from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.export import write_run_csv
from mrctl.measurements.load import load_campaign, load_run
from mrctl.measurements.run import CHANNELS, Campaign, Channel, Run

__all__ = [
    "CHANNELS",
    "Campaign",
    "Channel",
    "RawRun",
    "Run",
    "assemble",
    "load_campaign",
    "load_run",
    "write_run_csv",
]
