"""Dampers of other kinds, whose own effects are known: Bouc-Wen and Bingham beside Maxwell."""

from __future__ import annotations

import draw
import numpy as np
import physics
from draw import draw_sensors, logu
from fine import fine_run
from physics import IX
from scipy.signal import lfilter
from sensing import rms, sense, write_csv
from spec import case_id, case_rng

SPENCER = (21.0, 3.5, 46.9, 283.0, 2.95, 5.0, 14.3, 140.0, 695.0, 363.0, 363.0, 301.0, 190.0)
SIMULATORS = ("Spencer modified Bouc-Wen", "Bingham + Maxwell in parallel")
NATIVE = (
    ["preyield_stiffness", "gas_spring", "current_lag", "force_offset", "magnetic_hysteresis"],
    ["viscous_damping", "preyield_stiffness"],
)


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
        cols, kk, clean, noise = sense(spec, r, F, r["cmd"])
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
