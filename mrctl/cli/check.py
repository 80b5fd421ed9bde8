"""`mrctl check`: whether a calibration, configuration or DBC is sound, and what it says."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mrctl.calibration import calibration_from_document
from mrctl.cli.check_summary import calibration_summary, config_summary, dbc_summary, summary_text
from mrctl.config import config_from_document
from mrctl.errors import InputError, Problem
from mrctl.printable import printable
from mrctl.yaml_source import Document, read_document
from mrctl.yaml_source.writer import write_atomically

_CALIBRATION_KEYS = frozenset({"f", "g", "h", "forward_filter", "inverse_filter", "limits", "valid"})
_CONFIG_KEYS = frozenset({"bus", "dampers", "loop", "control", "safety", "frames"})


@dataclass(slots=True)
class Verdict:
    """What was found in one file."""

    file: str
    kind: str | None = None  # calibration, config, dbc
    errors: tuple[Problem, ...] = ()
    warnings: tuple[Problem, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl check`."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="calibration, configuration (YAML) or DBC")
    parser.add_argument("--json", metavar="FILE", help="write the findings as JSON; - is standard output")
    parser.epilog = """\
A file is recognised by its line `schema: mrctl/...`, a DBC by its ending. A configuration is held against
the DBC and the calibrations that it names. All errors come at once, each with its line and its mend; the
exit status is 2 if there are any.

examples:
  mrctl check config/vehicle.yaml
  mrctl check config/*.yaml dbc/mrctl.dbc --json findings.json
"""


def run(args: argparse.Namespace) -> int:
    """Check the files; returns 0 when all are sound, 2 otherwise."""
    verdicts = [check_file(name) for name in dict.fromkeys(args.files)]
    sound = not any(verdict.errors for verdict in verdicts)
    if args.json != "-":
        _print(verdicts)
    if args.json:
        result = {"ok": sound, "files": [_as_json(verdict) for verdict in verdicts]}
        text = json.dumps(result, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        if args.json == "-":
            sys.stdout.write(text)
        else:
            write_atomically(args.json, text)
    return 0 if sound else 2


def check_file(name: str) -> Verdict:
    """What a file is, whether it is sound, and what it says."""
    verdict = Verdict(name)
    try:
        if Path(name).suffix.lower() == ".dbc":
            verdict.kind = "dbc"
            verdict.summary = dbc_summary(Path(name))
        else:
            _check_yaml(read_document(name), verdict)
    except InputError as error:
        verdict.errors = error.problems
    return verdict


def _check_yaml(document: Document, verdict: Verdict) -> None:
    verdict.kind = _kind_of(document)
    if verdict.kind == "calibration":
        calibration = calibration_from_document(document)
        verdict.warnings = calibration.warnings
        verdict.summary = calibration_summary(calibration)
    else:
        config = config_from_document(document)
        verdict.warnings = config.warnings
        verdict.summary = config_summary(config)


def _kind_of(document: Document) -> str:
    """Calibration or config: by `schema`, else by the keys; raises InputError when it is neither."""
    said = document.data.get("schema")
    if isinstance(said, str):
        for kind in ("calibration", "config"):
            if said.startswith(f"mrctl/{kind}/"):
                return kind
    elif "schema" not in document.data:
        keys = set(document.data)
        if len(keys & _CALIBRATION_KEYS) != len(keys & _CONFIG_KEYS):
            return "calibration" if len(keys & _CALIBRATION_KEYS) > len(keys & _CONFIG_KEYS) else "config"
    what = "`schema` is missing" if "schema" not in document.data else f"the schema {said!r} is not known"
    mend = "begin with `schema: mrctl/calibration/1` or `schema: mrctl/config/1`"
    raise InputError.at(document.file, what, mend, document.line(("schema",)))


def _print(verdicts: list[Verdict]) -> None:
    """Sound files to standard output, errors to standard error; what two files share is said once."""
    said: set[str] = set()
    for verdict in verdicts:
        if not verdict.errors:
            print(f"{printable(verdict.file)}: ok")
            print(summary_text(verdict.kind or "", verdict.summary))
        for kind, problems in (("warning", verdict.warnings), ("error", verdict.errors)):
            for problem in problems:
                line = f"{kind}: {problem}"
                if line not in said:
                    said.add(line)
                    sys.stdout.flush()
                    print(line, file=sys.stderr)


def _as_json(verdict: Verdict) -> dict[str, Any]:
    return {
        "file": verdict.file,
        "kind": verdict.kind,
        "ok": not verdict.errors,
        "errors": [asdict(problem) for problem in verdict.errors],
        "warnings": [asdict(problem) for problem in verdict.warnings],
        "summary": verdict.summary,
    }
