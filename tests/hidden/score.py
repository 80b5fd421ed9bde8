"""What a diagnosis is worth: its answers beside what was hidden, as tables.

Answers: {case: {"verdict": none|found|ambiguous|unexplained, "effects": [...], "seconds": x,
"parameters": {...}}}
Outcomes, one per case:
  exact         verdict and names as they should be (found = the true set; none on null; unexplained outside;
                ambiguous with the truth in a set of <= 2 where the campaign cannot tell)
  accepted      an answer listed in also_acceptable, or the single true name where more doubt was due
  in_set        ambiguous, at most 2 names (3 for pairs), the truth among them, though the campaign could tell
  wide_set      ambiguous, larger set with the truth in it
  partial       pairs only: found, some true names, no wrong one
  missed        none or unexplained though an effect was there, or the gate refused the files
  wrong         a found name that is not true, or an ambiguous set without the truth
  false         null or outside data: names given
  unexplained_on_null
Detectability d = visible RMS / noise RMS on measured inputs * sqrt(effective rows); below about 10 nobody
could.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict

import numpy as np

ORDER = [
    "exact",
    "accepted",
    "in_set",
    "wide_set",
    "partial",
    "missed",
    "wrong",
    "false",
    "unexplained_on_null",
]


def judge(c, r):
    v, got, true = r.get("verdict", "none"), set(r.get("effects") or []), set(c["effects"])
    exp = c["expected"]
    fam = c["family"]
    if v == "refused":
        return "missed"
    if fam == "H":
        native = set(c["native"])
        if got - true - native:
            return "wrong"
        if v == "found":
            return "exact" if true <= got else "partial"
        if v == "ambiguous":
            return "in_set" if true & got or not true else "partial"
        return "missed"
    if exp["verdict"] == "unexplained":
        if v == "unexplained":
            return "exact"
        return "false" if got and v in ("found", "ambiguous") else "missed"
    if exp["verdict"] == "none":
        if v == "none":
            return "exact"
        if v == "unexplained":
            return "unexplained_on_null"
        if v == "found" and sorted(got) in [sorted(q) for q in c["also_acceptable"]]:
            return "accepted"
        if v == "found" and true and got == true:
            return "accepted"
        return "false"
    if exp["verdict"] == "ambiguous":
        if v == "ambiguous" and true <= got:
            return "exact" if len(got) <= 2 else "wide_set"
        if v == "found" and got == true:
            return "accepted"
        return "missed" if v in ("none", "unexplained") else "wrong"
    if v == "found" and got == true:
        return "exact"
    if v in ("none", "found") and sorted(got) in [sorted(q) for q in c["also_acceptable"]]:
        return "accepted"
    if v == "found":
        if got and got < true:
            return "partial"
        return "wrong"
    if v == "ambiguous":
        if len(true) == 1:
            if true <= got:
                return "in_set" if len(got) <= 2 else "wide_set"
            return "wrong"
        if true & got:
            return "in_set" if len(got) <= 3 else "wide_set"
        return "wrong"
    return "missed"


def table(R, C, *, each=False):
    """Print the tables for answers R to the cases C; `each`: one line per case, with its parameters."""
    out = {k: judge(c, R[k]) for k, c in C.items()}
    fams = sorted({c["family"] for c in C.values()})
    print(
        "\noutcome per family\n"
        + "family".ljust(8)
        + "n".rjust(4)
        + "".join(o.rjust(max(9, len(o) + 1)) for o in ORDER)
    )
    for f in [*fams, "all"]:
        ks = [k for k in C if f in ("all", C[k]["family"])]
        n = Counter(out[k] for k in ks)
        print(
            f.ljust(8)
            + str(len(ks)).rjust(4)
            + "".join(str(n[o] or ".").rjust(max(9, len(o) + 1)) for o in ORDER)
        )
    print(
        "\nverdict per family\nfamily"
        + "".join(v.rjust(13) for v in ("none", "found", "ambiguous", "unexplained"))
    )
    for f in fams:
        n = Counter(R[k].get("verdict") for k in C if C[k]["family"] == f)
        print(
            f.ljust(6) + "".join(str(n[v]).rjust(13) for v in ("none", "found", "ambiguous", "unexplained"))
        )
    with_eff = [
        k for k in C if C[k]["effects"] and C[k]["expected"]["verdict"] == "found" and C[k]["family"] != "H"
    ]
    null = [k for k in C if C[k]["expected"]["verdict"] == "none" and not C[k]["effects"]]
    outside = [k for k in C if C[k]["expected"]["verdict"] == "unexplained"]
    conf = [k for k in C if C[k]["expected"]["verdict"] == "ambiguous"]

    def pct(ks, *kinds):
        return f"{100 * sum(out[k] in kinds for k in ks) / max(1, len(ks)):5.1f} % of {len(ks)}"

    det = [k for k in with_eff if min(C[k]["detectability"].values()) >= 10]
    print(f"""
exact, cases with effects            {pct(with_eff, "exact")}
  among the detectable (d >= 10)     {pct(det, "exact")}
in a set of <= 2 (or accepted)       {pct(with_eff, "in_set", "accepted")}
wider set                            {pct(with_eff, "wide_set")}
partial (pairs)                      {pct(with_eff, "partial")}
missed                               {pct(with_eff, "missed")}
wrong names                          {pct(with_eff, "wrong")}
false findings on null               {pct(null, "false")}
unexplained on null                  {pct(null, "unexplained_on_null")}
unexplained, outside the library     {pct(outside, "exact")}
names given, outside the library     {pct(outside, "false")}
ambiguous with the truth, confounded {pct(conf, "exact")}
  one true name claimed              {pct(conf, "accepted")}
  wrong                              {pct(conf, "wrong")}""")
    sec = [R[k].get("seconds") for k in C if R[k].get("seconds") is not None]
    if sec:
        print(f"seconds: median {np.median(sec):.1f}, 90 % {np.quantile(sec, 0.9):.1f}, max {max(sec):.1f}")
    print("\nby detectability d (single effects)")
    for lo, hi in ((0, 10), (10, 30), (30, 100), (100, 1e9)):
        ks = [
            k
            for k in with_eff
            if len(C[k]["effects"]) == 1 and lo <= C[k]["detectability"][C[k]["effects"][0]] < hi
        ]
        if ks:
            named = ", ".join(f"{word} {pct(ks, word)}" for word in ("exact", "missed", "wrong"))
            print(f"  {lo:>4} to {hi if hi < 1e8 else 'inf':>4}: {named}")
    print("\nconfusion, single effects with rich data (A, F, G): truth -> answers")
    conf_m = defaultdict(Counter)
    for k, c in C.items():
        if c["family"] in "AFGB" and len(c["effects"]) <= 1:
            t = c["effects"][0] if c["effects"] else "(null)"
            v = R[k].get("verdict")
            e = sorted(R[k].get("effects") or [])
            conf_m[t][
                ("" if v == "found" else "?") + "+".join(e) if e and v in ("found", "ambiguous") else f"({v})"
            ] += 1
    for t in sorted(conf_m):
        print("  " + t.ljust(26) + ", ".join(f"{n}x {w}" for w, n in conf_m[t].most_common()))
    print("  (? before names: ambiguous set)")
    if each:
        print()
        for k, c in sorted(C.items(), key=lambda q: (q[1]["family"], q[1]["index"])):
            r = R[k]
            d = {e: round(float(q)) for e, q in c.get("detectability", {}).items()}
            made = {e: round(q, 1) for e, q in c["contribution_rms_n"].items()}
            print(
                f"{k} {c['family']}{c['index']:<3}{out[k]:<20}{'+'.join(c['effects']) or c['odd'] or '-'} -> "
                f"{r.get('verdict')} {'+'.join(r.get('effects') or [])}  d={d or ''} "
                f"noise {c['noise_rms_n']:.1f} contribution {made} {c['note']}"
            )
            if each and c["parameters"]:
                print(
                    "      truth",
                    json.dumps(c["parameters"]),
                    "\n      given",
                    json.dumps(r.get("parameters")),
                )
    return out
