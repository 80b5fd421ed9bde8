r"""The map that tells how to read foreign files: `--columns MAP.yaml`.

A map for text files without a header, in millimetres, with the current in the file name (10mm1Hz0x25A.txt,
`x` for the decimal point) and a temperature that was only noted:

    schema: mrctl/columns/1
    files: "*A.txt"                  # glob or list of globs on file names; without it by format
    header: 0                        # line of the column names; 0 is none; without it the first line
    delimiter: whitespace            # comma, semicolon, tab, whitespace or a character; without it: look
    columns:                         # which column is which channel: a name or a number from 1
      time_s: 1
      displacement_m: {column: 2, unit: mm}
      velocity_m_s: {column: 3, unit: mm/s, sign: -1}
      force_N: {column: 4, unit: kN, scale: 1.02, offset: -0.01}
    constants:                       # channels with one value in all files
      temperature_C: {value: 72, unit: degF}
    from_name:                       # channels in the file name, by named groups of a regular expression
      pattern: '(?P<current_A>[\dx]+)A\.txt'
      units: {current_A: A}

A map for a recording in volts with one run after another, parted by marks in a column of events:

    schema: mrctl/columns/1
    files: raw_*.txt
    header: 7
    sample_rate_hz: 1000             # where no column holds the time
    columns:
      displacement_m: {column: CHANNEL0, scale: 10 mm/V}
      force_N: {column: CHANNEL1, scale: 980.665 N/V}
    constants: {temperature_C: 22}
    split:
      column: Events
      after: DAQ Pause               # the row with this text is the last of a part (`before`: the first)
      values: {current_A: [0, 0.25, 0.5, 0.75, 1]}

A channel is `sign * (scale * cell + offset)` in its `unit`, then converted to SI. Channels are named as in
the CSV header: time_s, velocity_m_s, current_A, temperature_C, force_N, displacement_m, acceleration_m_s2,
current_command_A, fluid_temperature_C, body_velocity_m_s. Further keys for text: `skip_lines` (before the
header), `comment` (a mark, `#`), `decimal` (point or comma), `encoding`.

Other formats take the same keys, with `format` where the extension does not tell it (text, mat, mdf, can): in
MAT files a column is a variable, a field `log.v`, or a matrix column `data(:,3)`; in MDF a channel, with
`group: 2` where several groups have it; in CAN logs (MF4 with bus logging too) a signal, `RelVel_FL` or
`RelativeVelocity.RelVel_FL`:

    schema: mrctl/columns/1
    dbc: mrctl.dbc                   # beside the map, or a path; else mrctl's own of that name
    bus: can0                        # only this channel of the log
    dampers: [FL, FR]                # a run for each, {damper} standing for it; without it one run
    signals:                         # the same as `columns`; a unit that the DBC states is converted
      velocity_m_s: RelVel_{damper}
      current_A: Cur_{damper}
      temperature_C: CaseTemp_{damper}
      force_N: MeasuredForce.Force_{damper}
"""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

from mrctl.errors import InputError
from mrctl.measurements.column_schema import ColumnSpec, MapModel
from mrctl.measurements.convert import Conversion, conversion_of, unit_of_file
from mrctl.measurements.run import BY_ATTRIBUTE, BY_COLUMN
from mrctl.measurements.text import DELIMITERS, Layout
from mrctl.share_path import share_file
from mrctl.yaml_source import Document, Findings, KeyPath, check_model, read_document

TEXT_PATTERNS = ("*.csv", "*.txt", "*.dat", "*.tsv")


class ColumnMap:
    """A map that was found sound. `columns`: attribute of `Run` to (place, group, conversion)."""

    def __init__(self, path: Path, model: MapModel, findings: Findings) -> None:
        """Judge what the schema alone cannot; everything wrong goes to `findings`."""
        self.path = path
        self.model = model
        self.places: dict[str, ColumnSpec] = {}
        self.conversions: dict[str, Conversion] = {}
        self.constants: dict[str, float] = {}
        self.declared: set[str] = set()
        self.pattern: re.Pattern[str] | None = None
        self.layout = Layout(
            delimiter=self._delimiter(findings),
            decimal=model.decimal,
            header=model.header,
            skip_lines=model.skip_lines,
            comment=model.comment,
            encoding=model.encoding,
        )
        self._columns(findings)
        self._constants(findings)
        self._name(findings)
        self._split(findings)

    @property
    def patterns(self) -> tuple[str, ...]:
        """Globs of the files that this map is for; empty where their format says it."""
        if self.model.files:
            return tuple(self.model.files)
        if self.model.dbc is not None or self.model.format == "can":
            return ("*.log", "*.asc", "*.blf", "*.trc", "*.mf4")
        return TEXT_PATTERNS if self.model.format in {None, "text"} else ()

    def conversion(self, attribute: str, unit: str) -> tuple[Conversion, str | None]:
        """The conversion of a channel for which the file itself states `unit`: the map's word goes before."""
        conversion = self.conversions[attribute]
        if attribute in self.declared:
            return conversion, None
        return unit_of_file(conversion, unit, BY_ATTRIBUTE[attribute].unit)

    def _delimiter(self, findings: Findings) -> str | None:
        given = self.model.delimiter
        if given is None or len(given) == 1:
            return given
        if given not in DELIMITERS:
            findings.add(
                ("delimiter",), f"delimiter {given!r} is unknown", f"write one of {', '.join(DELIMITERS)}"
            )
        return DELIMITERS.get(given)

    def _columns(self, findings: Findings) -> None:
        """Units and scales of the columns become conversions."""
        if not self.model.columns and not self.model.signals:
            findings.add(
                (), "`columns` is missing", "say which column is which channel: columns: {force_N: 3, ...}"
            )
        for block, specs in (("columns", self.model.columns), ("signals", self.model.signals)):
            for name, spec in specs.items():
                attribute = _attribute(name, (block, name), findings)
                if attribute is None:
                    continue
                if attribute in self.places:
                    findings.add(
                        (block, name), f"{name} is in `columns` and in `signals`", "keep one of the two"
                    )
                self.places[attribute] = spec
                try:
                    conversion = conversion_of(
                        BY_COLUMN[name].unit, spec.unit, spec.scale, spec.offset, spec.sign
                    )
                except ValueError as error:
                    _add(findings, (block, name), name, error)
                    continue
                self.conversions[attribute] = conversion
                if spec.unit is not None or isinstance(spec.scale, str):
                    self.declared.add(attribute)

    def _constants(self, findings: Findings) -> None:
        for name, spec in self.model.constants.items():
            attribute = _attribute(name, ("constants", name), findings)
            if attribute is None:
                continue
            if attribute in self.places:
                findings.add(("constants", name), f"{name} has a column too", "keep one of the two")
            try:
                conversion = conversion_of(BY_COLUMN[name].unit, spec.unit)
            except ValueError as error:
                _add(findings, ("constants", name), name, error)
                continue
            self.constants[attribute] = conversion.factor * spec.value + conversion.offset
            if spec.unit is not None:
                self.declared.add(attribute)

    def _name(self, findings: Findings) -> None:
        """The pattern compiles, and its groups are channels with fitting units."""
        spec = self.model.from_name
        if spec is None:
            return
        try:
            self.pattern = re.compile(spec.pattern)
        except (re.error, OverflowError, RecursionError) as error:
            findings.add(
                ("from_name", "pattern"), f"the pattern is no regular expression: {error}", "mend it"
            )
            return
        groups = [name for name in self.pattern.groupindex if name in BY_COLUMN]
        if not groups:
            what = "no group of the pattern is a channel"
            findings.add(("from_name", "pattern"), what, "name one like (?P<current_A>[\\dx]+)")
        for name in groups:
            attribute = BY_COLUMN[name].attribute
            if attribute in self.places or attribute in self.constants:
                findings.add(
                    ("from_name", "pattern"), f"{name} has a column or constant too", "keep one of them"
                )
            try:
                self.conversions[attribute] = conversion_of(BY_COLUMN[name].unit, spec.units.get(name))
            except ValueError as error:
                _add(findings, ("from_name", "units", name), name, error)
        for name in spec.units:
            if name not in groups:
                findings.add(
                    ("from_name", "units", name), f"the pattern has no group {name}", "correct the name"
                )

    def _split(self, findings: Findings) -> None:
        spec = self.model.split
        if spec is None:
            return
        if (spec.after is None) == (spec.before is None):
            findings.add(
                ("split",), "`split` needs either `after` or `before`", "write the text of the event there"
            )
        for name in spec.values:
            attribute = _attribute(name, ("split", "values", name), findings)
            if attribute in self.places or attribute in self.constants:
                findings.add(
                    ("split", "values", name), f"{name} has a column or constant too", "keep one of them"
                )


def _add(findings: Findings, path: KeyPath, name: str, error: ValueError) -> None:
    """A problem that was raised as "what; mend"."""
    what, _, mend = str(error).partition("; ")
    findings.add(path, f"{name}: {what}", mend)


def _attribute(name: str, path: KeyPath, findings: Findings) -> str | None:
    """The attribute of `Run` that a channel's name stands for."""
    channel = BY_COLUMN.get(name)
    if channel is None:
        alike = next((known for known in BY_COLUMN if known.lower() == name.lower()), None)
        word = name.split("_", maxsplit=1)[0]
        stem = next((known for known in BY_COLUMN if known.startswith(word + "_")), None)
        near = alike or stem
        mend = f"did you mean {near}?" if near else f"channels are {', '.join(BY_COLUMN)}"
        findings.add(path, f"{name} is no channel", mend)
        return None
    return channel.attribute


def read_map(path: Path | str) -> ColumnMap:
    """The map in a YAML file; InputError with everything wrong in it, with lines."""
    document: Document = read_document(path)
    findings = Findings(document)
    model = check_model(MapModel, document.data, findings)
    if model is None:
        findings.raise_if_any()
        raise AssertionError("a broken map without a problem")
    result = ColumnMap(Path(path), model, findings)
    findings.raise_if_any()
    return result


def dbc_path(mapping: ColumnMap) -> Path:
    """Where the map's DBC is: beside the map, or among the files of mrctl. InputError where it is nowhere."""
    name = mapping.model.dbc or ""
    beside = mapping.path.parent / name
    if beside.exists():
        return beside
    with contextlib.suppress(InputError):
        return share_file(f"dbc/{name}")
    raise InputError.at(beside, "there is no such DBC", f"correct `dbc` in {mapping.path}")
