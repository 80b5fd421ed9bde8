"""The demonstration: one case through the tick, four dampers on a bus, the page."""

from __future__ import annotations

import pytest
from discover.hidden import among

from mrctl.config import load_config
from mrctl.demo import hidden, scenario
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


@pytest.mark.long
def test_a_hidden_effect_is_found_from_csv_and_commanded(tmp_path, monkeypatch):
    among(monkeypatch, hidden.HIDDEN, "coulomb_friction", "fluid_inertia", "stroke_dependent_damping")
    shares = []
    story = hidden.tell(CONFIG, tmp_path, lambda share, _what: shares.append(share))
    assert story.found == (hidden.HIDDEN,)
    assert story.verdict == "none"
    (_, before_n), (names, after_n) = story.steps
    assert names == story.found
    assert after_n < 0.25 * before_n
    assert story.tracking_after_n < 0.2 * story.tracking_before_n
    assert story.bus.rejected == 0
    assert story.bus.states["ACTIVE"] > 4 * 400
    assert load_config(story.config).calibrations["rear_left"].damper.effects[0].name == hidden.HIDDEN
    assert shares == sorted(shares)
    assert {path.name for path in tmp_path.iterdir()} == {
        "campaign", "found.yaml", "found.html", "falling_error.svg", "vehicle.yaml",
    }  # fmt: skip
    assert all(len(line) < 120 for line in story.lines()[:-2])


def test_a_force_that_the_model_knows_is_made_as_asked():
    damper = CONFIG.calibrations["front_left"].damper
    assert hidden.missed_by(damper, damper) < 10.0  # 1 % of the wish


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
