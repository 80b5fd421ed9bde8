from __future__ import annotations

from pathlib import Path

import pytest

UTFSM = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "utfsm"

SINES_MAP = r"""
schema: mrctl/columns/1
files: "*A.txt"
header: 0
delimiter: whitespace
columns:
  time_s: 1
  displacement_m: {column: 2, unit: mm}
  velocity_m_s: {column: 3, unit: mm/s}
  force_N: 4
constants:
  temperature_C: {value: 72, unit: degF}
from_name:
  pattern: 'Hz(?P<current_A>[\dx]+)A'
"""

RAW_MAP = """
schema: mrctl/columns/1
files: raw_*.txt
header: 7
sample_rate_hz: 1000
columns:
  displacement_m: {column: CHANNEL0, scale: 10 mm/V}
  force_N: {column: CHANNEL1, scale: 980.665 N/V}
constants: {temperature_C: 22}
split:
  column: Events
  after: DAQ Pause
  values: {current_A: [0, 0.25, 0.5, 0.75, 1]}
"""


@pytest.fixture(scope="session")
def utfsm() -> Path:
    """The folder of real measurements; tests that need it are skipped, loudly, where it is not."""
    missing = [str(path) for path in (UTFSM, UTFSM / "raw_10mm_2Hz.txt") if not path.exists()]
    if missing:
        pytest.skip(f"REAL DATA NOT TESTED: missing {', '.join(missing)}")
    return UTFSM


@pytest.fixture
def sines_map(tmp_path) -> Path:
    path = tmp_path / "sines.yaml"
    path.write_text(SINES_MAP)
    return path


@pytest.fixture
def raw_map(tmp_path) -> Path:
    path = tmp_path / "raw.yaml"
    path.write_text(RAW_MAP)
    return path
