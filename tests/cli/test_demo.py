"""The demonstration: one case through the tick, four dampers on a bus, the page."""

from __future__ import annotations

import pytest

from mrctl.config import load_config
from mrctl.demo import scenario
from mrctl.demo.bus import run_on_bus
from mrctl.demo.report import Outcome, write_report
from mrctl.share_path import share_file

CONFIG = load_config(share_file("config/vehicle.yaml"))


def test_four_dampers_on_a_bus_run_and_come_to_rest():
    bus = run_on_bus(CONFIG, 2.0)
    assert bus.rejected == 0
    assert bus.rest_a == 0.0
    assert bus.states["ACTIVE"] > 4 * 400
    assert bus.states["LIMP"] == bus.states["SUBSTITUTE"] == 0
    assert bus.frames_to_controller == 2 * round(bus.seconds * 500) + -(-round(bus.seconds * 500) // 50)


@pytest.mark.slow
def test_the_inverse_tracks_best_and_the_page_says_what_came_out(monkeypatch, tmp_path):
    """A shorter drive than the demo's, all its cases."""
    monkeypatch.setattr(scenario, "DURATION_S", 6.0)
    results = [scenario.run_case(CONFIG.path, strategy, T) for strategy, T in scenario.cases()]
    outcome = Outcome(results)
    for temperature_c in scenario.TEMPERATURES_C:
        errors = {
            s.label: outcome.of(s, temperature_c).metrics.tracking_rms_n
            for s in scenario.STRATEGIES
            if s.current_map
        }
        assert min(errors, key=errors.get) == "skyhook, mrctl"
        assert outcome.ratio(temperature_c, ideal=True) < 1.0 / 3.0
    assert outcome.ratio(25.0) < 1.0 / 3.0
    size = write_report(outcome, run_on_bus(CONFIG, 0.5), CONFIG, tmp_path / "report.html")
    assert size < 3_000_000
    page = (tmp_path / "report.html").read_text()
    assert all(line in page for line in ("skyhook, mrctl", "With an ideal coil", "last command"))
