"""The proposed next run, made: does it turn "ambiguous" into the truth?

The hidden damper's own simulator makes the run, the case's sensors measure it, and the diagnosis is asked
again with that run in the campaign.
"""

from __future__ import annotations

from rig import Rig

from mrctl.discover.diagnose import diagnose
from mrctl.measurements import load_campaign


def followed(found, folder, key, rounds=1):
    """The answers after each proposed run, which is added to `folder`; `found`: an ambiguous Diagnosis."""
    rig, answers = Rig(key, stream=1), []
    for _ in range(rounds):
        if found.verdict != "ambiguous" or found.next_run is None:
            break
        proposal = found.next_run
        count = len(list(folder.glob("*.csv"))) + 1
        rig.measured(rig.followed(proposal.record), folder / f"run_{count:02d}.csv")
        found = diagnose(load_campaign(folder))
        answers.append(
            {
                "run": proposal.figures(),
                "verdict": found.verdict,
                "effects": list(found.effects),
                "rivals": {f.trial.effect.name: {r.name: r.why for r in f.rivals} for f in found.found},
            }
        )
    return answers


def right(truth, answer):
    """Whether the answer is the truth: found, with exactly the effects there are (or null, or outside)."""
    verdict, names = answer["verdict"], set(answer["effects"])
    true = set(truth["effects"])
    if truth["family"] == "H":
        return verdict == "found" and true <= names <= true | set(truth["native"])
    if truth["odd"]:
        return verdict == "unexplained"
    return verdict == "found" and names == true if true else verdict == "none"


def table(R, C):
    """Print what the proposed runs resolved."""
    doubtful = [k for k in C if R[k]["verdict"] == "ambiguous"]
    asked = [k for k in doubtful if R[k].get("followed")]
    print("\nnext run: ambiguous cases, the proposed run made by the hidden damper, diagnosed again")
    groups = {
        "confounded campaigns (D)": [k for k in doubtful if C[k]["family"] == "D"],
        "other campaigns": [k for k in doubtful if C[k]["family"] != "D"],
        "all": doubtful,
    }
    for words, keys in groups.items():
        ran = [k for k in keys if k in asked]
        good = [k for k in ran if right(C[k], R[k]["followed"][-1])]
        still = sum(R[k]["followed"][-1]["verdict"] == "ambiguous" for k in ran)
        share = f"{100 * len(good) / len(ran):5.1f} %" if ran else "    -  "
        print(
            f"  {words:<26} ambiguous {len(keys):>3}, without a proposal {len(keys) - len(ran):>3}, "
            f"resolved {len(good):>3} of {len(ran):<3} {share}, still ambiguous {still}"
        )
    for k in doubtful:
        true = "+".join(C[k]["effects"]) or C[k]["odd"] or "-"
        trail = [f"{R[k]['verdict']} {'/'.join(R[k]['effects'])}"]
        for answer in R[k].get("followed") or []:
            run = answer["run"]
            trail.append(
                f"[{1e3 * run['amplitude_m']:.3g} mm, {run['frequency_hz']:g} Hz, {run['current']}, "
                f"{run['separation_sigma']:.0f} sigma] {answer['verdict']} {'/'.join(answer['effects'])}"
            )
        mark = "no proposal" if k not in asked else right(C[k], R[k]["followed"][-1])
        print(f"    {k} {C[k]['family']}{C[k]['index']:<3} {true}: {' -> '.join(trail)}  ({mark})")
