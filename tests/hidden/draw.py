"""Random draws: base damper, effects, campaign plan and sensors of one case."""

from __future__ import annotations

import numpy as np
from physics import IX, NP_

EFFECTS = [
    "gas_spring",
    "fluid_inertia",
    "coulomb_friction",
    "viscous_damping",
    "quadratic_damping",
    "force_offset",
    "current_lag",
    "magnetic_hysteresis",
    "self_heating",
    "end_stop",
    "cavitation",
    "stroke_dependent_damping",
    "off_state_backbone",
    "rebound_asymmetry",
    "preyield_stiffness",
    "mount_compliance",
    "sensor_delay",
]


def logu(rng, lo, hi):
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def draw_base(rng, asym=None):
    P = np.zeros(NP_)

    def put(**kw):
        for k, v in kw.items():
            P[IX[k]] = v

    imax = float(rng.choice([1.0, 1.5, 2.0, 2.5]))
    ft = int(rng.integers(0, 4))
    iscale = {
        0: rng.uniform(0.35, 0.9) * imax,
        1: rng.uniform(0.1, 0.42),
        2: rng.uniform(0.3, 1.0) * imax,
        3: rng.uniform(0.3, 0.8) * imax,
    }[ft]
    gt = int(rng.integers(0, 5))
    put(
        F0=logu(rng, 90, 300),
        F1=logu(rng, 800, 2300),
        IS=iscale,
        FT=ft,
        IMAX=imax,
        GT=gt,
        V0=logu(rng, 0.015, 0.07),
        GL=rng.uniform(0.2, 1.3),
        GA=1.0,
        GV0R=1.0,
        GN=rng.uniform(2, 5),
        HT=int(rng.integers(0, 3)),
        HB=logu(rng, 0.0015, 0.009),
        HI=rng.uniform(-0.2, 0.5) if rng.random() < 0.5 else 0.0,
        T0=30.0,
    )
    if asym:
        put(GA=rng.uniform(0.7, 0.92), GV0R=rng.uniform(0.7, 1.3))
    k = rng.choice(["unit", "lag", "leadlag", "second", "third"], p=[0.08, 0.34, 0.18, 0.25, 0.15])
    tau = logu(rng, 0.0015, 0.006)
    w, z = 2 * np.pi * logu(rng, 28, 80), rng.uniform(0.5, 1.2)
    h = {
        "unit": ([1.0], [1.0]),
        "lag": ([1.0], [tau, 1.0]),
        "leadlag": ([0.3 * tau, 1.0], [tau, 1.0]),
        "second": ([1.0], [1 / w**2, 2 * z / w, 1.0]),
        "third": (np.array([1.0]), np.polymul([1 / w**2, 2 * z / w, 1.0], [0.5 * tau, 1.0])),
    }[k]
    H = {"kind": str(k), "num": [float(q) for q in h[0]], "den": [float(q) for q in h[1]]}
    return P, H


def draw_effect(name, variant, rng, P, ctx):
    """Parameters of one effect: in the kernel's names (put), for the current and sensor path (path)."""
    g = lambda n: P[IX[n]]  # noqa: E731
    imax, fmax, vref, xm = g("IMAX"), g("F0") + g("F1"), ctx["v_max"], ctx["x_max"]
    put, path, form = {}, {}, ""
    if name == "gas_spring":
        kind = [1, 2, 3, 2][variant % 4] if ctx.get("gas") is None else ctx["gas"]
        if kind in (1, 3):
            av = rng.uniform(0.15, 0.5) / xm
            put = dict(GAS=kind, GP=logu(rng, 50, 300), GAV=av, GKAP=rng.uniform(1.0, 1.4))
            form = "p0A(1/(1-Ax/V0))^kappa" if kind == 1 else "-p0A(1/(1+Ax/V0))^kappa (pushes the rod out)"
        else:
            amp = logu(rng, 50, 300)
            pre = rng.choice([0.0, rng.uniform(30, 200)]) if ctx.get("pre") is None else ctx["pre"]
            put = dict(GAS=2, GK=amp / xm, GPRE=pre * rng.choice([-1, 1]))
            form = "k x + preload"
    elif name == "fluid_inertia":
        put, form = dict(MASS=logu(rng, 1, 20)), "m a"
    elif name == "coulomb_friction":
        fc = logu(rng, 20, 100)
        kind = [1, 2, 3, 2][variant % 4]
        put = dict(
            FR=kind,
            FRFC=fc,
            FRS0=fc / logu(rng, 2e-5, 3e-4),
            FRFS=fc * rng.uniform(1.05, 1.5),
            FRVS=logu(rng, 0.002, 0.01) if kind == 2 else logu(rng, 5e-4, 3e-3),
            FRS1=rng.uniform(0, 200),
        )
        form = {1: "Dahl", 2: "LuGre", 3: "tanh(v/vs)"}[kind]
    elif name == "viscous_damping":
        put = dict(VIS=1, VC=logu(rng, 0.04, 0.3) * fmax / vref, VB=logu(rng, 0.01, 0.03))
        form = "c exp(-b(T-T0)) v"
    elif name == "quadratic_damping":
        c = logu(rng, 0.04, 0.35) * fmax / vref**2
        put = dict(QC=c, QCC=c if variant % 4 != 3 else c * rng.uniform(0.6, 0.9))
        form = "c v|v|" + (" (own c per direction)" if variant % 4 == 3 else "")
    elif name == "force_offset":
        put, form = dict(OFF=logu(rng, 10, 80) * rng.choice([-1, 1])), "constant"
    elif name == "current_lag":
        up = logu(rng, 0.005, 0.025)
        path = dict(lag_up=up, lag_down=up if variant % 2 == 0 else up * rng.uniform(0.4, 0.9))
        form = "first order, up and down"
    elif name == "magnetic_hysteresis":
        path = dict(
            play_kind=[0, 1, 2, 2][variant % 4],
            play_width=logu(rng, 0.02, 0.09) * imax,
            play_rate=rng.uniform(3, 12) / imax,
        )
        form = ["play", "three plays", "Coleman-Hodgdon", "Coleman-Hodgdon"][variant % 4]
    elif name == "self_heating":
        C = logu(rng, 150, 700)
        put = dict(SH=1, SHC=C, SHR=rng.uniform(1, 5), SHG=C / logu(rng, 60, 400))
        path = dict(leftover=rng.uniform(0, 8) if variant % 4 == 3 else 0.0)
        form = "C dTf/dt = Fv + R i^2 - G(Tf - Tc)"
    elif name == "end_stop":
        n = [1.0, 1.5, 2.0, 1.5][variant % 4]
        xs = xm * rng.uniform(0.82, 0.94)
        put = dict(
            ES=1,
            EXS=xs,
            EN=n,
            EK=logu(rng, 300, 2500) / (xm - xs) ** n,
            ECV=rng.choice([0.0, logu(rng, 100, 1000)]),
            ESIDE=float([0, 1, -1, 0][variant % 4]),
        )
        form = "k(|x|-xs)^n + c v"
    elif name == "cavitation":
        kind = [1, 3, 2, 1][variant % 4]
        lim = rng.uniform(0.35, 0.75) * fmax
        put = dict(CAV=kind, CFL=lim, CVW=0.04 * lim, CQ=2e-3)
        if kind == 3:
            put = dict(CAV=3, CFL=rng.uniform(0.3, 0.6) * vref, CVW=0.06 * vref, CQ=logu(rng, 0.15, 0.6))
        form = {
            1: "soft limit of the compression force",
            2: "limit with a cavity that must close",
            3: "onset with compression speed",
        }[kind]
    elif name == "stroke_dependent_damping":
        kind = [1, 2, 3, 1][variant % 4]
        sg = rng.choice([-1, 1]) if kind == 1 else 1.0
        put = dict(
            ST=kind,
            SA=logu(rng, 0.08, 0.4) * sg,
            SX=xm * (1.0 if kind == 1 else rng.uniform(0.25, 0.6)),
            SX0=rng.uniform(-0.2, 0.2) * xm,
        )
        form = {1: "1+s(x/xm)^2", 2: "1+s tanh(x/w) taper", 3: "1-s exp(-(x/w)^2) bypass groove"}[kind]
    elif name == "off_state_backbone":
        put = dict(
            OS=1,
            OI0=rng.uniform(0.08, 0.2) * imax,
            OR=logu(rng, 1.6, 4),
            OM=rng.uniform(0.1, 0.7),
            OVR=rng.uniform(0.3, 0.6) * vref,
        )
        form = "softer knee and more linear near 0 A, weight exp(-(i/i0)^2)"
    elif name == "rebound_asymmetry":
        s = logu(rng, 0.06, 0.3) * rng.choice([-1, 1])
        mix = [(0.0, 1.0), (0.4, 0.6), (1.0, 0.0), (-0.3, 1.0)][variant % 4]
        put = dict(RB=1, RB0=s * mix[0], RB1=s * mix[1], RBIS=0.4 * imax)
        form = "compression force times 1 + r0 + r1 tanh(i/is)"
    elif name == "preyield_stiffness":
        kk = logu(rng, 0.5e6, 5e6)
        put = dict(PY=1 if variant % 2 == 0 else 2, PK=kk / fmax)
        form = (
            "rate-independent yield memory"
            if variant % 2 == 0
            else "spring in series with the yielding element"
        )
        path = dict(stiffness_at_full_current_N_m=kk)
    elif name == "mount_compliance":
        put = dict(MK=logu(rng, 0.5e6, 5e6), MC=logu(rng, 500, 4000))
        form = "series spring and damper"
    elif name == "sensor_delay":
        path, form = dict(delay=logu(rng, 0.0006, 0.005)), "F(t - tau)"
    return put, path, form


def draw_sensors(rng, fs, differentiated=None, *, hard=False):
    d = bool(rng.random() < 0.4) if differentiated is None else differentiated
    s = {
        "force_sigma_n": logu(rng, 2, 20),
        "force_rho": float(rng.uniform(0.5, 0.95)) if rng.random() < 0.4 else 0.0,
        "velocity": "differentiated" if d else "measured",
        "velocity_sigma_m_s": logu(rng, 3e-4, 3e-3),
        "displacement_sigma_m": logu(rng, 1e-6, 4e-6) * 500 / fs if d else logu(rng, 5e-6, 4e-5),
        "velocity_lowpass_hz": float(rng.uniform(50, 100)) if rng.random() < 0.7 else None,
        "has_displacement": bool(rng.random() < (0.7 if d else 0.55)),
        "has_acceleration": bool(rng.random() < 0.15),
        "acceleration_sigma_m_s2": float(rng.uniform(0.1, 0.5)),
        "temperature_sigma_c": float(rng.uniform(0.02, 0.2)),
        "runwise_offset_n": 0.0,
        "runwise_gain": 0.0,
        "command_column": False,
    }
    if s["velocity_lowpass_hz"] and s["velocity_lowpass_hz"] > 0.4 * fs:
        s["velocity_lowpass_hz"] = 0.3 * fs
    if hard:
        s["displacement_sigma_m"] *= 3
    return s


def plan_rich(rng, n, v_max, x_max, dur=(3, 6), *, hot=False):
    """Several frequencies, amplitudes, currents (steady, stepped, swept) and two or three temperatures."""
    temps = [[22.0, 60.0], [20.0, 45.0, 70.0], [25.0, 50.0]][int(rng.integers(0, 3))]
    fs = np.array([0.6, 1.0, 1.7, 3.0, 5.0, 8.0])
    order = rng.permutation(np.resize(fs, n))
    kinds = ["sine", "multisine", "chirp", "triangle", "growing", "sine"]
    curs = ["steady", "steady", "stairs", "triangle", "steady", "prbs", "steady", "sine"]
    levels = np.resize([0.0, 1.0, 0.5, 0.15, 0.75, 0.3], n)
    plan, used = [], 0
    for k in range(n):
        c = curs[k % len(curs)]
        lv = 0.0
        if c == "steady":
            lv = levels[used % 6]
            used += 1
        # peak speeds spread over the range: full speed at least every third run
        vp = v_max if k % 3 == 0 else v_max * logu(rng, 0.12, 0.9)
        f = float(order[k]) * rng.uniform(0.85, 1.15)
        kind = kinds[int(rng.integers(0, len(kinds)))]
        if k % 4 == 1:
            kind, f, vp = "sine", rng.uniform(0.6, 1.2), v_max  # fills the stroke
        plan.append(
            dict(
                kind=kind,
                f=f,
                v=vp,
                x=x_max,
                cur=c,
                level=lv,
                T=temps[(k * 2 // 3) % len(temps)],
                drift=rng.uniform(0, 2.0),
                dur=float(rng.uniform(*dur)),
            )
        )
    return plan


def plan_confounded(rng, n, v_max, x_max, *, one_temp=True):
    f = rng.uniform(1.5, 5.0)
    v = min(v_max, 2 * np.pi * f * x_max * 0.6)
    lv = np.linspace(0, 1, 4)
    return [
        dict(
            kind="sine",
            f=f,
            v=v,
            x=x_max,
            cur="steady",
            level=float(lv[k % 4]),
            T=25.0 if one_temp else [22.0, 55.0][k // 4 % 2],
            drift=0.3,
            dur=float(rng.uniform(3, 4)),
        )
        for k in range(n)
    ]


def plan_road(rng, n, v_max, x_max):
    curs = ["skyhook", "wander", "prbs", "skyhook", "stairs", "wander"]
    T = [25.0, 55.0, 40.0]
    return [
        dict(
            kind="road",
            f=1.0,
            v=v_max * rng.uniform(0.6, 1.0),
            x=x_max,
            cur=curs[k % 6],
            level=0.0,
            T=T[k % 3],
            drift=1.0,
            dur=float(rng.uniform(4, 6)),
        )
        for k in range(n)
    ]


PAIRS = [
    ("gas_spring", "current_lag"),
    ("fluid_inertia", "quadratic_damping"),
    ("coulomb_friction", "force_offset"),
    ("viscous_damping", "magnetic_hysteresis"),
    ("end_stop", "current_lag"),
    ("gas_spring", "coulomb_friction"),
    ("rebound_asymmetry", "gas_spring"),
    ("mount_compliance", "quadratic_damping"),
    ("stroke_dependent_damping", "current_lag"),
    ("cavitation", "gas_spring"),
    ("self_heating", "viscous_damping"),
    ("off_state_backbone", "fluid_inertia"),
    ("force_offset", "end_stop"),
    ("preyield_stiffness", "magnetic_hysteresis"),
    ("sensor_delay", "coulomb_friction"),
]
ODD = {
    1: "force thickens with |acceleration|",
    2: "force fades with run time",
    3: "free play in the rod end",
    4: "60 Hz rig vibration, modulated by speed",
    5: "c sqrt|x v| sign v",
    6: "gas stiffness grows with the current",
    7: "bursts of load-cell glitches",
    8: "breakaway: decays with the travelled path",
    9: "thinning by the slow mean speed",
    10: "force from di/dt",
    11: "knee speed depends on the current",
    12: "fractional (order 0.5) bushing in parallel",
}
CONF = [
    ("gas_spring", 0),
    ("fluid_inertia", 0),
    ("current_lag", 0),
    ("gas_spring", 1),
    ("quadratic_damping", 0),
    ("fluid_inertia", 1),
    ("magnetic_hysteresis", 0),
    ("gas_spring", 2),
    ("sensor_delay", 0),
    ("fluid_inertia", 2),
    ("viscous_damping", 0),
    ("gas_spring", 3),
]
FNUIS = [
    ("runwise", None),
    ("runwise", "gas_spring"),
    ("runwise", "quadratic_damping"),
    ("diff", None),
    ("diff", "fluid_inertia"),
    ("diff", "coulomb_friction"),
    ("short", None),
    ("short", "viscous_damping"),
    ("short", "current_lag"),
    ("one", None),
    ("one", "gas_spring"),
    ("one", "rebound_asymmetry"),
]
ROAD = [
    None,
    "gas_spring",
    "current_lag",
    "viscous_damping",
    None,
    "coulomb_friction",
    "stroke_dependent_damping",
    "fluid_inertia",
]
SIZES = {"A": 68, "B": 25, "C": 12, "D": 12, "E": 15, "F": 12, "G": 8, "H": 6}
