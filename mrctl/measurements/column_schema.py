"""The shape of a column map as it is written; `column_map` explains it and judges what a shape cannot."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from mrctl.yaml_source import StrictModel

_MANY_LINES = 10_000_000


def _short_form(value: object) -> object:
    """`force_N: 4` says the same as `force_N: {column: 4}`."""
    return {"column": value} if isinstance(value, int | str) and not isinstance(value, bool) else value


def _place(value: object) -> object:
    """A column is named, or counted from 1."""
    if isinstance(value, str) and value:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise ValueError(f"{value!r} is no column; write its name, or its number from 1")


def _bare_value(value: object) -> object:
    """`temperature_C: 22` says the same as `temperature_C: {value: 22}`."""
    return {"value": value} if isinstance(value, int | float) and not isinstance(value, bool) else value


def _several(value: object) -> object:
    return [value] if isinstance(value, str) else value


def _scale(value: object) -> object:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, str):
        return value
    raise ValueError(f"{value!r} is no scale; write a number, or a number per volt like `10 mm/V`")


_Glob = Annotated[str, Field(min_length=1, description="write a glob on file names, like *.txt")]


class ColumnSpec(StrictModel):
    """Where a channel stands, and how it becomes SI."""

    column: Annotated[Any, AfterValidator(_place)] = Field(
        description="the column's name, or its number from 1"
    )
    unit: str | None = None
    scale: Annotated[Any, AfterValidator(_scale)] = 1.0
    offset: float = 0.0
    sign: Literal[1, -1] = 1
    group: int | None = None


class ConstantSpec(StrictModel):
    """One value for all rows."""

    value: float
    unit: str | None = None


class NameSpec(StrictModel):
    """Values in the file name."""

    pattern: str
    units: dict[str, str] = Field(default_factory=dict)


class SplitSpec(StrictModel):
    """How a recording falls into runs."""

    column: Annotated[Any, AfterValidator(_place)]
    after: str | None = None
    before: str | None = None
    values: dict[str, list[float]] = Field(default_factory=dict)


class MapModel(StrictModel):
    """The map as it is written."""

    schema_: Literal["mrctl/columns/1"] = Field(default="mrctl/columns/1", alias="schema")
    files: Annotated[list[_Glob], BeforeValidator(_several)] = Field(default_factory=list)
    format: Literal["text", "mat", "mdf", "can"] | None = None
    encoding: str | None = None
    delimiter: str | None = None
    decimal: Literal["point", "comma"] | None = None
    header: int | None = Field(default=None, ge=0, le=_MANY_LINES)
    skip_lines: int = Field(default=0, ge=0, le=_MANY_LINES)
    comment: str = Field(default="#", min_length=1)
    sample_rate_hz: float | None = Field(default=None, ge=1e-3, le=1e9)
    columns: dict[str, Annotated[ColumnSpec, BeforeValidator(_short_form)]] = Field(default_factory=dict)
    signals: dict[str, Annotated[ColumnSpec, BeforeValidator(_short_form)]] = Field(default_factory=dict)
    constants: dict[str, Annotated[ConstantSpec, BeforeValidator(_bare_value)]] = Field(default_factory=dict)
    from_name: NameSpec | None = None
    split: SplitSpec | None = None
    dbc: str | None = None
    bus: str | None = None
    dampers: list[str] = Field(default_factory=list)
