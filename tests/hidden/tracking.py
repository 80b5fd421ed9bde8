"""What an effect is worth once it is in the model: force predicted on new runs, and a wished force tracked.

Both by the hidden damper's own simulator. Forward: runs that the campaign has not, measured with the case's
sensors, and predicted by the model without and with the effects found. Inverse: the damper's own force for a
smooth random current is the wish; mrctl's inverse, without and with the effects, finds the current; the
hidden damper answers to that. Where nothing was missing, the base model alone shows what it can do.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from rig import Rig

from mrctl.discover.discover import extension_of
from mrctl.discover.reports.fitted import parameters_of
from mrctl.identify.finish import damper_of
from mrctl.identify.forward import modelled
from mrctl.measurements import load_campaign
from mrctl.model.pipeline import InversePipeline

LOOP_HZ = 1000.0
SETTLE_STEPS = 100  # as `mrctl invert` has it
KINDS = (("multisine", "wander"), ("road", "prbs"), ("growing", "sine"))  # motion and current
START_S = 0.25  # a run's history before its first sample is not in the file
STEP_SHARE, STEP_SAMPLES = (
    0.03,
    3,
)  # of the range of current; when a step was, no file says
SECONDS = 4.0
WARMING_S = 30.0  # what heats up shows nothing in seconds


def plans(rig):
    """Three runs within the campaign's ranges: other motions, currents and temperatures."""
    spec, rng = rig.spec, rig.rng
    warm = [p["T"] for p in spec["plan"]] if not rig.other else [25.0]
    seconds = WARMING_S if "self_heating" in spec["effects"] else SECONDS
    return [
        dict(
            kind=kind,
            f=float(rng.uniform(1.0, 3.0)),
            v=spec["v_max"] * float(rng.uniform(0.6, 1.0)),
            x=spec["x_max"],
            cur=cur,
            level=0.0,
            T=float(rng.uniform(min(warm), max(warm))),
            drift=float(rng.uniform(0.0, 1.0)),
            dur=seconds,
        )
        for kind, cur in KINDS
    ]


def tracked(found, campaign, key):
    """Errors with and without the effects that a Diagnosis found in a campaign, and the parameters stated."""
    extension = extension_of(campaign, found)
    dampers = {"base": damper_of(extension.base), "extended": extension.damper}
    rig = Rig(key, stream=2)
    runs = [rig.drawn(plan) for plan in plans(rig)]
    stated = {name: parameters_of(extension.fit, name) for name in extension.effects}
    return {
        "held_out": {
            "before_n": extension.rmse_before_n,
            "after_n": extension.rmse_after_n,
            "floor_n": extension.noise_floor_n,
        },
        "forward": forward_errors(rig, runs, dampers),
        "inverse": inverse_errors(rig, runs[:2], dampers),
    }, {
        "parameters": {e: {p: q["value"] for p, q in own.items()} for e, own in stated.items()},
        "intervals": {e: {p: q["ci95"] for p, q in own.items()} for e, own in stated.items()},
    }


def forward_errors(rig, runs, dampers):
    """RMS in N over new runs: of each model, of the force's noise, of a perfect model on what is measured."""
    squares = defaultdict(list)
    with tempfile.TemporaryDirectory() as place:
        for n, r in enumerate(runs):
            noise, heard = rig.measured(r, Path(place) / f"run_{n + 1:02d}.csv")
            squares["noise"].append(noise)
            squares["perfect"].append(heard)
        campaign = load_campaign(place)
    for run in campaign.runs:
        for name, damper in dampers.items():
            squares[name].append(run.force_n - modelled(damper, run))
    start = round(START_S * rig.spec["fs"])
    told = [_told(run.current_a, start) for run in campaign.runs]
    counted = {name: [e[m] for e, m in zip(own, told, strict=True)] for name, own in squares.items()}
    return {f"{name}_n": _rms(own) for name, own in counted.items()} | {
        "each": [
            {"kind": kind} | {f"{name}_n": _rms([own[n]]) for name, own in counted.items()}
            for n, (kind, _) in enumerate(KINDS)
        ]
    }


def _told(current_a, start):
    """Which samples (n) hang on what the file says: not on its start, nor on the time of a step."""
    known = np.arange(current_a.size) >= start
    steps = np.flatnonzero(np.abs(np.diff(current_a)) > STEP_SHARE * max(float(np.ptp(current_a)), 1e-9))
    after = (steps[:, None] + 1 + np.arange(STEP_SAMPLES)).ravel()
    if after.size < 0.2 * current_a.size:  # else it is no steps but a slope
        known[after[after < current_a.size]] = False
    return known


def inverse_errors(rig, runs, dampers):
    """RMS in N of the hidden damper's force less the wish, by the current that each model's inverse finds."""
    misses, wishes = defaultdict(list), []
    for r in runs:
        wish = rig.force(r, rig.smooth_current(r), late=False)
        step = round(1.0 / (LOOP_HZ * r["dt"]))
        at = np.arange(0, r["t"].size, step)
        counted = at[r["t"][at] >= 0.0]
        wishes.append(wish[counted])
        for name, damper in dampers.items():
            commands = inverted(damper, wish[at], r, at)
            answer = rig.force(r, np.repeat(commands, step)[: r["t"].size], late=False)
            misses[name].append((answer - wish)[counted])
    return (
        {f"{name}_n": _rms(own) for name, own in misses.items()}
        | {"wish_n": _rms(wishes)}
        | {f"{name}_gain": largest_gain(damper) for name, damper in dampers.items()}
    )


def largest_gain(damper):
    """Of the inverse filter at any frequency: one that rings makes a bad current of a good model."""
    hz = np.linspace(0.1, 0.5 * LOOP_HZ, 50_000)
    return float(np.abs(damper.inverse_filter.resampled(LOOP_HZ).response(hz)).max())


def inverted(damper, wish_n, r, at):
    """The current commands (n) in A, as `mrctl invert` works them out."""
    v, T, x, a = (r[q][at].tolist() for q in ("v", "Tc", "x", "a"))
    force = wish_n.tolist()
    inverse = InversePipeline(damper, 1.0 / LOOP_HZ)
    inverse.reset(force[0])
    for _ in range(SETTLE_STEPS):
        inverse.step(force[0], v[0], T[0], x[0], a[0])
    return np.array([inverse.step(*sample) for sample in zip(force, v, T, x, a, strict=True)])


def _rms(errors):
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def table(R, C):
    """Print how much the effects found improve prediction and tracking, by effect."""
    keys = [k for k in C if R[k].get("tracked")]
    print("\nafter adding what was found: new runs of the hidden damper, n =", len(keys))
    print(
        "  forward: RMSE over that of a perfect model on the same files; inverse: RMS(force - wish), "
        "% of the wish's RMS, and its ratio\n"
        f"  {'effect (! wrong name)':<44}{'n':>4}{'base':>8}{'with':>8}{'<= 1.05':>9}   "
        f"{'base':>7}{'with':>7}{'ratio':>7}{'worse':>7}"
    )
    groups = defaultdict(list)
    for k in keys:
        true = set(C[k]["effects"]) | set(C[k].get("native", ()))
        names = [e if e in true else f"!{e}" for e in sorted(R[k]["effects"])]
        groups[" + ".join(names) or "(none: the base alone)"].append(k)
    for what in sorted(groups):
        _line(what, [R[k]["tracked"] for k in groups[what]])
    found = [R[k]["tracked"] for k in keys if R[k]["effects"]]
    if found:
        _line("all that were found", found)
    for k in keys:
        f, i = R[k]["tracked"]["forward"], R[k]["tracked"]["inverse"]
        worse = " WORSE" if i["extended_n"] > i["base_n"] else ""
        gains = f"inverse filter's gain up to {i['base_gain']:.3g} and {i['extended_gain']:.3g}"
        what = f"{k} {C[k]['family']}{C[k]['index']:<3} {'+'.join(R[k]['effects'])}"
        print(
            f"    {what}: forward {f['base_n']:.1f} -> "
            f"{f['extended_n']:.1f} N (noise {f['noise_n']:.1f}, perfect {f['perfect_n']:.1f}), inverse "
            f"{i['base_n']:.1f} -> {i['extended_n']:.1f} N of {i['wish_n']:.0f}, {gains}{worse}"
        )


def _line(what, own):
    forward = np.array(
        [[t["forward"][q] / t["forward"]["perfect_n"] for q in ("base_n", "extended_n")] for t in own]
    )
    inverse = np.array([[t["inverse"][q] for q in ("base_n", "extended_n", "wish_n")] for t in own])
    ratio = inverse[:, 1] / inverse[:, 0]
    f, i = np.median(forward, axis=0), np.median(100.0 * inverse[:, :2] / inverse[:, 2:], axis=0)
    print(
        f"  {what:<44}{len(own):>4}{f[0]:>8.2f}{f[1]:>8.2f}{np.sum(forward[:, 1] <= 1.05):>9}   "
        f"{i[0]:>6.1f}%{i[1]:>6.1f}%{np.median(ratio):>7.2f}{np.sum(ratio > 1.0):>7}"
    )
