"""The configuration's JSON Schema, for editors that complete and check while one types."""

from __future__ import annotations

import json

from mrctl.config.models import ConfigFile


def config_json_schema() -> str:
    """The text of config/config.schema.json."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "mrctl/config/1",
        **ConfigFile.model_json_schema(by_alias=True),
        "title": "mrctl configuration",
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
