"""The hidden-effect battery: draws dampers with hidden effects, diagnoses them from their CSV files, scores.

    python tests/hidden/battery.py --seed 3 --cases 300 [--family AB] [--jobs 2] [--json F]

The simulator beside it has equations of its own: no line of mrctl makes the data. Families: A one effect,
B none, C physics outside the library, D confounded campaigns, E pairs, F nuisances (offset and gain of each
run, differentiated stroke, short runs, one run), G road-like motion, H other simulators.

A family named twice is drawn from twice as densely. One seed holds so many cases; for more, and in place of
those that came twice, the next seeds are taken, and said.

Ctrl-C ends it with the table of the cases done so far.

At the price of more time: --follow makes the run that an ambiguous diagnosis proposes and diagnoses again,
--parameters sets values and intervals beside the truth, --inverse adds what was found to the model and
measures prediction and force tracking on new runs of the hidden damper.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: the fits are small
os.environ.setdefault("MRCTL_WORKERS", "1")  # the cases themselves run side by side

import follow
import generate
import parameters
import score
import tracking
from draw import SIZES
from other import make_other

from mrctl.discover.diagnose import diagnose
from mrctl.discover.reports.fitted import parameters_of
from mrctl.errors import InputError
from mrctl.measurements import load_campaign
from mrctl.measurements.quality import require_sound
from mrctl.report.progress import Progress

STOPPED = 130  # exit code, as a shell's after Ctrl-C


def diagnosed(folder: Path, key: tuple = (), *, rounds: int = 0, track: bool = False) -> tuple[str, dict]:
    """What the diagnosis says of one campaign, from its files alone, or why the gate before it refuses them.

    rounds: of the runs that an ambiguous one proposes, track: whether to prove on new runs what was found;
    both need the `key` by which the hidden damper is drawn again.
    """
    began = time.monotonic()
    campaign = load_campaign(folder)
    try:
        require_sound(campaign)
    except InputError as refused:
        return folder.name, {"verdict": "refused", "effects": [], "why": str(refused), "seconds": 0.0}
    found = diagnose(campaign)
    stated = {
        one.trial.effect.name: parameters_of(found.final.fit, one.trial.effect.name) for one in found.found
    }
    answer = {
        "verdict": found.verdict,
        "effects": list(found.effects),
        "seconds": time.monotonic() - began,
        "parameters": {e: {name: p["value"] for name, p in own.items()} for e, own in stated.items()},
        "intervals": {e: {name: p["ci95"] for name, p in own.items()} for e, own in stated.items()},
    }
    if track and found.verdict in ("none", "found"):
        answer["tracked"], answer["extended"] = tracking.tracked(found, campaign, key)
    if rounds and found.verdict == "ambiguous":
        answer["followed"] = follow.followed(found, folder, key, rounds)
    return folder.name, answer


def campaigns(seed: int, families: str, cases: int, out: Path) -> dict:
    """Draws and writes the campaigns; returns what is hidden in them, by folder."""
    hidden: dict = {}
    todo = [(f, k) for f in families for k in range(SIZES[f])]
    share = max(1.0, len(todo) / cases)
    chosen = dict.fromkeys(todo[int(n * share)] for n in range(min(cases, len(todo))))
    with Progress("Measuring", len(chosen)) as progress:
        for family, k in chosen:
            make = make_other if family == "H" else generate.make_case
            arguments = (seed, k, out) if family == "H" else (seed, family, k, out)
            name, truth = make(*arguments)
            hidden[name] = truth | {"key": [seed, family, k]}
            progress.advance(note=name)
    return hidden


def able(python: str) -> bool:
    """Whether that interpreter can run the opponents: asked before the long work, not after it."""
    command = [python, "-c", "import pandas, pysindy, sysidentpy"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def opponents(python: str, out: Path, cases: list[str]) -> dict:
    """What pySINDy and sysidentpy answer to the same campaigns, by tool."""
    program = Path(__file__).with_name("opponents.py")
    subprocess.run(
        [python, program, out, "-o", out.parent / "opponents", "--cases", ",".join(cases)], check=True
    )
    files = sorted(out.parent.glob("opponents_*.json"))
    return {f.stem.removeprefix("opponents_"): json.loads(f.read_text()) for f in files}


def gone_through(args: argparse.Namespace, hidden: dict, results: dict, rivals: dict) -> None:
    """Draws and diagnoses the cases, seed after seed, into these as they are done."""
    seed = args.seed
    with tempfile.TemporaryDirectory() as place:
        while len(hidden) < args.cases:
            out = Path(place) / str(seed)
            new = campaigns(seed, args.family, args.cases - len(hidden), out)
            hidden |= new
            with (
                ProcessPoolExecutor(args.jobs) as pool,
                Progress(f"Diagnosing, seed {seed}", len(new)) as progress,
            ):
                ask = partial(diagnosed, rounds=args.follow, track=args.inverse)
                folders, keys = [out / name for name in new], [tuple(c["key"]) for c in new.values()]
                for name, result in pool.map(ask, folders, keys):
                    results[name] = result
                    progress.advance(note=f"{name} {result['verdict']}")
            if args.opponents:
                for tool, answers in opponents(args.opponents, out, list(new)).items():
                    rivals.setdefault(tool, {}).update(answers)
            seed += 1


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument(
        "--cases", type=int, default=158, help="spread evenly; one seed has 158, more take the next"
    )
    parser.add_argument("--family", default="ABCDEFGH")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--opponents", metavar="PYTHON", help="an interpreter with pandas, pysindy and sysidentpy: they too"
    )
    parser.add_argument(
        "--follow", type=int, nargs="?", const=1, default=0, metavar="N", help="make N proposed runs (1)"
    )
    parser.add_argument(
        "--parameters", action="store_true", help="parameters and intervals against the truth"
    )
    parser.add_argument("--inverse", action="store_true", help="prediction and tracking with what was found")
    parser.add_argument("--each", action="store_true", help="one line for each case, with its parameters")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    if args.opponents and not able(args.opponents):
        parser.error(f"--opponents: {args.opponents} has not all of pandas, pysindy and sysidentpy")
    hidden: dict = {}
    results: dict = {}
    rivals: dict = {}
    stopped = False
    try:
        gone_through(args, hidden, results, rivals)
    except KeyboardInterrupt:
        stopped = True
        print(f"stopped: {len(results)} of {args.cases} cases are done", file=sys.stderr)
        if not results:
            return STOPPED
        hidden = {name: case for name, case in hidden.items() if name in results}
    if args.json:
        args.json.write_text(json.dumps({"results": results, "truth": hidden}, default=float))
    score.table(results, hidden, each=args.each)
    if args.follow:
        follow.table(results, hidden)
    if args.parameters:
        parameters.table(results, hidden)
    if args.inverse:
        tracking.table(results, hidden)
    for tool, answers in rivals.items():
        print(f"\n== {tool}")
        score.table(answers, {name: case for name, case in hidden.items() if name in answers})
    return STOPPED if stopped else 0


if __name__ == "__main__":
    sys.exit(main())
