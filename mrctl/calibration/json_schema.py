"""The calibration's JSON Schema, for editors that complete and check while one types."""

from __future__ import annotations

import json

from mrctl.calibration.models import CalibrationFile


def calibration_json_schema() -> str:
    """The text of config/calibration.schema.json."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "mrctl/calibration/1",
        **CalibrationFile.model_json_schema(by_alias=True),
        "title": "mrctl calibration",
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
