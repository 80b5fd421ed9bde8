"""Rod motion, current and temperature of one run, on a fine grid."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, lfilter, sosfilt


def motion(kind, t, rng, f, v_peak, x_max):
    """x(t), v, a for a peak speed v_peak, stroke at most x_max. t may begin before zero."""
    dt = t[1] - t[0]
    ph = rng.uniform(0, 2 * np.pi)
    if kind == "sine":
        amp = min(v_peak / (2 * np.pi * f), x_max)
        x = amp * np.sin(2 * np.pi * f * t + ph)
    elif kind == "triangle":
        amp = min(v_peak / (4 * f), x_max)
        s = (t * f + ph / (2 * np.pi)) % 1.0
        x = amp * (4 * np.abs(s - 0.5) - 1.0)
        x = gaussian_filter1d(x, max(1.0, 0.006 / dt), mode="nearest")
    elif kind == "chirp":
        f1, f2 = 0.5, max(2.0, f)
        T = t[-1] - t[0]
        tau = t - t[0]
        phase = 2 * np.pi * (f1 * tau + 0.5 * (f2 - f1) * tau**2 / T) + ph
        fi = f1 + (f2 - f1) * tau / T
        x = np.minimum(v_peak / (2 * np.pi * fi), x_max) * np.sin(phase)
    elif kind == "growing":
        amp = min(v_peak / (2 * np.pi * f), x_max)
        tau = (t - t[0]) / (t[-1] - t[0])
        x = amp * (0.15 + 0.85 * tau) * np.sin(2 * np.pi * f * t + ph)
    elif kind == "multisine":
        fs = f * np.array([0.37, 1.0, 1.71, 2.9])
        x = sum(np.sin(2 * np.pi * q * t + rng.uniform(0, 2 * np.pi)) / q for q in fs)
        v = np.gradient(x, dt)
        x = x * min(v_peak / np.abs(v).max(), x_max / np.abs(x).max())
    elif kind == "road":
        w = rng.standard_normal(t.size + 4000) / np.sqrt(dt)
        lo, hi = 1.1 * rng.uniform(0.8, 1.2), 11.0 * rng.uniform(0.85, 1.15)
        body = np.zeros_like(w)
        for f0, z, g in ((lo, 0.25, 1.0), (hi, 0.12, rng.uniform(0.25, 0.6))):
            sos = butter(1, [f0 * (1 - z), f0 * (1 + z)], "band", fs=1 / dt, output="sos")
            y = sosfilt(sos, w)
            body += g * y / y.std() / f0
        sos = butter(5, 25.0, fs=1 / dt, output="sos")  # steep, so that the speed is smooth between samples
        x = sosfilt(sos, body)[4000:]
        x -= x.mean()
        v = np.gradient(x, dt)
        x = x * min(v_peak / np.abs(v).max(), x_max / np.abs(x).max())
    else:
        raise ValueError(kind)
    v = np.gradient(x, dt, edge_order=2)
    a = np.gradient(v, dt, edge_order=2)
    return x, v, a


def current(kind, t, rng, level, i_max, v=None, i_low=None):
    if kind == "steady":
        return np.full(t.size, level)
    if kind == "stairs":
        n = int(rng.integers(3, 7))
        k = np.clip(((t / t[-1]) * (2 * n)).astype(int), 0, 2 * n - 1)
        up = np.concatenate([np.arange(n), np.arange(n)[::-1]])
        return i_max * up[k] / (n - 1)
    if kind == "triangle":
        per = t[-1] / rng.choice([1.0, 2.0, 3.0])
        s = (np.maximum(t, 0) / per) % 1.0
        return i_max * (1 - 2 * np.abs(s - 0.5))
    if kind == "prbs":
        hold = rng.uniform(0.12, 0.4)
        lv = rng.choice([0.0, 0.25, 0.5, 0.75, 1.0], int((t[-1] - t[0]) / hold) + 2) * i_max
        return lv[((t - t[0]) / hold).astype(int)]
    if kind == "sine":
        fq = rng.uniform(0.3, 2.5)
        return i_max * (0.5 + 0.45 * np.sin(2 * np.pi * fq * t + rng.uniform(0, 6.28)))
    if kind == "skyhook":
        # switched with the product of speed and a slow body speed, at a 200 Hz controller
        dt = t[1] - t[0]
        b = lfilter(*butter(1, 1.5, fs=1 / dt), v)
        want = np.where(b * v > 0, i_max * np.clip(np.abs(b) / (np.abs(b).max() + 1e-9) * 1.6, 0, 1), 0.0)
        step = max(1, int(0.005 / dt))
        return np.repeat(want[::step], step)[: t.size]
    if kind == "wander":
        dt = t[1] - t[0]
        y = sosfilt(butter(2, 2.0, fs=1 / dt, output="sos"), rng.standard_normal(t.size))
        y = (y - y.min()) / (y.max() - y.min())
        step = max(1, int(0.01 / dt))
        y = np.repeat(y[::step], step)[: t.size]
        return i_max * y
    raise ValueError(kind)


def ar1(n, rho, sigma, rng):
    e = rng.standard_normal(n + 200) * sigma * np.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], e)[200:]
