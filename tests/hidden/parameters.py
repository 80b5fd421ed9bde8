"""Parameters and their intervals beside the truth, where generator and mrctl mean the same quantity.

`COMPARED` says for each effect which of the generator's forms has which of our parameters, as numbers or as
the reason why there is none. An effect's parameter that is not named for a form is a fault of this table.
"""

from __future__ import annotations

import math
from collections import defaultdict
from statistics import NormalDist

import numpy as np

from mrctl.model.effects.registry import effects
from mrctl.model.effects.viscous_damping import REFERENCE_C

# A string in place of a number: not comparable, and why.
FORM = "the generator's form is another"


def _gas_spring(p, case):
    zero = case["sensors"]["has_displacement"]
    where = "the stroke's zero was not measured"
    if p["GAS"] == 2:
        return {
            "preload_n": p["GPRE"] if zero else where,
            "stiffness_n_m": p["GK"],
            "progression_per_m": 0.0,
            "warming_n_k": 0.0,
        }
    sign = 1.0 if p["GAS"] == 1 else -1.0
    return {
        "preload_n": sign * p["GP"] if zero else where,
        "stiffness_n_m": p["GP"] * p["GAV"] * p["GKAP"] if zero else where,
        "progression_per_m": f"{FORM}: exact for kappa = 1 only",
        "warming_n_k": 0.0,
    }


def _friction(p, case):
    own = {"friction_n": p["FRFC"], "presliding_m": p["FRFC"] / p["FRS0"], "breakaway": 0.0}
    own |= {"lag_s": 0.0, "swing": 0.0}
    if p["FR"] == 1:
        return own | {"slow_m_s": "nothing breaks away"}
    if p["FR"] == 3:
        return dict.fromkeys((*own, "slow_m_s"), f"{FORM}: tanh")
    length = f"{FORM}: LuGre's force of the bristles has its Stribeck curve in the length as well"
    return own | {
        "presliding_m": length,
        "breakaway": p["FRFS"] / p["FRFC"] - 1.0,
        "slow_m_s": p["FRVS"],
    }


def _viscous(p, case):
    at = REFERENCE_C - case["base"]["T0"]
    return {
        "damping_n_s_m": p["VC"] * math.exp(-p["VB"] * at),
        "thinning_per_k": p["VB"],
        "lag_s": 0.0,
        "easing_per_k": 0.0,
    }


def _quadratic(p, case):
    return {"coefficient_n_s2_m2": p["QC"], "lag_s": 0.0, "compression_change": p["QCC"] / p["QC"] - 1.0}


def _hysteresis(p, case):
    names = ("half_width_a", "share", "smoothness")
    if p["play_kind"] == 0:
        return dict(zip(names, (p["play_width"], 1.0, 0.0), strict=True))
    if p["play_kind"] == 1:
        return dict.fromkeys(names, f"{FORM}: three plays")
    share = 2.0 * p["play_width"] * p["play_rate"]
    if share > 1.0:
        return dict.fromkeys(names, f"{FORM}: after a reversal the field first goes on as before")
    return dict(zip(names, (p["play_width"], share, 1.0), strict=True))


def _heating(p, case):
    return {
        "heating_k_j": 1.0 / p["SHC"],
        "cooling_time_s": p["SHC"] / p["SHG"],
        "resistance_ohm": p["SHR"],
        "rise_at_start_k": p["leftover"],
    }


def _end_stop(p, case):
    own = {"force_at_1mm_n": p["EK"] * 1e-3 ** p["EN"], "exponent": p["EN"], "lag_s": 0.0}
    own["damping_n_s_m"] = 0.0 if p["ECV"] == 0 else f"{FORM}: it sets in over another depth"
    if p["ESIDE"]:
        one = "one stop only: it stands at middle + clearance"
        return own | {"clearance_m": one, "middle_m": one, "compression_change": one}
    zero = case["sensors"]["has_displacement"]
    return own | {
        "compression_change": 0.0,
        "clearance_m": p["EXS"],
        "middle_m": 0.0 if zero else "the stroke's zero was not measured",
    }


def _cavitation(p, case):
    if p["CAV"] == 3:
        names = (q.name for q in effects()["cavitation"].parameters)
        return dict.fromkeys(names, f"{FORM}: onset with compression speed")
    own = {"limit_n": p["CFL"], "rise_per_m": 0.0, "warming_per_k": 0.0, "lag_s": 0.0}
    own |= {"swing": "nothing lags", "firming_per_m": "no cavity holds", "slack": "no cavity holds"}
    own |= {"most_m": "no largest size"}
    if p["CAV"] == 2:
        return own | {
            "refilled": 0.0,
            "filling_per_s": 0.0,
            "by_flow": 0.0,
            "knee_n": f"{FORM}: sharp",
            "loss": 0.85,
            "closing_m": p["CQ"],
            "turning": 1.0,
            "held": 0.0,
            "leak_m_s": 0.0,
        }
    return own | {
        "knee_n": f"{FORM}: soft all over",  # both approach the limit
        "loss": 0.0,
        "closing_m": "no cavity, nothing to close",
        "turning": "no cavity, nothing to lose",
        "refilled": "no cavity, nothing to fill",
        "filling_per_s": "no cavity, nothing to fill",
        "by_flow": "no cavity to open",
        "held": "no cavity, nothing to hold",
        "leak_m_s": "no cavity, nothing to close",
    }


def _stroke(p, case):
    names = ("slope_per_m", "curvature_per_m2", "levelling_per_m2", "centre_m", "flatness", "tail")
    if p["ST"] != 1:
        return dict.fromkeys(names, f"{FORM}: {'tanh taper' if p['ST'] == 2 else 'bypass groove'}")
    if not case["sensors"]["has_displacement"]:
        return dict.fromkeys(names, "the stroke's zero was not measured")
    bend = p["SA"] / p["SX"] ** 2
    middle = 1.0 + bend * p["SX0"] ** 2  # the factor at x = 0, which f takes
    straight = -2.0 * bend * p["SX0"] / middle
    level = "it does not level off, so has no tail"
    return dict(zip(names, (straight, bend / middle, 0.0, 0.0, 1.0, level), strict=True))


def _preyield(p, case):
    names = ("share", "plastic", "rounded", "sharp", "flow_s_m", "held", "knee")
    parts = dict.fromkeys(names, f"{FORM}: what of g saturates may be told in more than one way")
    if p["PY"] == 1 or case["base"]["GT"] == 0:  # of the springs before what flows, one along a tanh
        creep = 0.0 if p["PY"] == 1 else 1.0
        return parts | {"yield_length_m": 1.0 / p["PK"], "compliance_m_n": 0.0, "creep": creep}
    other = f"{FORM}: what flows behind the spring has another curve"
    return dict.fromkeys(("yield_length_m", "compliance_m_n", "creep", *names), other)


COMPARED = {
    "gas_spring": _gas_spring,
    "fluid_inertia": lambda p, _: {"mass_kg": p["MASS"], "lag_s": 0.0},
    "coulomb_friction": _friction,
    "viscous_damping": _viscous,
    "quadratic_damping": _quadratic,
    "force_offset": lambda p, _: {"offset_n": p["OFF"]},
    "current_lag": lambda p, _: {
        "rise_time_s": p["lag_up"],
        "fall_time_s": p["lag_down"],
        "saturation_per_a": 0.0,
    },
    "magnetic_hysteresis": _hysteresis,
    "self_heating": _heating,
    "end_stop": _end_stop,
    "cavitation": _cavitation,
    "stroke_dependent_damping": _stroke,
    "off_state_backbone": lambda _, __: dict.fromkeys(
        ("low_speed_change", "growth_s_m", "knee_m_s", "fade_current_a", "power", "compression_change"), FORM
    ),
    "rebound_asymmetry": lambda _, __: dict.fromkeys(
        (
            "compression_change",
            "compression_change_per_a",
            "bend_per_a",
            "compression_change_per_a2",
            "sharpness",
            "compression_change_last_per_a",
        ),
        f"{FORM}: tanh(i); what does not change with the current is also g's",
    ),
    "preyield_stiffness": _preyield,
    # The generator has H before the mount, mrctl after: its delay times the stiffness is damping here.
    "mount_compliance": lambda p, _: {
        "compliance_m_n": 1.0 / p["MK"],
        "damping_n_s_m": f"{FORM}: H stands before the mount",
        "hardening_per_m2": 0.0,
        "lag_inside": f"{FORM}: H stands before the mount",
        "arm": 0.0,
        "creep_s": "nothing creeps",
        "lag_split": f"{FORM}: H stands before the mount",
    },
    "sensor_delay": lambda p, _: {"delay_s": p["delay"]},
}


def truth_of(name, case):
    """Our parameters of an effect as the generator drew them: numbers, or why there is none."""
    given = COMPARED[name](case["parameters"][name], case)
    expected = {p.name for p in effects()[name].parameters}
    if set(given) != expected:
        raise ValueError(f"{name}: compared {sorted(given)}, parameters are {sorted(expected)}")
    return given


def compared(case, answer):
    """(effect, parameter, true, value, interval, why not) of a single effect that was found exactly."""
    (name,) = case["effects"]
    rows = []
    for parameter, true in truth_of(name, case).items():
        value = answer["parameters"][name][parameter]
        interval = answer["intervals"][name][parameter]
        why = true if isinstance(true, str) else None
        if why is None and interval is None:
            why = "held: it has no interval"
        rows.append((name, parameter, None if isinstance(true, str) else true, value, interval, why))
    return rows


def comparable_cases(R, C):
    """Single effects of the generator's own dampers, found exactly."""
    return [
        k
        for k, c in C.items()
        if c["family"] != "H"
        and len(c["effects"]) == 1
        and not c["odd"]
        and R[k]["verdict"] == "found"
        and R[k]["effects"] == c["effects"]
    ]


def table(R, C):
    """Print errors and coverage by parameter and pooled, for each command that states parameters."""
    keys = comparable_cases(R, C)
    for source, words in (("", "diagnose"), ("extended", "extend")):
        answers = {k: answer for k in keys if (answer := R[k].get(source) if source else R[k])}
        kept = {
            k: answer for k, answer in answers.items() if set(C[k]["effects"]) <= set(answer["parameters"])
        }
        if kept:
            _print({k: compared(C[k], answer) for k, answer in kept.items()}, C, words)
        for k in answers.keys() - kept.keys():
            print(f"  {k}: `{words}` does not keep {C[k]['effects'][0]}")


def _print(rows, C, words):
    print(f"\nparameters as `{words}` states them: single effects found exactly, n = {len(rows)}")
    print(f"  {'effect.parameter':<48}{'n':>4}{'median |error|':>16}{'covered by 95 %':>17}")
    by, left = defaultdict(list), defaultdict(list)
    for k, own in rows.items():
        for name, parameter, true, value, interval, why in own:
            if why is not None:
                left[f"{name}.{parameter}", why].append(k)
            else:
                by[f"{name}.{parameter}"].append((true, value, interval))
    for what in sorted(by):
        _line(what, by[what])
    pooled = [one for own in by.values() for one in own]
    _line("all", pooled)
    _line("all, but for those that are truly zero", [one for one in pooled if one[0]])
    alone = 100 * noise_alone(pooled)
    print(f"  {'of these, what noise alone leaves by their intervals':<52}{alone:>15.2f} %")
    if left:
        print("  not comparable:")
    for (what, why), keys in sorted(left.items()):
        print(f"    {what:<46}{len(keys):>4}  {why}")
    outside = [
        (
            f"{k} {C[k]['family']}{C[k]['index']:<3} {name}.{parameter}",
            C[k]["forms"][name],
            true,
            value,
            interval,
        )
        for k, own in rows.items()
        for name, parameter, true, value, interval, why in own
        if why is None and not _covers(interval, true)
    ]
    if outside:
        print("  outside their interval:")
    for where, form, true, value, (low, high) in outside:
        off = abs(value - true) / (0.5 * (high - low)) if high > low else math.inf
        print(
            f"    {where}: true {true:.5g}, stated {value:.5g} ({low:.5g} to {high:.5g}), "
            f"{off:.1f} half widths off; {form}"
        )


def noise_alone(own):
    """The median error of (true, value, interval) whose values scatter just as their 95 % intervals say."""
    normal = NormalDist()
    half = normal.inv_cdf(0.975)
    draws = [abs(normal.inv_cdf((k + 0.5) / 200)) for k in range(200)]
    spreads = [(high - low) / (2 * half * abs(true)) for true, _, (low, high) in own if true]
    return float(np.median(np.outer(spreads, draws))) if spreads else math.nan


def _covers(interval, true):
    slack = 1e-9 * max(abs(true), 1e-12)  # a truth on the bound that the interval was cut at
    return interval[0] - slack <= true <= interval[1] + slack


def _line(what, own):
    errors = [abs(value - true) / abs(true) for true, value, _ in own if true]
    cover = sum(_covers(interval, true) for true, _, interval in own)
    error = f"{100 * np.median(errors):.2f} %" if errors else "truly 0"
    if own:
        print(f"  {what:<48}{len(own):>4}{error:>16}{100 * cover / len(own):>15.0f} %")
