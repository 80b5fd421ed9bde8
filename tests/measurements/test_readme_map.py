"""The README's example of a column map reads what it says it reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrctl.measurements import load_campaign

README = Path(__file__).parents[2] / "README.md"


def test_the_example_of_a_map_reads_a_file_like_that(tmp_path):
    section = README.read_text(encoding="utf-8").partition("## Measurement files")[2]
    (tmp_path / "map.yaml").write_text(section.partition("```yaml\n")[2].partition("```")[0])
    t = np.arange(1000) / 500.0
    v = 0.3 * np.sin(2.0 * np.pi * 2.0 * t)
    force = 4.0 * np.tanh(v / 0.05)  # a small damper's
    rows = np.column_stack([1e3 * t, -1e3 * v, 1e-3 * force, np.full(t.size, 0.5)])
    lines = ["Zeit [ms];v [mm/s];Kraft [kN];Strom [A]"]
    lines += [";".join(f"{x:.9f}".replace(".", ",") for x in row) for row in rows]
    data = tmp_path / "data"
    data.mkdir()
    (data / "run.csv").write_text("\n".join(lines) + "\n")
    (run,) = load_campaign(data, tmp_path / "map.yaml").runs
    assert run.sample_rate_hz == pytest.approx(500.0)
    assert run.velocity_m_s == pytest.approx(v, abs=1e-6)
    assert run.force_n == pytest.approx(force, abs=1e-5)
    assert np.all(run.temperature_c == 40.0)
    assert np.all(run.current_a == 0.5)
