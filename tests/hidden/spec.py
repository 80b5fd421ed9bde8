"""What a case holds: its damper, its hidden effects, its runs and sensors, drawn from its name."""

from __future__ import annotations

import hashlib

import draw
import numpy as np
from draw import CONF, EFFECTS, FNUIS, ODD, PAIRS, ROAD, draw_base, draw_effect, draw_sensors
from physics import IX


def case_id(seed, fam, k):
    return "c" + hashlib.sha256(f"hidden/{seed}/{fam}/{k}".encode()).hexdigest()[:6]


def case_rng(seed, fam, k):
    return np.random.default_rng([seed, ord(fam), k, 20])


def make_spec(seed, fam, k):
    rng = case_rng(seed, fam, k)
    fs = float(rng.choice([250, 400, 500, 1000]))
    v_max, x_max = float(rng.uniform(0.35, 0.8)), float(rng.uniform(0.02, 0.035))
    n = int(rng.integers(9, 15))
    effects, variants, odd, note, accept = [], [], 0, "", []
    plan_kind, ctx = "rich", {}
    diff, hard = None, False
    asym = False
    if fam == "A":
        effects, variants = [EFFECTS[k % 17]], [k // 17]
    elif fam == "B":
        asym = k % 6 == 5
    elif fam == "C":
        odd = k % 12 + 1
    elif fam == "D":
        e, var = CONF[k % 12]
        effects, variants, plan_kind = [e], [var], "confounded"
        ctx = (
            {"gas": 2, "pre": 0.0 if var % 2 == 0 else float(rng.uniform(40, 120))}
            if e == "gas_spring"
            else {}
        )
    elif fam == "E":
        effects, variants = list(PAIRS[k % 15]), [int(q) for q in rng.integers(0, 4, 2)]
    elif fam == "F":
        note, e = FNUIS[k % 12]
        effects, variants = ([e], [int(rng.integers(0, 4))]) if e else ([], [])
        if note == "diff":
            diff, hard = True, True
    elif fam == "G":
        e = ROAD[k % 8]
        effects, variants, plan_kind = ([e], [int(rng.integers(0, 4))], "road") if e else ([], [], "road")
    if set(effects) & {"sensor_delay", "mount_compliance", "preyield_stiffness"}:
        fs = float(rng.choice([500, 1000]))
    heat = "self_heating" in effects
    if heat:
        fs, n = 250.0, 8
    P, H = draw_base(rng, asym)
    ctx |= {"v_max": v_max, "x_max": x_max}
    parts, path, forms = {}, {}, {}
    for e, var in zip(effects, variants, strict=True):
        put, pth, form = draw_effect(e, var, rng, P, ctx)
        parts[e], forms[e] = put, form
        path |= {q: (e, float(w)) for q, w in pth.items()}
    if plan_kind == "rich":
        dur = (30, 60) if heat else (3, 6)
        plan = draw.plan_rich(rng, n, v_max, x_max, dur)
    elif plan_kind == "road":
        plan = draw.plan_road(rng, int(rng.integers(6, 11)), v_max, x_max)
    else:
        plan = draw.plan_confounded(rng, int(rng.integers(6, 9)), v_max, x_max)
    sens = draw_sensors(rng, fs, diff, hard=hard)
    if fam == "F" and note == "runwise":
        sens["runwise_offset_n"], sens["runwise_gain"] = (
            float(rng.uniform(5, 15)),
            float(rng.uniform(0.005, 0.012)),
        )
    if fam == "F" and note == "short":
        for p in plan:
            p["dur"], p["f"] = float(rng.uniform(0.8, 1.3)), max(p["f"], 2.0)
    if fam == "F" and note == "one":
        plan = plan[:1]
        plan[0] |= {"kind": "multisine", "f": 2.0, "cur": "prbs", "dur": 6.0, "v": v_max}
    if fam == "B" and k in (7, 15, 21):
        sens["command_column"] = True
    if fam == "B" and asym:
        note = "g differs by direction but not f: inside the class if g may be asymmetric"
        accept = [["rebound_asymmetry"]]
    if plan_kind == "confounded" and effects[0] == "gas_spring" and parts["gas_spring"]["GPRE"]:
        accept = [["gas_spring"]]  # the preload is not an inertia's doing
        note = "preload"
    if "rebound_asymmetry" in effects and not parts["rebound_asymmetry"]["RB1"]:
        accept.append([e for e in effects if e != "rebound_asymmetry"])
        note += " pure g asymmetry: inside the class if g may be asymmetric"
    o = {}
    if odd:
        fmax = P[IX["F0"]] + P[IX["F1"]]
        o = {
            1: dict(O1=rng.uniform(0.3, 0.6), O2=rng.uniform(5, 12)),
            2: dict(O1=rng.uniform(0.15, 0.3), O2=rng.uniform(1, 3)),
            3: dict(O1=rng.uniform(4e-4, 1.2e-3)),
            4: dict(O1=rng.uniform(30, 80)),
            5: dict(O1=rng.uniform(0.06, 0.15) * fmax / np.sqrt(v_max * x_max)),
            6: dict(O1=rng.uniform(100, 250) / x_max),
            7: dict(O1=rng.uniform(150, 400), O2=rng.uniform(1, 3)),
            8: dict(O1=rng.uniform(0.2, 0.4), O2=rng.uniform(0.05, 0.2)),
            9: dict(O1=rng.uniform(0.25, 0.5), O2=rng.uniform(0.1, 0.3), O3=rng.uniform(0.3, 0.8)),
            10: dict(O1=rng.uniform(4, 10)),
            11: dict(O1=rng.uniform(1.5, 4)),
            12: dict(O1=rng.uniform(80, 200)),
        }[odd]
        o = {q: float(w) for q, w in o.items()} | {"ODD": odd}
        note = ODD[odd]
    centre = (
        float(rng.uniform(-0.15, 0.15) * x_max) if rng.random() < 0.3 and "end_stop" not in effects else 0.0
    )
    if fam == "D":
        centre = 0.0
    return dict(
        family=fam,
        fs=fs,
        plan=plan,
        P=P,
        H=H,
        effects=effects,
        parts=parts,
        path=path,
        forms=forms,
        sensors=sens,
        odd=o,
        note=note,
        accept=accept,
        centre=centre,
        v_max=v_max,
        x_max=x_max,
        rng=rng,
    )
