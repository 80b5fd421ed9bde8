"""The calibration file's shape: blocks of values with their unit beside them (`mrctl/calibration/1`)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from mrctl.yaml_source import StrictModel

SCHEMA = "mrctl/calibration/1"
VERSION = 1

# In a YAML file a tuple is a list; the items stay strict.
Numbers = Annotated[tuple[float, ...], Field(strict=False, min_length=1, max_length=5_000)]
Texts = Annotated[tuple[str, ...], Field(strict=False)]
Deviation = Annotated[float, Field(ge=0.0)]
Deviations = Annotated[tuple[Deviation, ...], Field(strict=False)]
Name = Annotated[str, Field(min_length=1, max_length=200)]
Text = Annotated[str, Field(min_length=1, max_length=20_000)]

_STD = Field(default=None, description="standard deviation of each value, in the same unit")


class Step(StrictModel):
    """One thing that was done to arrive at the calibration."""

    what: Text = Field(description="what was done, e.g. identify or extend")
    effects: Texts = Field(default=(), description="effects in the model after this step")
    rmse_n: float | None = Field(default=None, ge=0.0, description="held-out force error after it, N")
    noise_floor_n: float | None = Field(default=None, ge=0.0, description="what no model can remove, N")
    seed: int | None = Field(default=None, description="seed of the random numbers used")
    date: str | None = None
    data: str | None = Field(default=None, description="the measurements it stands on")
    version: str | None = Field(default=None, description="version of mrctl that did it")


class Provenance(StrictModel):
    """Where the numbers come from."""

    source: Text = Field(description="the damper and the measurements or publication behind the numbers")
    created: str = Field(
        pattern=r"^\d{4}-\d{2}-\d{2}([T ].*)?$", description="the day it was made, e.g. 2025-01-31"
    )
    method: Text = Field(description="how the numbers were obtained")
    data_sha256: str | None = Field(
        default=None, pattern="^[0-9a-f]{64}$", description="64 hexadecimal digits: hash of the measurements"
    )
    history: Annotated[tuple[Step, ...], Field(strict=False)] = ()


class Column(StrictModel):
    """A table's column: values in a unit."""

    unit: str
    values: Numbers
    std: Deviations | None = _STD


class CurrentColumn(Column):
    """Currents."""

    unit: Literal["A"]


class ForceColumn(Column):
    """Forces."""

    unit: Literal["N"]


class VelocityColumn(Column):
    """Velocities; > 0 is extension."""

    unit: Literal["m/s"]


class TemperatureColumn(Column):
    """Temperatures."""

    unit: Literal["degC"]


class RatioColumn(Column):
    """Numbers without a unit."""

    unit: Literal["1"]


class Current(StrictModel):
    """A current."""

    unit: Literal["A"]
    value: float


class CurrentRate(StrictModel):
    """A rate of change of current."""

    unit: Literal["A/s"]
    value: float


class Frequency(StrictModel):
    """A frequency or sample rate."""

    unit: Literal["Hz"]
    value: float = Field(gt=0.0, le=1e6)


class CurrentBlock(StrictModel):
    """f: force against current."""

    current: CurrentColumn
    force: ForceColumn


class VelocityBlock(StrictModel):
    """g: shape of the force against relative velocity."""

    velocity: VelocityColumn
    shape: RatioColumn


class TemperatureBlock(StrictModel):
    """h: force ratio against temperature, without ("off") and with current ("on")."""

    off_below: Current = Field(description="largest current of the off state")
    on_above: Current = Field(description="smallest current of the on state; linear between the two")
    temperature: TemperatureColumn
    off: RatioColumn
    on: RatioColumn


class FilterBlock(StrictModel):
    """A discrete filter: polynomials in falling powers of z, at its sample rate."""

    sample_rate: Frequency
    numerator: Annotated[tuple[float, ...], Field(strict=False, min_length=1, max_length=64)]
    denominator: Annotated[tuple[float, ...], Field(strict=False, min_length=1, max_length=64)]


class InverseFilterBlock(FilterBlock):
    """The inverse filter, and the band in which its remaining error is corrected."""

    refine_cutoff: Frequency | None = Field(
        default=None,
        description="the error left by the inverse filter is corrected below this; null: it is not",
    )


class Limits(StrictModel):
    """What the coil and its driver bear."""

    current_max: Current
    current_slew: CurrentRate


class VelocityRange(StrictModel):
    """A range of velocities."""

    unit: Literal["m/s"]
    low: float = Field(alias="from")
    high: float = Field(alias="to")


class TemperatureRange(StrictModel):
    """A range of temperatures."""

    unit: Literal["degC"]
    low: float = Field(alias="from")
    high: float = Field(alias="to")


class CurrentRange(StrictModel):
    """A range of currents."""

    unit: Literal["A"]
    low: float = Field(alias="from")
    high: float = Field(alias="to")


class Validity(StrictModel):
    """Where the calibration was measured."""

    velocity: VelocityRange
    temperature: TemperatureRange
    current: CurrentRange


class Quantity(StrictModel):
    """A value in a unit."""

    value: float
    unit: str
    std: Deviation | None = _STD


class Effect(StrictModel):
    """An effect beyond the separable model, with its parameters."""

    name: Name
    parameters: dict[str, Quantity]


class CalibrationFile(StrictModel):
    """A calibration: everything that describes one damper."""

    schema_: Literal["mrctl/calibration/1"] = Field(
        alias="schema", description="kind and version of this file"
    )
    name: Name = Field(description="what to call this damper")
    provenance: Provenance = Field(description="source, created, method, history")
    f: CurrentBlock = Field(description="force against current, at the nominal temperature and full shape")
    g: VelocityBlock = Field(description="shape of the force against relative velocity, -1 to 1")
    h: TemperatureBlock = Field(description="force ratio against temperature, without and with current")
    forward_filter: FilterBlock = Field(description="the hysteresis filter from static to real force")
    inverse_filter: InverseFilterBlock = Field(description="its inverse, from desired to static force")
    limits: Limits = Field(description="largest current and largest rate of change of current")
    valid: Validity = Field(description="ranges in which it was measured")
    effects: Annotated[tuple[Effect, ...], Field(strict=False)] = Field(
        description="effects beyond f g h and the filter; [] if none"
    )
