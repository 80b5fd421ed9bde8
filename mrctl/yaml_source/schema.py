"""Data against a pydantic model: every violation becomes one line with file, line and mend."""

from __future__ import annotations

import re
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from mrctl.yaml_source.document import Document, Findings, KeyPath
from mrctl.yaml_source.wording import explain, shown

M = TypeVar("M", bound=BaseModel)

_SCHEMA = re.compile(r"mrctl/([a-z_]+)/(\d{1,6})")


class StrictModel(BaseModel):
    """Base of all schema models: no unknown keys, no guessing of types, no NaN, no change afterwards."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,
        serialize_by_alias=True,
    )


def schema_version(document: Document, kind: str, newest: int, findings: Findings) -> bool:
    """Whether `schema:` leaves the file readable as this kind; adds what is wrong with it.

    Without `schema:` the rest can still be judged; a newer or another schema would only be misread.
    """
    said = document.data.get("schema")
    right = f"mrctl/{kind}/{newest}"
    match = _SCHEMA.fullmatch(said) if isinstance(said, str) else None
    if "schema" not in document.data:
        findings.add((), "`schema` is missing", f"begin the file with `schema: {right}`")
        return True
    if match is None or match[1] != kind or int(match[2]) < 1:
        findings.add(("schema",), f"schema {shown(said)} is not that of a {kind}", f"write `schema: {right}`")
        return False
    if int(match[2]) > newest:
        what = f"schema {said} is newer than this mrctl, which reads up to {right}"
        findings.add(("schema",), what, "the file was written by a newer mrctl: update mrctl")
        return False
    return True


def check_model(model: type[M], data: object, findings: Findings, path: KeyPath = ()) -> M | None:
    """The validated model, or None with everything wrong added to the findings."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            where = (*path, *detail["loc"])
            words = explain(model, detail, where, findings.document)
            if words is not None:
                findings.add(where, *words)
        return None


def quiet_model(model: type[M], data: object) -> M | None:
    """The validated model, or None; for judging one block of a file whose other blocks are broken."""
    try:
        return model.model_validate(data)
    except ValidationError:
        return None
