"""Write campaigns with hidden effects: python generate.py --out DIR --seed S [--family A] [--count N].

Data: DIR/<case>/run_XX.csv.  Truth: DIR.truth/truth.json, never inside DIR.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from draw import ODD, SIZES
from fine import fine_signals, true_force
from other import make_other
from physics import IX
from sensing import heard_error, rms, sense, visible, write_csv
from spec import case_id, make_spec


def expected(spec):
    fam, eff = spec["family"], spec["effects"]
    if fam == "C":
        return {"verdict": "unexplained", "effects": []}
    if not eff:
        return {"verdict": "none", "effects": []}
    if fam == "D":
        if eff[0] in ("gas_spring", "fluid_inertia"):
            return {"verdict": "ambiguous", "effects": ["gas_spring", "fluid_inertia"]}
        if eff[0] in ("current_lag", "magnetic_hysteresis", "sensor_delay"):
            return {"verdict": "none", "effects": []}
    return {"verdict": "found", "effects": sorted(eff)}


def drawn_parameters(spec):
    """By effect, what the generator drew for it."""
    return {
        e: {q: float(w) for q, w in spec["parts"][e].items()}
        | {q: w for q, (e2, w) in spec["path"].items() if e2 == e}
        for e in spec["effects"]
    }


def drawn_base(spec):
    """What the generator drew for the base model."""
    return {q: float(spec["P"][j]) for q, j in IX.items() if spec["P"][j] != 0} | {"H": spec["H"]}


def make_case(seed, fam, k, out):
    spec = make_spec(seed, fam, k)
    runs = fine_signals(spec)
    cid = case_id(seed, fam, k)
    folder = out / cid
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.csv"):
        old.unlink()
    names = spec["effects"] + (["odd"] if spec["odd"] and spec["odd"]["ODD"] != 7 else [])
    cl, err, heard = [], [], []
    contrib = {e: [] for e in names}
    rows = []
    power = 0.0
    for n, r in enumerate(runs):
        F, act, _ = true_force(spec, r)
        cols, kk, clean, noise = sense(spec, r, F, act)
        write_csv(cols, folder / f"run_{n + 1:02d}.csv")
        cl.append(clean)
        err.append(noise)
        power += float(np.mean(clean * r["v"][kk])) / len(runs)
        for e in names:
            contrib[e].append(clean - true_force(spec, r, without=(e,))[0][kk])
        rows.append(dict(v=r["v"][kk], i=r["cmd"][kk], T=r["Tc"][kk], n=n))
        heard.append(heard_error(spec, r, cols, kk, clean, noise))
    vis = {e: visible(spec, rows, contrib[e]) for e in names}
    s = spec["sensors"]
    n_eff = sum(c.size for c in cl) * (1 - s["force_rho"]) / (1 + s["force_rho"])
    detect = {e: vis[e] / rms(heard) * np.sqrt(n_eff) for e in names}
    return cid, {
        "family": fam,
        "index": k,
        "effects": spec["effects"],
        "odd": ODD.get(spec["odd"].get("ODD"), None),
        "expected": expected(spec),
        "also_acceptable": spec["accept"],
        "note": spec["note"],
        "forms": spec["forms"],
        "parameters": drawn_parameters(spec),
        "odd_parameters": spec["odd"],
        "base": drawn_base(spec),
        "sensors": s,
        "rate_hz": spec["fs"],
        "runs": len(runs),
        "v_max_m_s": spec["v_max"],
        "x_max_m": spec["x_max"],
        "plan": spec["plan"],
        "rows": int(sum(c.size for c in cl)),
        "force_rms_n": rms(cl),
        "force_max_n": float(max(np.abs(c).max() for c in cl)),
        "mean_power_w": power,
        "noise_rms_n": rms(err),
        "perfect_rmse_n": rms(err),
        "perfect_rmse_on_measured_inputs_n": rms(heard),
        "contribution_rms_n": {e: rms(contrib[e]) for e in names},
        "visible_rms_n": vis,
        "detectability": detect,
    }


def main():
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--truth", type=Path, help="folder for what is hidden (default: OUT.truth beside it)")
    ap.add_argument("--seed", type=int, required=True)
    ap.add_argument("--family", help="letters, e.g. A or ABD; default all")
    ap.add_argument("--count", type=int, help="at most this many cases per family")
    a = ap.parse_args()
    todo = [(f, k) for f in (a.family or "ABCDEFGH") for k in range(min(SIZES[f], a.count or 10**6))]
    truth_dir = a.truth or a.out.parent / f"{a.out.resolve().name}.truth"
    truth_dir.mkdir(parents=True, exist_ok=True)
    cases = {}
    t0 = time.time()
    for n, (f, k) in enumerate(todo):
        cid, rec = make_other(a.seed, k, a.out) if f == "H" else make_case(a.seed, f, k, a.out)
        cases[cid] = rec
        sys.stderr.write(f"\r{n + 1}/{len(todo)} family {f} case {k} {cid} {time.time() - t0:.0f} s   ")
        sys.stderr.flush()
    sys.stderr.write("\n")
    path = truth_dir / "truth.json"
    if path.exists():
        old = json.loads(path.read_text())
        if old.get("seed") == a.seed:
            cases = old["cases"] | cases
    tmp = path.with_suffix(".tmp")
    tmp.write_text(json.dumps({"seed": a.seed, "cases": cases}, indent=1, default=float))
    tmp.rename(path)
    fams = {}
    for cid, c in sorted(cases.items(), key=lambda q: (q[1]["family"], q[1]["index"])):
        fams.setdefault(c["family"], []).append(cid)
    (truth_dir / "families.json").write_text(json.dumps(fams, indent=1))


if __name__ == "__main__":
    main()
