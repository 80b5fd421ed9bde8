"""The benchmark of the replay runs, and its sides have the same log."""

from __future__ import annotations

from mrctl.bench import replay
from mrctl.config import load_config
from mrctl.share_path import share_file


def test_a_replay_is_far_cheaper_than_python_can_cantools_and_numpy():
    cost = replay.measure(load_config(share_file("config/vehicle.yaml")), 2000, 1)
    assert cost.frames == 2 * 2000 + 40
    assert cost.seconds == 4.0
    assert cost.cpu_s[replay.WHOLE] > 2.0 * cost.cpu_s[replay.OURS]
    assert cost.cpu_s[replay.READ_ONLY] > 2.0 * cost.cpu_s[replay.READER]
