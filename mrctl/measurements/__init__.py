"""Measurements: CSV campaigns, foreign files, MAT, MDF4 and CAN logs in; checked runs in SI units out."""

from __future__ import annotations

from mrctl.measurements.assemble import RawRun, assemble
from mrctl.measurements.export import write_run_csv
from mrctl.measurements.load import load_campaign, load_run
from mrctl.measurements.quality import Finding, check_campaign, check_run, require_sound
from mrctl.measurements.run import CHANNELS, Campaign, Channel, Run

__all__ = [
    "CHANNELS",
    "Campaign",
    "Channel",
    "Finding",
    "RawRun",
    "Run",
    "assemble",
    "check_campaign",
    "check_run",
    "load_campaign",
    "load_run",
    "require_sound",
    "write_run_csv",
]
