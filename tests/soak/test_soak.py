"""A small part of the soak; `python tests/soak/ticks.py` is the whole, of millions of ticks."""

from __future__ import annotations

import gc

from soak.ticks import Clock, Soak

from mrctl.config import load_config
from mrctl.share_path import share_file


def test_every_period_is_a_tick_or_a_skip_and_nothing_is_collected(capsys):
    config = load_config(share_file("config/vehicle.yaml"))
    clock = Clock(1)
    soak = Soak(config, 40_000, clock, clock.sleep, 1)
    gc.collect()
    gc.disable()
    try:
        assert soak.run(2_000_000), capsys.readouterr().out
    finally:
        gc.enable()
    assert soak.loop.skipped > 0
    assert "ACTIVE" in soak.states
