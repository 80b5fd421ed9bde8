"""Motion, current and true force of a case, on a grid far finer than its samples."""

from __future__ import annotations

import numpy as np
import physics
from physics import IX
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, lfilter
from signals import current, motion

PRE = 0.3  # seconds before the record, in which filters settle


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
