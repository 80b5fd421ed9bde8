"""Where the real measurements are, and what their columns mean."""

from pathlib import Path

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
