"""`mrctl verify`: the published tables and figures beside ours."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from pathlib import Path

from mrctl.cli.outputs import check_outputs
from mrctl.cli.own_effects import try_own_effects
from mrctl.measurements import load_campaign, require_sound
from mrctl.plant.dyno.campaign import Bench
from mrctl.plant.dyno.parameters import MAGNERIDE_LIKE
from mrctl.report.progress import Progress
from mrctl.report.terminal import table
from mrctl.verify.report import HEADERS, NOTE, missed, models_side_by_side, rows_of, write_verification
from mrctl.verify.tables import verify
from mrctl.yaml_source.writer import write_atomically

PROTOCOL = "paper"


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
    parser.add_argument("--quick", action="store_true", help="leave out Spencer's damper, half of the time")
    parser.add_argument("--quiet", action="store_true", help="no progress, no table")
    parser.epilog = """\
Without DATA the virtual damper is measured by the published protocol: 40 runs, 0 to 3 A, 84 to 181 degF.

example:
  mrctl verify -o verify.html
"""


def run(args: argparse.Namespace) -> int:
    """Verify, print, write."""
    check_outputs(args, makes_folder=("output",))
    try_own_effects()
    virtual = None
    if args.data:
        campaign = load_campaign(args.data)
        for problem in require_sound(campaign):
            print(f"warning: {problem}", file=sys.stderr)
    else:
        bench = Bench(seed=args.seed)
        campaign = bench.campaign(PROTOCOL)
        virtual = MAGNERIDE_LIKE, bench.drives(PROTOCOL)
    with Progress("Verifying", 1.0, quiet=args.quiet or args.json == "-") as progress:
        result = verify(campaign, progress.update, virtual, with_spencer=not args.quick, seed=args.seed)
    words = ["mrctl", "verify", *([args.data] if args.data else []), "-o", args.output]
    write_verification(result, Path(args.output), shlex.join(words))
    text = json.dumps(result.figures() | {"note": NOTE}, indent=1) + "\n"
    if args.json == "-":
        sys.stdout.write(text)
        return 0
    if args.json:
        write_atomically(args.json, text)
    if not args.quiet:
        print(table(HEADERS, rows_of(result.entries), align="llrrll"))
        print(f"\n{table(*models_side_by_side(result.entries), title='models side by side')}")
        print(f"\nmissed: {'; '.join(missed(result.entries)) or 'none'}\nwritten: {args.output}")
    return 0
