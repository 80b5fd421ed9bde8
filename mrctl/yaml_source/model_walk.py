"""Finding one's way in a pydantic model by the location of an error."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo


def field_at(model: type[BaseModel], location: tuple[str | int, ...]) -> FieldInfo | None:
    """The model's field that a location names, if it names one."""
    parent = model_at(model, location[:-1])
    if parent is None or not location:
        return None
    return next((f for n, f in parent.model_fields.items() if (f.alias or n) == location[-1]), None)


def model_at(model: type[BaseModel], location: tuple[str | int, ...]) -> type[BaseModel] | None:
    """The model that a location lies in, through lists and mappings of models."""
    here: type[BaseModel] | None = model
    inside: object = None  # the annotation of a list's or mapping's content, while in one
    for part in location:
        if inside is None:
            if here is None:
                return None
            field = next((f for n, f in here.model_fields.items() if (f.alias or n) == part), None)
            if field is None:
                return None
            here, inside = _inner_model(field.annotation)
        else:
            inside = None
    return None if inside is not None else here


def _inner_model(annotation: Any) -> tuple[type[BaseModel] | None, object]:  # noqa: ANN401 - type forms
    """The model in an annotation, and the annotation again when it is a container of that model."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, None
    for argument in get_args(annotation):
        found, _ = _inner_model(argument)
        if found is not None:
            union = type(None) in get_args(annotation)
            return found, None if union else annotation
    return None, None
