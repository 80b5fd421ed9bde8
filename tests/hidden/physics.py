"""The damper's equations on a fine time grid: base class, 17 effects and odd physics in one numba kernel."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from scipy.signal import cont2discrete, tf2ss

_NAMES = [
    "F0",
    "F1",
    "IS",
    "FT",
    "IMAX",
    "GT",
    "V0",
    "GL",
    "GA",
    "GV0R",
    "GN",
    "HT",
    "HB",
    "HI",
    "T0",
    "GAS",
    "GP",
    "GAV",
    "GKAP",
    "GK",
    "GPRE",
    "MASS",
    "FR",
    "FRFC",
    "FRS0",
    "FRFS",
    "FRVS",
    "FRS1",
    "VIS",
    "VC",
    "VB",
    "QC",
    "QCC",
    "OFF",
    "SH",
    "SHC",
    "SHR",
    "SHG",
    "ES",
    "EK",
    "EN",
    "EXS",
    "ECV",
    "ESIDE",
    "CAV",
    "CFL",
    "CVW",
    "CQ",
    "ST",
    "SA",
    "SX",
    "SX0",
    "OS",
    "OI0",
    "OR",
    "OM",
    "OVR",
    "RB",
    "RB0",
    "RB1",
    "RBIS",
    "PY",
    "PK",
    "MK",
    "MC",
    "ODD",
    "O1",
    "O2",
    "O3",
]
IX = {n: k for k, n in enumerate(_NAMES)}
for _n, _k in IX.items():
    globals()["p" + _n] = _k
NP_ = len(_NAMES)


@njit(cache=True)
def shape(v, v0, gt, gn):
    """The odd, saturating part of g, before any asymmetry."""
    if gt == 0:
        return math.tanh(v / v0)
    if gt == 1:
        return 2.0 / math.pi * math.atan(0.5 * math.pi * v / v0)
    if gt == 2:
        return v / math.sqrt(v * v + v0 * v0)
    if gt == 3:
        r = 1.0 - math.exp(-abs(v) / v0)
        return r if v >= 0 else -r
    r = abs(v) / v0
    r = r / (1.0 + r**gn) ** (1.0 / gn)
    return r if v >= 0 else -r


@njit(cache=True)
def f_of_i(i, P):
    ft = int(P[pFT])
    if ft == 0:
        return P[pF0] + P[pF1] * math.tanh(i / P[pIS])
    if ft == 1:
        w = i / P[pIMAX]
        return P[pF0] + P[pF1] * (w - P[pIS] * w * w)
    if ft == 2:
        return P[pF0] + P[pF1] * (1.0 - math.exp(-i / P[pIS]))
    return P[pF0] + P[pF1] * i**1.6 / (P[pIS] ** 1.6 + i**1.6)


@njit(cache=True)
def h_of(i, T, P):
    b = P[pHB] * (1.0 - P[pHI] * i / P[pIMAX])
    ht = int(P[pHT])
    if ht == 0:
        return math.exp(-b * (T - P[pT0]))
    if ht == 1:
        t0 = P[pT0] + 273.15
        return math.exp(b * t0 * t0 * (1.0 / (T + 273.15) - 1.0 / t0))
    return 1.0 - b * (T - P[pT0])


@njit(cache=True)
def evaluate(vp, xp, ap, i, T, t, s, sn, P, A, B, C, D, dt):
    """Force at the piston for a trial piston velocity; writes the states it would leave behind into sn."""
    for k in range(s.size):
        sn[k] = s[k]
    gt = int(P[pGT])
    v0 = P[pV0]
    odd = int(P[pODD])
    if odd == 11:
        v0 = v0 * (1.0 + P[pO1] * i / P[pIMAX])
    amp = 1.0
    if vp < 0:
        amp = P[pGA]
        v0 = v0 * P[pGV0R]
    sat = shape(vp, v0, gt, P[pGN])
    # states: 0 yield memory, 1 friction, 2 cavity, 3 fluid temperature, 4 path, 5 slow speed, 6.. filter
    py = int(P[pPY])
    if py == 1:
        kap = P[pPK]
        sn[0] = s[0] + (1.0 - math.exp(-kap * abs(vp) * dt)) * (sat - s[0])
        sat = sn[0]
    elif py == 2:
        kap = P[pPK]
        lo = -3.0
        hi = 3.0
        for _ in range(44):
            m = 0.5 * (lo + hi)
            if shape(m, v0, gt, P[pGN]) - s[0] - dt * kap * (vp - m) > 0:
                hi = m
            else:
                lo = m
        sn[0] = shape(0.5 * (lo + hi), v0, gt, P[pGN])
        sat = sn[0]
    g = amp * (sat + P[pGL] * vp)
    if P[pOS] > 0:
        w = math.exp(-((i / P[pOI0]) ** 2))
        go = amp * ((1.0 - P[pOM]) * shape(vp, v0 * P[pOR], gt, P[pGN]) + P[pOM] * vp / P[pOVR] + P[pGL] * vp)
        g = (1.0 - w) * g + w * go
    u = f_of_i(i, P) * g * h_of(i, T, P)
    if P[pRB] > 0 and vp < 0:
        # a different f in compression: the ratio itself depends on the current
        u *= 1.0 + P[pRB0] + P[pRB1] * math.tanh(i / P[pRBIS])
    st = int(P[pST])
    if st == 1:
        r = (xp - P[pSX0]) / P[pSX]
        u *= 1.0 + P[pSA] * r * r
    elif st == 2:
        u *= 1.0 + P[pSA] * math.tanh((xp - P[pSX0]) / P[pSX])
    elif st == 3:
        r = (xp - P[pSX0]) / P[pSX]
        u *= 1.0 - P[pSA] * math.exp(-r * r)
    if odd == 1:
        u *= 1.0 + P[pO1] * abs(ap) / (abs(ap) + P[pO2])
    elif odd == 2:
        u *= 1.0 - P[pO1] * (1.0 - math.exp(-(t + 0.3) / P[pO2]))
    elif odd == 8:
        sn[4] = s[4] + abs(vp) * dt
        u *= 1.0 + P[pO1] * math.exp(-s[4] / P[pO2])
    elif odd == 9:
        sn[5] = s[5] + dt / P[pO3] * (abs(vp) - s[5])
        u *= 1.0 - P[pO1] * s[5] / (s[5] + P[pO2])
    n = B.size
    y = D * u
    for k in range(n):
        y += C[k] * s[6 + k]
        z = B[k] * u
        for j in range(n):
            z += A[k, j] * s[6 + j]
        sn[6 + k] = z
    F = y
    if P[pVIS] > 0:
        F += P[pVC] * math.exp(-P[pVB] * (T - P[pT0])) * vp
    if vp >= 0:
        F += P[pQC] * vp * abs(vp)
    else:
        F += P[pQCC] * vp * abs(vp)
    cav = int(P[pCAV])
    if cav == 1:
        w = P[pCVW]
        a = -(F + P[pCFL]) / w
        F = F + w * (a + math.log1p(math.exp(-a)) if a > 0 else math.log1p(math.exp(a)))
    elif cav == 2:
        if -P[pCFL] > F:
            sn[2] = s[2] + abs(vp) * (1.0 + P[pCFL] / F) * dt
            F = -P[pCFL]
        elif vp > 0 and s[2] > 0:
            F *= 1.0 - 0.85 * s[2] / (s[2] + P[pCQ])
            sn[2] = max(0.0, s[2] - vp * dt)
    elif cav == 3 and vp < 0:
        F /= 1.0 + math.exp((-vp - P[pCFL]) / P[pCVW]) * P[pCQ] / (1.0 + math.exp((-vp - P[pCFL]) / P[pCVW]))
    if P[pSH] > 0:
        q = max(0.0, F * vp) + P[pSHR] * i * i
        sn[3] = s[3] + dt / P[pSHC] * q
    gas = int(P[pGAS])
    if gas == 1:
        F += P[pGP] * (1.0 / (1.0 - P[pGAV] * xp)) ** P[pGKAP]
    elif gas == 2:
        F += P[pGK] * xp + P[pGPRE]
    elif gas == 3:
        F -= P[pGP] * (1.0 / (1.0 + P[pGAV] * xp)) ** P[pGKAP]
    F += P[pMASS] * ap + P[pOFF]
    fr = int(P[pFR])
    if fr > 0:
        fc = P[pFRFC]
        if fr == 3:
            F += fc * math.tanh(vp / P[pFRVS])
        else:
            lim = fc
            if fr == 2:
                lim = fc + (P[pFRFS] - fc) * math.exp(-((vp / P[pFRVS]) ** 2))
            sg = 1.0 if vp >= 0 else -1.0
            zs = lim / P[pFRS0] * sg
            z1 = s[1] + (1.0 - math.exp(-P[pFRS0] * abs(vp) * dt / lim)) * (zs - s[1])
            F += P[pFRS0] * z1
            if fr == 2:
                F += P[pFRS1] * (z1 - s[1]) / dt
            sn[1] = z1
    if P[pES] > 0:
        side = P[pESIDE]
        for k in range(2):
            sg = 1.0 if k == 0 else -1.0
            if side * sg >= 0:  # 0: both sides
                pen = sg * xp - P[pEXS]
                if pen > 0:
                    c = P[pEK] * pen ** P[pEN] + P[pECV] * sg * vp * min(1.0, pen / 5e-4)
                    F += sg * max(0.0, c)
    return F


@njit(cache=True)
def march(dt, t, x, v, a, i, Tc, Tf0, P, A, B, C, D):
    n = t.size
    F = np.empty(n)
    Tf = np.empty(n)
    s = np.zeros(6 + B.size)
    sn = s.copy()
    s[3] = Tf0
    delta = 0.0
    vold = v[0]
    mount = P[pMK] > 0
    for k in range(n):
        T = Tc[k]
        if P[pSH] > 0:
            T = s[3]
        if not mount:
            F[k] = evaluate(v[k], x[k], a[k], i[k], T, t[k], s, sn, P, A, B, C, D, dt)
        else:
            lo = -4.0
            hi = 4.0
            for _ in range(40):
                m = 0.5 * (lo + hi)
                d = delta + (v[k] - m) * dt
                e = evaluate(m, x[k] - d, (m - vold) / dt, i[k], T, t[k], s, sn, P, A, B, C, D, dt)
                if e - P[pMK] * d - P[pMC] * (v[k] - m) > 0:
                    hi = m
                else:
                    lo = m
            m = 0.5 * (lo + hi)
            delta += (v[k] - m) * dt
            F[k] = evaluate(m, x[k] - delta, (m - vold) / dt, i[k], T, t[k], s, sn, P, A, B, C, D, dt)
            vold = m
        if P[pSH] > 0:
            sn[3] -= dt / P[pSHC] * P[pSHG] * (s[3] - Tc[k])
        for j in range(s.size):
            s[j] = sn[j]
        Tf[k] = T
    return F, Tf


@njit(cache=True)
def lag(u, dt, up, down):
    y = np.empty(u.size)
    y[0] = u[0]
    for k in range(1, u.size):
        tau = up if u[k] > y[k - 1] else down
        y[k] = u[k] + (y[k - 1] - u[k]) * math.exp(-dt / tau)
    return y


@njit(cache=True)
def play(u, r, p0):
    y = np.empty(u.size)
    p = p0
    for k in range(u.size):
        p = max(u[k] - r, min(u[k] + r, p))
        y[k] = p
    return y


@njit(cache=True)
def duhem(u, width, rate, p0):
    """Coleman-Hodgdon: dB/di = rate*sgn(di)(i - B) + drive; B lags i by up to `width`, both in amperes."""
    y = np.empty(u.size)
    b = p0
    y[0] = b
    for k in range(1, u.size):
        d = u[k] - u[k - 1]
        if d != 0.0:
            sg = 1.0 if d > 0 else -1.0
            # the difference e = b - u relaxes towards -sg*width over 1/rate amperes
            e = b - u[k - 1]
            e = -sg * width + (e + sg * width) * math.exp(-rate * abs(d))
            b = u[k] + e
        y[k] = b
    return y


def play_bank(i, kind, width, rate):
    """Magnetic state in amperes, from a demagnetised start at the run's first current (reached from zero)."""
    rise = np.concatenate([np.linspace(0.0, i[0], 200), i])
    if kind == 0:
        out = play(rise, width, 0.0)
    elif kind == 1:
        out = (play(rise, 0.5 * width, 0.0) + play(rise, width, 0.0) + play(rise, 1.5 * width, 0.0)) / 3.0
    else:
        out = duhem(rise, width, rate, 0.0)
    return np.maximum(out[200:], 0.0)


def filter_matrices(h, dt):
    num, den = np.array(h["num"], float), np.array(h["den"], float)
    if den.size == 1:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0
    A, B, C, D = tf2ss(num, den)
    A, B, C, D, _ = cont2discrete((A, B, C, D), dt, "bilinear")
    # balance the states so that the kernel starts near steady at u = 0
    return np.ascontiguousarray(A), np.ascontiguousarray(B[:, 0]), np.ascontiguousarray(C[0]), float(D[0, 0])


@njit(cache=True)
def spencer(dt, x, v, V, p):
    """Modified Bouc-Wen of 1997 in cm, N, V, s with the published LORD set; returns the force in N."""
    c0a, c0b, k0, c1a, c1b, k1, x0, aa, ab, gam, bet, Am, eta = p
    n = x.size
    F = np.empty(n)
    y = 0.0
    z = 0.0
    u = V[0]
    sub = 4
    for k in range(n):
        k1_ = min(k + 1, n - 1)
        for j in range(sub):
            r = j / sub
            xc = x[k] + r * (x[k1_] - x[k])
            vc = v[k] + r * (v[k1_] - v[k])
            h = dt / sub
            u += h * eta * (V[k] - u)
            al = aa + ab * u
            c0 = c0a + c0b * u
            c1 = c1a + c1b * u
            yd = (al * z + c0 * vc + k0 * (xc - y)) / (c0 + c1)
            if j == 0:
                F[k] = c1 * yd + k1 * (xc - x0)
            w = vc - yd
            # midpoint step for z and y
            zd = -gam * abs(w) * z * abs(z) - bet * w * z * z + Am * w
            zm = z + 0.5 * h * zd
            ym = y + 0.5 * h * yd
            yd2 = (al * zm + c0 * vc + k0 * (xc - ym)) / (c0 + c1)
            w2 = vc - yd2
            z += h * (-gam * abs(w2) * zm * abs(zm) - bet * w2 * zm * zm + Am * w2)
            y += h * yd2
    return F
