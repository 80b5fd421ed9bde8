"""The paper's identification method, step by step."""

from __future__ import annotations

from mrctl.identify.paper.identify import PaperResult, PaperSteps, identify_paper
from mrctl.identify.paper.options import PaperOptions

__all__ = ["PaperOptions", "PaperResult", "PaperSteps", "identify_paper"]
