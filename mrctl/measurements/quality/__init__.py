"""The quality gate: what is wrong with a run or a campaign, before any fit sees it."""

from __future__ import annotations

from mrctl.measurements.quality.finding import Finding
from mrctl.measurements.quality.gate import check_campaign, check_run, require_sound

__all__ = ["Finding", "check_campaign", "check_run", "require_sound"]
