"""What a careful user would do with pySINDy and sysidentpy: opponents.py DIR -o PREFIX [--cases a,b].

DIR holds one folder of run CSVs per case. Writes PREFIX_<tool>.json: {case: {verdict, effects, ...}}. Tools:
pysindy (STLSQ, threshold by cross-validation over runs, one-standard-error rule), pysindy_ensemble (the same
threshold, bagged, inclusion >= 0.8), pysindy_top1 (only the effect of largest contribution, and only if the
library beats the base alone in cross-validation), sysidentpy_nfir (FROLS on the filtered features, order by
cross-validation), sysidentpy_narx (FROLS with two force lags, order by the BIC). Terms and the effects they
stand for are made in features(); every other term is part of the base. Needs pandas, pysindy and sysidentpy
in an environment of its own: they do not live beside this project's versions.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pysindy as ps
from scipy.optimize import least_squares
from scipy.signal import lfilter, savgol_filter
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

warnings.filterwarnings("ignore")
MAX_ROWS = 16000


def load(folder):
    runs = []
    for f in sorted(folder.glob("*.csv")):
        d = pd.read_csv(f)
        t = d.time_s.to_numpy()
        dt = float(np.median(np.diff(t)))
        n = len(d)
        w = max(5, int(0.02 / dt) | 1)
        v = d.velocity_m_s.to_numpy()
        if w < n:
            v_s = savgol_filter(v, w, 3)
            a = savgol_filter(v, w, 3, deriv=1, delta=dt)
        else:
            v_s, a = v, np.gradient(v, dt)
        if "acceleration_m_s2" in d:
            a = d.acceleration_m_s2.to_numpy()
        if "displacement_m" in d:
            x = d.displacement_m.to_numpy()
        else:
            x = np.cumsum(v) * dt
            x = x - np.polyval(np.polyfit(t, x, 1), t)
        i = d.current_A.to_numpy()
        runs.append(
            dict(t=t, dt=dt, v=v_s, a=a, x=x, i=i, T=d.temperature_C.to_numpy(), F=d.force_N.to_numpy())
        )
    return runs


def lag1(u, dt, tau):
    if tau <= 1e-5:
        return u
    b = np.exp(-dt / tau)
    return lfilter([1 - b], [1, -b], u, zi=[b * u[0]])[0]


def play(u, r):
    y = np.empty_like(u)
    p = u[0]
    for k, q in enumerate(u):
        p = max(q - r, min(q + r, p))
        y[k] = p
    return y


class Base:
    """F = lag lag [(F0 + F1 tanh((i/is)^p)) (tanh(v/v0) + c v) exp(-b (T - T0))], least squares."""

    def __init__(self, runs):
        self.imax = max(r["i"].max() for r in runs) or 1.0
        self.T0 = float(np.mean([r["T"].mean() for r in runs]))
        Fm = max(np.abs(r["F"]).max() for r in runs)
        best = None
        for v0 in (0.02, 0.06):
            q0 = np.array([0.15, 0.9, 0.6, np.log(v0), 0.5, 0.004, np.log(0.003), np.log(0.001), 1.0])
            lo = [0, -1, 0.1, np.log(0.002), -1, -0.03, np.log(2e-4), np.log(2e-5), 0.5]
            hi = [2, 5, 5, np.log(0.5), 10, 0.05, np.log(0.02), np.log(0.02), 3.0]
            self.Fm = Fm
            s = least_squares(
                lambda q: np.concatenate([(self.force(q, r) - r["F"])[::3] for r in runs]) / Fm,
                q0,
                bounds=(lo, hi),
                loss="soft_l1",
                f_scale=0.05,
                max_nfev=100,
            )
            if best is None or s.cost < best.cost:
                best = s
        self.q = best.x
        self.tau, self.tau2 = float(np.exp(best.x[6])), float(np.exp(best.x[7]))
        self.v0 = float(np.exp(best.x[3]))

    def f(self, i, q=None):
        q = self.q if q is None else q
        return self.Fm * (q[0] + q[1] * np.tanh((np.maximum(i, 0) / (q[2] * self.imax)) ** q[8]))

    def g(self, v, q=None):
        q = self.q if q is None else q
        return np.tanh(v / np.exp(q[3])) + q[4] * v

    def h(self, T, q=None):
        q = self.q if q is None else q
        return np.exp(-q[5] * (T - self.T0))

    def force(self, q, r):
        u = self.f(r["i"], q) * self.g(r["v"], q) * self.h(r["T"], q)
        return lag1(lag1(u, r["dt"], np.exp(q[6])), r["dt"], np.exp(q[7]))


def features(runs, base, *, filtered=True):
    """Columns by name and, for each, the effect it stands for (None: the base)."""
    xm = max(np.abs(r["x"]).max() for r in runs)
    vm = max(np.abs(r["v"]).max() for r in runs)
    Fm = max(np.abs(r["F"]).max() for r in runs)
    im, v0 = base.imax, base.v0
    out = []
    for r in runs:
        v, i, x, a, dt = r["v"], r["i"], r["x"], r["a"], r["dt"]
        dT = (r["T"] - base.T0) / 20
        f, g, h = base.f(i), base.g(v), base.h(r["T"])
        u = f * g * h
        flt = (lambda z, dt=dt: lag1(lag1(z, dt, base.tau), dt, base.tau2)) if filtered else (lambda z: z)
        gx = {
            "tanh(v/v0)": np.tanh(v / v0),
            "tanh(2.5v/v0)": np.tanh(2.5 * v / v0),
            "tanh(v/2.5v0)": np.tanh(v / 2.5 / v0),
            "v": v,
        }
        c = {}
        for n, q in gx.items():
            c[f"f*{n}"] = (flt(f * h * q), None)
        c["f*tanh*T"] = (flt(f * h * gx["tanh(v/v0)"] * dT), None)
        c["f*v*T"] = (flt(f * h * v * dT), None)
        for p in (1, 2, 3):
            c[f"i^{p}*g"] = (flt((i / im) ** p * g * h), None)
        c["i*g*T"] = (flt((i / im) * g * h * dT), None)
        Fb = flt(u)
        dFb = np.gradient(Fb, dt)
        c["d2Fb"] = (np.gradient(dFb, dt), None)
        c["d3Fb"] = (np.gradient(np.gradient(dFb, dt), dt), None)
        c["dFb"] = (dFb, None)  # an error in the lag; only what a lag cannot do is called a delay
        tt = np.arange(v.size) * dt
        c["delay"] = (np.interp(tt - 0.003, tt, Fb) - Fb, "sensor_delay")
        c["x"] = (x, "gas_spring")
        c["x^2"] = (x * x, "gas_spring")
        c["a"] = (a, "fluid_inertia")
        c["sign(v)"] = (np.tanh(v / 0.002), "coulomb_friction")
        c["dahl"] = (x - play(x, 1e-4), "coulomb_friction")
        c["v"] = (v, "viscous_damping")
        c["v*T"] = (v * dT, "viscous_damping")
        c["v|v|"] = (v * np.abs(v), "quadratic_damping")
        c["1"] = (np.ones_like(v), "force_offset")
        for tau in (0.006, 0.018):
            c[f"currentlag{tau}"] = (flt((base.f(lag1(i, dt, tau)) - f) * g * h), "current_lag")
        for w in (0.03, 0.08):
            c[f"play{w}"] = (flt((base.f(np.maximum(play(i, w * im), 0)) - f) * g * h), "magnetic_hysteresis")
        c["Fb*energy"] = (Fb * np.cumsum(np.maximum(r["F"] * v, 0)) * dt / 1000, "self_heating")
        for s in (0.82, 0.92):
            c[f"stop{s}+"] = (np.maximum(x - s * xm, 0), "end_stop")
            c[f"stop{s}-"] = (np.minimum(x + s * xm, 0), "end_stop")
        for s in (0.4, 0.7):
            c[f"cavF{s}"] = (np.maximum(-Fb - s * Fm, 0), "cavitation")
        c["cavv"] = (np.where(v < -0.5 * vm, Fb, 0.0), "cavitation")
        c["Fb*x"] = (Fb * x / xm, "stroke_dependent_damping")
        c["Fb*x^2"] = (Fb * (x / xm) ** 2, "stroke_dependent_damping")
        w0 = np.exp(-((i / (0.12 * im)) ** 2))
        c["off*v"] = (flt(w0 * f * h * v), "off_state_backbone")
        c["off*tanh"] = (flt(w0 * f * h * np.tanh(v / 3 / v0)), "off_state_backbone")
        c["Fb*(v<0)"] = (flt(np.where(v < 0, u, 0)), "rebound_asymmetry")
        c["Fb*i*(v<0)"] = (flt(np.where(v < 0, u * i / im, 0)), "rebound_asymmetry")
        for w in (2e-4, 1e-3):
            c[f"yield{w}"] = (flt(f * h * ((x - play(x, w)) / w - np.tanh(v / v0))), "preyield_stiffness")
        slope = f * h * ((1 - np.tanh(v / v0) ** 2) / v0 + base.q[4])
        c["dFb*dF/dv"] = (-flt(slope * dFb), "mount_compliance")
        out.append(c)
    names = list(out[0])
    return names, {n: out[0][n][1] for n in names}, [np.column_stack([c[n][0] for n in names]) for c in out]


def folds(n):
    k = min(5, n)
    return [np.arange(j, n, k) for j in range(k)]


def thin(runs, X):
    total = sum(len(r["F"]) for r in runs)
    s = max(1, int(np.ceil(total / MAX_ROWS)))
    return [x[::s] for x in X], [r["F"][::s] for r in runs]


def split_one_run(X, y):
    if len(X) > 1:
        return X, y
    return list(np.array_split(X[0], 5)), list(np.array_split(y[0], 5))


def stlsq(X, y, thr):
    o = ps.STLSQ(threshold=thr, alpha=1e-6, max_iter=30)
    o.fit(X, y.reshape(-1, 1))
    return np.asarray(o.coef_).ravel()


def run_pysindy(runs, X, names, stands):
    X, y = split_one_run(*thin(runs, X))
    scale = np.sqrt(np.mean(np.vstack(X) ** 2, axis=0)) + 1e-12
    X = [x / scale for x in X]
    ths = np.array([0.5, 1, 2, 4, 8, 15, 30, 60])
    err = np.full((ths.size, len(folds(len(X)))), np.nan)
    for j, te in enumerate(folds(len(X))):
        tr = [k for k in range(len(X)) if k not in te]
        A, b = np.vstack([X[k] for k in tr]), np.concatenate([y[k] for k in tr])
        for q, th in enumerate(ths):
            try:
                c = stlsq(A, b, th)
            except (ValueError, np.linalg.LinAlgError):
                continue
            err[q, j] = np.sqrt(np.mean(np.concatenate([(X[k] @ c - y[k]) ** 2 for k in te])))
    m, se = np.nanmean(err, 1), np.nanstd(err, 1) / np.sqrt(err.shape[1])
    b = int(np.nanargmin(m))
    best = max(q for q in range(ths.size) if m[q] <= m[b] + se[b])
    A, yy = np.vstack(X), np.concatenate(y)
    c = stlsq(A, yy, ths[best])
    one = {names[k]: float(c[k] / scale[k]) for k in np.flatnonzero(c)}
    np.random.seed(0)  # noqa: NPY002 - pySINDy draws from it
    ens = ps.EnsembleOptimizer(
        ps.STLSQ(threshold=float(ths[best]), alpha=1e-6, max_iter=30),
        bagging=True,
        n_models=15,
        n_subset=int(0.6 * len(yy)),
    )
    ens.fit(A, yy.reshape(-1, 1))
    L = np.array([np.ravel(q) for q in ens.coef_list])
    inc = (np.abs(L) > 0).mean(0)
    med = np.median(L, 0)
    two = {names[k]: float(med[k] / scale[k]) for k in np.flatnonzero(inc >= 0.8)}
    # the kindest reading: one name, that of the largest contribution, if the library beats the base alone
    isbase = np.array([stands[n] is None for n in names])
    e0 = []
    for te in folds(len(X)):
        tr = [k for k in range(len(X)) if k not in te]
        cb = np.linalg.lstsq(
            np.vstack([X[k] for k in tr])[:, isbase], np.concatenate([y[k] for k in tr]), rcond=None
        )[0]
        e0.append(np.sqrt(np.mean(np.concatenate([(X[k][:, isbase] @ cb - y[k]) ** 2 for k in te]))))
    top, size = {}, 0.0
    if np.mean(e0) > m[best] + se[best]:
        for e in {stands[names[k]] for k in np.flatnonzero(c)} - {None}:
            ks = [k for k in np.flatnonzero(c) if stands[names[k]] == e]
            q = np.sqrt(np.mean((A[:, ks] @ c[ks]) ** 2))
            if q > size:
                top, size = {names[k]: float(c[k] / scale[k]) for k in ks}, q
    return (
        one,
        two,
        top,
        {"threshold_n": float(ths[best]), "cv_rmse_n": float(m[best]), "cv_base_n": float(np.mean(e0))},
    )


def frols(X, y, names, n_terms, ylag=None, *, order_selection=False):
    kw = dict(
        basis_function=Polynomial(degree=1), estimator=LeastSquares(), xlag=[[1]] * X.shape[1], err_tol=None
    )
    if ylag:
        m = FROLS(
            ylag=ylag, n_info_values=20, order_selection=True, info_criteria="bic", model_type="NARMAX", **kw
        )
    else:
        m = FROLS(
            n_terms=n_terms,
            order_selection=order_selection,
            n_info_values=n_terms,
            model_type="NFIR",
            ylag=1,
            **kw,
        )
    # sysidentpy's inputs start at lag 1: shift by one sample so that x(k-1) is the present value
    Xs = np.vstack([X[1:], X[-1:]])
    with contextlib.redirect_stdout(io.StringIO()):
        m.fit(X=Xs, y=y.reshape(-1, 1))
    picked = []
    for row, th in zip(np.atleast_2d(m.final_model), np.ravel(m.theta), strict=False):
        code = int(row[0])
        if code == 0:
            picked.append(("1", th))
        elif code < 2000:
            picked.append((f"y(k-{code - 1000})", th))
        else:
            picked.append((names[code // 1000 - 2], th))
    return picked


def run_frols(runs, X, names):
    keep = [k for k, n in enumerate(names) if n != "1"]  # sysidentpy has a constant of its own
    nm = [names[k] for k in keep]
    X, y = split_one_run(*thin(runs, X))
    X = [x[:, keep] for x in X]
    scale = np.sqrt(np.mean(np.vstack(X) ** 2, axis=0)) + 1e-12
    X = [x / scale for x in X]
    N = 20
    path = frols(np.vstack(X), np.concatenate(y), nm, N)
    order = [p[0] for p in path]

    def col(n, k):
        return np.ones(len(y[k])) if n == "1" else X[k][:, nm.index(n)]

    fo = folds(len(X))
    err = np.empty((len(order), len(fo)))
    for j, te in enumerate(fo):
        tr = [k for k in range(len(X)) if k not in te]
        for q in range(len(order)):
            A = np.vstack([np.column_stack([col(n, k) for n in order[: q + 1]]) for k in tr])
            c = np.linalg.lstsq(A, np.concatenate([y[k] for k in tr]), rcond=None)[0]
            e = np.concatenate([np.column_stack([col(n, k) for n in order[: q + 1]]) @ c - y[k] for k in te])
            err[q, j] = np.sqrt(np.mean(e**2))
    m, se = err.mean(1), err.std(1) / np.sqrt(len(fo))
    b = int(m.argmin())
    best = next(q for q in range(len(order)) if m[q] <= m[b] + se[b])
    return dict.fromkeys(order[: best + 1]), {"terms": best + 1, "cv_rmse_n": float(m[best])}


def run_narx(runs, X, names):
    keep = [k for k, n in enumerate(names) if n != "1"]
    nm = [names[k] for k in keep]
    X = [x[:, keep] for x in X]
    # the rows stay consecutive in time: blocks of every run, joined by hand
    total = sum(map(len, X))
    part = min(1.0, MAX_ROWS / total)
    A = np.vstack([x[: int(part * len(x))] for x in X])
    y = np.concatenate([r["F"][: int(part * len(r["F"]))] for r in runs])
    A = A / (np.sqrt((A**2).mean(0)) + 1e-12)
    return {n: float(t) for n, t in frols(A, y, nm, 20, ylag=2)}, {}


def answer(picked, stands, sec, info):
    eff = {}
    for n, c in picked.items():
        e = stands.get(n)
        if e:
            eff.setdefault(e, {})[n] = c
    return {
        "verdict": "found" if eff else "none",
        "effects": sorted(eff),
        "seconds": round(sec, 2),
        "parameters": eff,
        "terms": list(picked),
        "info": info,
    }


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("dir", type=Path)
    ap.add_argument("-o", default="results", help="prefix of the result files")
    ap.add_argument("--cases", help="comma list of case folders, or families.json:A:30,B:10")
    a = ap.parse_args()
    todo = sorted(p.name for p in a.dir.iterdir() if p.is_dir())
    if a.cases and ".json:" in a.cases:
        path, _, what = a.cases.partition(".json:")
        fam = json.loads(Path(path + ".json").read_text())
        todo = [c for w in what.split(",") for c in fam[w.split(":")[0]][: int(w.split(":")[1])]]
    elif a.cases:
        todo = a.cases.split(",")
    res = {
        t: {} for t in ("pysindy", "pysindy_ensemble", "pysindy_top1", "sysidentpy_nfir", "sysidentpy_narx")
    }
    for n, case in enumerate(todo):
        t0 = time.time()
        runs = load(a.dir / case)
        base = Base(runs)
        names, stands, X = features(runs, base)
        t1 = time.time() - t0
        t2 = time.time()
        one, two, top, info = run_pysindy(runs, X, names, stands)
        t3 = time.time() - t2
        res["pysindy"][case] = answer(one, stands, t1 + t3, info)
        res["pysindy_ensemble"][case] = answer(two, stands, t1 + t3, info)
        res["pysindy_top1"][case] = answer(top, stands, t1 + t3, info)
        t2 = time.time()
        p, info2 = run_frols(runs, X, names)
        res["sysidentpy_nfir"][case] = answer(p, stands, t1 + time.time() - t2, info2)
        t2 = time.time()
        _, stands_u, Xu = features(runs, base, filtered=False)
        p, info3 = run_narx(runs, Xu, names)
        res["sysidentpy_narx"][case] = answer(p, stands_u, t1 + time.time() - t2, info3)
        for t, r in res.items():
            Path(f"{a.o}_{t}.json").write_text(json.dumps(r, indent=1))
        named = res["pysindy"][case]["effects"]
        sys.stderr.write(f"{n + 1}/{len(todo)} {case} base {t1:.1f} s, pysindy {t3:.1f} s, {named}\n")


if __name__ == "__main__":
    main()
