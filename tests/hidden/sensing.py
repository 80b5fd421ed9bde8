"""What the sensors make of a run, the file of it, and what of the truth can be seen there."""

from __future__ import annotations

import numpy as np
import physics
from fine import true_force
from physics import IX
from scipy.signal import bilinear, butter, filtfilt, lfilter
from signals import ar1


def write_csv(columns, path):
    values = np.column_stack([np.asarray(c, dtype=float) for c in columns.values()])
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")


def sense(spec, r, F, act):
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
