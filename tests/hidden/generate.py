"""Write campaigns with hidden effects: python generate.py --out DIR --seed S [--family A] [--count N].

Data: DIR/<case>/run_XX.csv.  Truth: DIR.truth/truth.json, never inside DIR.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from pathlib import Path

import draw
import numpy as np
import physics
from draw import CONF, EFFECTS, FNUIS, ODD, PAIRS, ROAD, SIZES, draw_base, draw_effect, draw_sensors, logu
from physics import IX
from scipy.ndimage import uniform_filter1d
from scipy.signal import bilinear, butter, filtfilt, lfilter
from signals import ar1, current, motion

PRE = 0.3  # seconds before the record, in which filters settle
SPENCER = (21.0, 3.5, 46.9, 283.0, 2.95, 5.0, 14.3, 140.0, 695.0, 363.0, 363.0, 301.0, 190.0)
SIMULATORS = ("Spencer modified Bouc-Wen", "Bingham + Maxwell in parallel")
NATIVE = (
    ["preyield_stiffness", "gas_spring", "current_lag", "force_offset", "magnetic_hysteresis"],
    ["viscous_damping", "preyield_stiffness"],
)


def write_csv(columns, path):
    values = np.column_stack([np.asarray(c, dtype=float) for c in columns.values()])
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")


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


def fine_grid(spec, seconds):
    """Time with what lies before the record, samples of the grid in one of the record, and before it."""
    stiff = spec["family"] == "H" or any("MK" in p or "PY" in p or "CAV" in p for p in spec["parts"].values())
    fs = spec["fs"]
    os_ = max(10, int(np.ceil((20000 if stiff else 10000) / fs)))
    n_pre = round(PRE * fs) * os_
    return (np.arange(n_pre + int(seconds * fs) * os_ + 1) - n_pre) * (1.0 / (fs * os_)), os_, n_pre


def fine_run(spec, p):
    """Rod motion, command and case temperature of one run of the plan on the fine grid."""
    rng = spec["rng"]
    t, os_, n_pre = fine_grid(spec, p["dur"])
    x, v, a = motion(p["kind"], t, rng, p["f"], p["v"], p["x"])
    imax = spec["P"][IX["IMAX"]]
    cmd = np.round(current(p["cur"], t, rng, p["level"] * imax, imax, v), 4)
    Tc = p["T"] + p["drift"] * (t / t[-1])
    dt = 1.0 / (spec["fs"] * os_)
    return dict(t=t, x=x + spec["centre"], v=v, a=a, cmd=cmd, Tc=Tc, os=os_, n_pre=n_pre, dt=dt)


def fine_signals(spec):
    """Every run of the plan on the fine grid."""
    return [fine_run(spec, p) for p in spec["plan"]]


def true_force(spec, r, without=(), v=None, x=None, i=None):
    """Force on the fine grid; without: names of effects to leave out."""
    P = spec["P"].copy()
    for e, put in spec["parts"].items():
        if e not in without:
            for q, w in put.items():
                P[IX[q]] = w
    odd = spec["odd"] if "odd" not in without else {}
    for q, w in odd.items():
        P[IX[q]] = w
    path = {q: w for q, (e, w) in spec["path"].items() if e not in without}
    dt, t = r["dt"], r["t"]
    cur = r["cmd"] if i is None else i
    act = cur
    if spec["sensors"]["command_column"] and i is None:
        act = physics.lag(cur, dt, 0.010, 0.010)
    if "lag_up" in path:
        act = physics.lag(act, dt, path["lag_up"], path["lag_down"])
    ieff = act
    if "play_width" in path:
        ieff = physics.play_bank(act, int(path["play_kind"]), path["play_width"], path["play_rate"])
    x = r["x"] if x is None else x
    v = r["v"] if v is None else v
    a = r["a"]
    kind = odd.get("ODD", 0)
    xd, vd = x, v
    if kind == 3:
        xd = physics.play(x, odd["O1"] / 2, x[0])
        xd = uniform_filter1d(uniform_filter1d(xd, max(3, int(0.002 / dt))), max(3, int(0.002 / dt)))
        vd = np.gradient(xd, dt)
    A, B, C, D = physics.filter_matrices(spec["H"], dt)
    F, Tf = physics.march(
        dt, t, xd, vd, a, ieff, r["Tc"], r["Tc"][0] + path.get("leftover", 0.0), P, A, B, C, D
    )
    if kind == 4:
        g = np.random.default_rng(int(1e6 * abs(x[7]))).standard_normal(t.size)
        w = lfilter(*butter(1, [57, 63], "band", fs=1 / dt), g)
        F = F + odd["O1"] * w / w.std() * np.abs(v) / (np.abs(v).std() + 1e-9) * 0.6
    elif kind == 5:
        F = F + odd["O1"] * np.sqrt(np.abs(x * v)) * np.tanh(v / 0.005)
    elif kind == 6:
        F = F + odd["O1"] * x * ieff / spec["P"][IX["IMAX"]]
    elif kind == 10:
        s = physics.lag(ieff, dt, 0.008, 0.008)
        F = F + odd["O1"] * np.gradient(s, dt)
    elif kind == 12:
        w0 = 2 * np.pi * np.array([0.15, 1.0, 6.0, 40.0])
        y = sum(np.sqrt(w) * (x - physics.lag(x, dt, 1 / w, 1 / w)) for w in w0)
        F = F + odd["O1"] * y / spec["x_max"] / np.sqrt(w0[2]) / 2
    delay = path.get("delay", 0.0)
    if delay:
        F = np.interp(t - delay, t, F)
    return F, act, Tf


def sense(spec, r, F, act, run_no):
    """The columns of the file, and the noise-free force at the samples."""
    rng, s, fs = spec["rng"], spec["sensors"], spec["fs"]
    k = np.arange(r["n_pre"], r["t"].size - 1, r["os"])
    n = k.size
    t = np.round(r["t"][k], 6)
    pad = np.arange(r["n_pre"] % r["os"], r["t"].size, r["os"])
    xm = r["x"][pad] + s["displacement_sigma_m"] * rng.standard_normal(pad.size)
    if s["velocity"] == "differentiated":
        vm = np.gradient(xm, 1 / fs)
        if s["velocity_lowpass_hz"]:
            vm = filtfilt(*butter(2, s["velocity_lowpass_hz"], fs=fs), vm)
    else:
        vm = r["v"][pad] + s["velocity_sigma_m_s"] * rng.standard_normal(pad.size)
    j = np.searchsorted(pad, k)
    noise = ar1(n, s["force_rho"], s["force_sigma_n"], rng)
    clean = F[k]
    off, gain = rng.standard_normal() * s["runwise_offset_n"], rng.standard_normal() * s["runwise_gain"]
    if spec["odd"].get("ODD") == 7:
        o = spec["odd"]
        for _ in range(rng.poisson(o["O2"]) + 1):
            q = int(rng.integers(0, n - 1))
            m = int(rng.integers(2, max(4, int(0.03 * fs))))
            noise[q : q + m] += o["O1"] * rng.standard_normal(min(m, n - q)) + rng.choice([-1, 1]) * o["O1"]
    fm = clean * (1 + gain) + off + noise
    cols = {"time_s": t, "velocity_m_s": np.round(vm[j], 6)}
    if s["has_displacement"]:
        cols["displacement_m"] = np.round(xm[j], 7)
    if s["has_acceleration"]:
        cols["acceleration_m_s2"] = np.round(
            r["a"][k] + s["acceleration_sigma_m_s2"] * rng.standard_normal(n), 3
        )
    if s["command_column"]:
        cols["current_command_A"] = np.round(r["cmd"][k], 4)
        cols["current_A"] = np.round(np.maximum(act[k] + 0.002 * rng.standard_normal(n), 0), 4)
    else:
        cols["current_A"] = np.round(r["cmd"][k], 4)
    cols["temperature_C"] = np.round(r["Tc"][k] + s["temperature_sigma_c"] * rng.standard_normal(n), 2)
    cols["force_N"] = np.round(fm, 2)
    return cols, k, clean, fm - clean


def heard_error(spec, r, cols, kk, clean, noise):
    """What the true model, driven by what the file says of the speed, would miss of the force."""
    if spec["sensors"]["command_column"]:
        return noise
    t = r["t"]
    tt = np.r_[t[0], cols["time_s"], t[-1]]
    vm = np.interp(t, tt, np.r_[cols["velocity_m_s"][0], cols["velocity_m_s"], cols["velocity_m_s"][-1]])
    vm[: r["n_pre"]] = r["v"][: r["n_pre"]]
    return true_force(spec, r, v=vm)[0][kk] - clean - noise


def visible(spec, rows, contrib):
    """What of a contribution the base class cannot take up, to first order: beside its tangent."""
    P, fs = spec["P"], spec["fs"]
    imax, vm = P[IX["IMAX"]], spec["v_max"]
    num, den = (
        bilinear(spec["H"]["num"], spec["H"]["den"], fs) if len(spec["H"]["den"]) > 1 else ([1.0], [1.0])
    )
    vk = np.concatenate(
        [
            -vm * np.array([1, 0.6, 0.35, 0.2, 0.1, 0.05, 0.02]),
            [0.0],
            vm * np.array([0.02, 0.05, 0.1, 0.2, 0.35, 0.6, 1]),
        ]
    )
    vk.sort()
    ik = imax * np.array([0, 0.15, 0.3, 0.5, 0.75, 1.0])
    M, y = [], []
    for r in rows:
        sat = np.array(
            [physics.shape(q, P[IX["V0"]], int(P[IX["GT"]]), P[IX["GN"]]) + P[IX["GL"]] * q for q in r["v"]]
        )
        f = np.array([physics.f_of_i(q, P) for q in r["i"]])
        h = np.array([physics.h_of(q, w, P) for q, w in zip(r["i"], r["T"], strict=True)])
        cols = [f * h * np.interp(r["v"], vk, np.eye(vk.size)[q]) for q in range(vk.size)]
        cols += [sat * h * np.interp(r["i"], ik, np.eye(ik.size)[q]) for q in range(ik.size)]
        dT = (r["T"] - P[IX["T0"]]) / 30
        u = f * sat * h
        cols += [u * dT, u * dT * r["i"] / imax, u * dT**2]
        U = np.array([*cols, u]).T
        Y = lfilter(num, den, U, axis=0)
        b = Y[:, -1]
        d1 = np.gradient(b, 1 / fs)
        d2 = np.gradient(d1, 1 / fs)
        d3 = np.gradient(d2, 1 / fs)
        lg = physics.lag(b, 1 / fs, 0.01, 0.01)
        M.append(np.column_stack([Y[:, :-1], d1, d2, d3, lg]))
        y.append(contrib[r["n"]])
    M, y = np.vstack(M), np.concatenate(y)
    if y.size > 30000:
        q = np.linspace(0, y.size - 1, 30000).astype(int)
        M, y = M[q], y[q]
    M = M / (np.sqrt((M**2).mean(0)) + 1e-9)
    c = np.linalg.lstsq(M, y, rcond=1e-8)[0]
    return float(np.sqrt(((y - M @ c) ** 2).mean()))


def rms(x):
    return float(np.sqrt(np.mean(np.concatenate(x) ** 2)))


def expected(spec, vis):
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
        cols, kk, clean, noise = sense(spec, r, F, act, n)
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
        "expected": expected(spec, vis),
        "also_acceptable": spec["accept"],
        "note": spec["note"],
        "forms": spec["forms"],
        "parameters": {
            e: {q: float(w) for q, w in spec["parts"][e].items()}
            | {q: w for q, (e2, w) in spec["path"].items() if e2 == e}
            for e in spec["effects"]
        },
        "odd_parameters": spec["odd"],
        "base": {q: float(spec["P"][j]) for q, j in IX.items() if spec["P"][j] != 0} | {"H": spec["H"]},
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


def other_spec(seed, k):
    """Family H: Spencer's modified Bouc-Wen (0-2) and Bingham parallel to a Maxwell element (3-5)."""
    rng = case_rng(seed, "H", k)
    fs = float(rng.choice([500, 1000]))
    x_max, v_max = 0.025, 0.25 if k < 3 else 0.6
    extra = [None, "force_offset", "gas_spring", None, "force_offset", "gas_spring"][k % 6]
    par = {}
    if extra == "force_offset":
        par = {"OFF": logu(rng, 30, 80) * float(rng.choice([-1, 1]))}
    elif extra == "gas_spring":
        par = {"GK": logu(rng, 80, 300) / x_max, "GPRE": 0.0}
    plan = draw.plan_rich(rng, int(rng.integers(8, 12)), v_max, x_max)
    sensors = draw_sensors(rng, fs) | {"command_column": False}
    base = {
        "fy0": 60.0,
        "fy1": logu(rng, 500, 1200),
        "c0": logu(rng, 400, 1200),
        "vs": 0.006,
        "k": logu(rng, 4e4, 2e5),
        "c": logu(rng, 800, 3000),
    }
    # Only what the signals are made with: there is nothing of the other equations in it.
    P = np.zeros(physics.NP_)
    P[IX["IMAX"]] = 2.25 if k < 3 else 2.0
    return dict(
        family="H",
        simulator=SIMULATORS[k // 3],
        rng=rng,
        sensors=sensors,
        fs=fs,
        odd={},
        plan=plan,
        P=P,
        base=base,
        effects=[extra] if extra else [],
        own=par,
        v_max=v_max,
        x_max=x_max,
        centre=0.0,
        native=NATIVE[k // 3],
    )


def other_run(spec, p):
    """One run of the plan on the fine grid; the case warms a little, and no force depends on it."""
    return fine_run(spec, p | {"T": 25.0, "drift": 0.5})


def other_force(spec, r, i=None):
    """Force on the fine grid, and of it what the added effect makes."""
    x, v, dt, base = r["x"], r["v"], r["dt"], spec["base"]
    i = r["cmd"] if i is None else i
    if spec["simulator"] == SIMULATORS[0]:
        F = physics.spencer(dt, 100 * x, 100 * v, i, SPENCER)
    else:
        fy = base["fy0"] + base["fy1"] * (1 - np.exp(-i / 1.2))
        tau = base["c"] / base["k"]
        m = base["c"] * lfilter([1 - np.exp(-dt / tau)], [1, -np.exp(-dt / tau)], v)
        F = fy * np.tanh(v / base["vs"]) + base["c0"] * v + m
    e = spec["own"].get("OFF", 0.0) + spec["own"].get("GK", 0.0) * x
    return F + e, np.broadcast_to(e, F.shape)


def make_other(seed, k, out):
    spec = other_spec(seed, k)
    plan, par = spec["plan"], spec["own"]
    extra = next(iter(spec["effects"]), None)
    cid = case_id(seed, "H", k)
    folder = out / cid
    folder.mkdir(parents=True, exist_ok=True)
    cl, err, con = [], [], []
    power = 0.0
    for n, p in enumerate(plan):
        r = other_run(spec, p)
        F, e = other_force(spec, r)
        cols, kk, clean, noise = sense(spec, r, F, r["cmd"], n)
        write_csv(cols, folder / f"run_{n + 1:02d}.csv")
        cl.append(clean)
        err.append(noise)
        con.append(e[kk])
        power += float(np.mean(clean * r["v"][kk])) / len(plan)
    return cid, {
        "family": "H",
        "index": k,
        "effects": [extra] if extra else [],
        "native": spec["native"],
        "odd": None,
        "simulator": spec["simulator"],
        "expected": {"verdict": "found", "effects": sorted({extra} - {None})},
        "also_acceptable": [],
        "note": "",
        "forms": {},
        "parameters": {extra: par} if extra else {},
        "base": spec["base"] if k >= 3 else {"spencer": SPENCER},
        "sensors": spec["sensors"],
        "rate_hz": spec["fs"],
        "runs": len(plan),
        "plan": plan,
        "rows": int(sum(c.size for c in cl)),
        "force_rms_n": rms(cl),
        "force_max_n": float(max(np.abs(c).max() for c in cl)),
        "mean_power_w": power,
        "noise_rms_n": rms(err),
        "perfect_rmse_n": rms(err),
        "contribution_rms_n": {extra: rms(con)} if extra else {},
        "visible_rms_n": {},
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
