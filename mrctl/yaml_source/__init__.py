"""YAML files as people write them: plain data with the line of every value, and every slip said at once."""

from __future__ import annotations

from mrctl.yaml_source.document import Document, Findings, KeyPath
from mrctl.yaml_source.reader import parse_document, read_document
from mrctl.yaml_source.schema import StrictModel, check_model, quiet_model, schema_version

__all__ = [
    "Document",
    "Findings",
    "KeyPath",
    "StrictModel",
    "check_model",
    "parse_document",
    "quiet_model",
    "read_document",
    "schema_version",
]
