"""`mrctl verify`: the published tables and figures beside ours."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from pathlib import Path

from mrctl.measurements import load_campaign, require_sound
from mrctl.plant.dyno.campaign import Bench
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.verify.report import NOTE, rows_of, write_verification
from mrctl.verify.tables import verify
from mrctl.yaml_source.writer import write_atomically

SUMMARY = "the published tables and figures, side by side with what both methods reach here"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `mrctl verify`."""
    parser.add_argument(
        "data", nargs="?", metavar="DATA", help="a campaign of the published protocol of your own"
    )
    parser.add_argument(
        "-o", "--output", metavar="F.html", default="verify.html", help="the report (default: %(default)s)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON; - is standard output")
    parser.add_argument(
        "--seed", type=int, default=1, help="of the virtual damper's sensors (default: %(default)s)"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress, no table")
    parser.epilog = """\
Without DATA the virtual damper is measured by the published protocol: 40 runs, 0 to 3 A, 84 to 181 degF.

example:
  mrctl verify -o verify.html
"""


def run(args: argparse.Namespace) -> int:
    """Verify, print, write."""
    if args.data:
        campaign = load_campaign(args.data)
        for problem in require_sound(campaign):
            print(f"warning: {problem}", file=sys.stderr)
    else:
        campaign = Bench(seed=args.seed).campaign("paper")
    with Progress("Verifying", 1.0, quiet=args.quiet or args.json == "-") as progress:
        result = verify(campaign, progress.update)
    words = ["mrctl", "verify", *([args.data] if args.data else []), "-o", args.output]
    write_verification(result, Path(args.output), shlex.join(words))
    figures = {"entries": [e.figures() for e in result.entries], "note": NOTE, "runs": len(result.names)}
    text = json.dumps(figures, indent=2) + "\n"
    if args.json == "-":
        sys.stdout.write(text)
        return 0
    if args.json:
        write_atomically(args.json, text)
    if not args.quiet:
        headers = ["where", "what", "published", "paper's method", "better method", "asked"]
        print(table(headers, rows_of(result.entries)))
        missed = [f"{e.place} ({m})" for e in result.entries for m in e.goal if not e.met(m)]
        print(f"\nmissed: {', '.join(missed) or 'none'}\nwritten: {args.output}")
    return 0
