"""A calibration in memory, and its way from and to a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from mrctl.calibration.checks import check_blocks
from mrctl.calibration.effects import check_effects
from mrctl.calibration.filter_checks import CASCADE_GAIN_DB, CASCADE_PHASE_DEG, cascade_error
from mrctl.calibration.models import SCHEMA, VERSION, CalibrationFile, FilterBlock, Provenance
from mrctl.calibration.render import render_calibration
from mrctl.errors import InputError, Problem
from mrctl.model.damper import Damper, EffectSetting, Span
from mrctl.model.filters import Filter
from mrctl.model.static import static_tables
from mrctl.yaml_source import (
    Document,
    Findings,
    check_model,
    parse_document,
    read_document,
    schema_version,
)
from mrctl.yaml_source.writer import write_atomically


@dataclass(frozen=True, slots=True)
class Calibration:
    """One damper as a file describes it.

    std: standard deviations beside the values they belong to, by dotted key (`f.force`, `h.on`,
    `effects.NAME.PARAMETER`); empty where the file gives none.
    """

    name: str
    provenance: Provenance
    damper: Damper
    path: Path | None = None
    sha256: str | None = None
    warnings: tuple[Problem, ...] = ()
    std: Mapping[str, tuple[float, ...]] = field(default_factory=lambda: MappingProxyType({}))


def load_calibration(path: Path | str) -> Calibration:
    """The calibration in a file; raises InputError with everything that is wrong in it."""
    return calibration_from_document(read_document(path))


def calibration_from_document(document: Document) -> Calibration:
    """The calibration in a document that was read; raises InputError with everything that is wrong in it."""
    findings = Findings(document)
    if not schema_version(document, "calibration", VERSION, findings):
        findings.raise_if_any()
    data = {**document.data, "schema": SCHEMA}
    file = check_model(CalibrationFile, data, findings)
    check_blocks(data, findings)
    if file:
        check_effects(file.effects, findings)
    findings.raise_if_any()
    if file is None:  # a slip of the reader hides what the model objects to only where it has said so itself
        raise InputError.at(document.file, "the file does not have the shape of a calibration")
    return Calibration(
        name=file.name,
        provenance=file.provenance,
        damper=_damper(file),
        path=Path(document.file),
        sha256=document.sha256,
        warnings=_warnings(file, document),
        std=MappingProxyType(_deviations(file)),
    )


def calibration_from_damper(
    name: str,
    damper: Damper,
    provenance: Provenance,
    std: Mapping[str, tuple[float, ...]] | None = None,
) -> Calibration:
    """A calibration of a damper that was identified; what a file may not hold is found when it is dumped."""
    return Calibration(name, provenance, damper, std=MappingProxyType(dict(std or {})))


def dump_calibration(calibration: Calibration, path: Path | str) -> None:
    """Write the calibration as commented YAML, whole or not at all; loading gives the same floats again.

    Raises InputError when it would not be loaded again, or the file cannot be written.
    """
    text = render_calibration(calibration.name, calibration.provenance, calibration.damper, calibration.std)
    try:
        calibration_from_document(parse_document(text.encode(), str(path)))
    except InputError as error:
        # The lines are those of a file that will not be: without them.
        raise InputError(
            Problem(p.file, None, f"not written: {p.what}", p.mend) for p in error.problems
        ) from None
    write_atomically(path, text)


def _damper(file: CalibrationFile) -> Damper:
    """The model's numbers of a checked file."""
    cutoff = file.inverse_filter.refine_cutoff
    valid = file.valid
    return Damper(
        static=static_tables(
            file.f.current.values,
            file.f.force.values,
            file.g.velocity.values,
            file.g.shape.values,
            file.h.temperature.values,
            file.h.off.values,
            file.h.on.values,
            file.h.off_below.value,
            file.h.on_above.value,
        ),
        forward_filter=_filter(file.forward_filter),
        inverse_filter=_filter(file.inverse_filter),
        refine_cutoff_hz=None if cutoff is None else cutoff.value,
        current_max_a=file.limits.current_max.value,
        current_slew_a_s=file.limits.current_slew.value,
        velocity_valid_m_s=Span(valid.velocity.low, valid.velocity.high),
        temperature_valid_c=Span(valid.temperature.low, valid.temperature.high),
        current_valid_a=Span(valid.current.low, valid.current.high),
        effects=tuple(
            EffectSetting(e.name, {name: q.value for name, q in e.parameters.items()}) for e in file.effects
        ),
    )


def _filter(block: FilterBlock) -> Filter:
    return Filter.of(block.sample_rate.value, block.numerator, block.denominator)


def _deviations(file: CalibrationFile) -> dict[str, tuple[float, ...]]:
    """All standard deviations that the file gives, by dotted key."""
    columns = {
        "f.current": file.f.current,
        "f.force": file.f.force,
        "g.velocity": file.g.velocity,
        "g.shape": file.g.shape,
        "h.temperature": file.h.temperature,
        "h.off": file.h.off,
        "h.on": file.h.on,
    }
    found = {key: column.std for key, column in columns.items() if column.std is not None}
    for effect in file.effects:
        for name, quantity in effect.parameters.items():
            if quantity.std is not None:
                found[f"effects.{effect.name}.{name}"] = (quantity.std,)
    return found


def _warnings(file: CalibrationFile, document: Document) -> tuple[Problem, ...]:
    """What does not forbid using the calibration, but should be known."""
    warnings = []
    gain_db, phase_deg = cascade_error(_filter(file.forward_filter), _filter(file.inverse_filter))
    if gain_db > CASCADE_GAIN_DB or phase_deg > CASCADE_PHASE_DEG:
        warnings.append(
            Problem(
                document.file,
                document.line(("inverse_filter",)),
                f"forward times inverse filter is off by {gain_db:.2g} dB, {phase_deg:.2g} degrees to 20 Hz",
                "the force will miss the wish; identify the inverse filter anew",
            )
        )
    largest = max(map(abs, file.g.shape.values))
    if largest < 0.95:
        warnings.append(
            Problem(
                document.file,
                document.line(("g", "shape")),
                f"`g.shape` reaches {largest:.3g} only, so f is not the force at full velocity",
                "divide g by that and multiply f by it",
            )
        )
    return tuple(warnings)
