"""An effect as plain data, for JSON and reports."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from mrctl.model.effects.base import Effect


def card(effect: Effect) -> dict[str, Any]:
    """All there is to know of an effect; every value is text, a number, a truth value or a list of such."""
    return {
        "name": effect.name,
        "stage": str(effect.stage),
        "summary": effect.summary,
        "equation": effect.equation,
        "source": effect.source,
        "parameters": [asdict(p) | {"scale": p.step_scale} for p in effect.parameters],
        "needs": sorted(effect.needs),
        "shape_over": sorted(effect.shape_over),
        "states": list(effect.states),
        "inverse": str(effect.inverse),
        "inverse_note": effect.inverse_note,
    }
