"""The sections of the diagnosis' reports, in the order of the user's question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.conditions import VARIABLES, spectrum, worst_conditions
from mrctl.discover.diagnose import Diagnosis
from mrctl.discover.fits.signals import UNITS
from mrctl.discover.reports.figures import explained_percent
from mrctl.discover.reports.fitted import root
from mrctl.discover.verdict.structure import Map
from mrctl.identify.joint_fit import JointFit
from mrctl.identify.records import Record
from mrctl.measurements.run import Campaign
from mrctl.model.effects.registry import effects
from mrctl.report.bars import Bars, Reference, bar_plot, waterfall
from mrctl.report.heatmap import heat_map
from mrctl.report.page import Card, Page
from mrctl.report.plots import line_plot, loop_plot, panels_plot
from mrctl.report.quantity import format_interval, format_quantity, unit_text
from mrctl.report.series import Panel, Series
from mrctl.report.svg import Figure
from mrctl.report.theme import Tone

Array = NDArray[np.float64]
Figures = Mapping[str, Any]

SHOWN_S = 3.0
NAMED = 4  # runs left out; a page is no list of files
TONES: dict[str, Tone] = {"none": "good", "found": "good", "ambiguous": "warn", "unexplained": "bad"}
TITLES = {
    "none": "Nothing is missing",
    "found": "Found",
    "ambiguous": "Not decided by this campaign",
    "unexplained": "Not explained",
}
RESIDUAL = "Measured − model (N)"
FORCE = "Force (N)"


def how_good(page: Page, d: Diagnosis, figures: Figures) -> None:
    """The verdict and the few numbers that matter."""
    page.section("How good is the model", figures["words"])
    page.key_figures(
        [
            ("Verdict", d.verdict, ", ".join(d.effects) or "no effect named"),
            ("Without", format_quantity(figures["rmse_n"], "N"), "error held out, base model"),
            ("With", format_quantity(figures["rmse_after_n"], "N"), "held out, with what was found"),
            ("Noise", format_quantity(figures["noise_estimate_n"], "N"), d.balance.how),
        ]
    )


def where_it_fails(page: Page, fit: JointFit, records: Sequence[Record], campaign: Campaign) -> None:
    """The base model's worst conditions, in words."""
    page.section(
        "Where it fails",
        "The base model fitted to these runs as well as it can be; conditions with errors significantly "
        "above the average.",
    )
    model = fit.model.on(records)
    runs = [campaign.runs[r.run] for r in records]
    errors = [e[:: r.finer] for r, e in zip(records, model.errors(fit.theta), strict=True)]
    worst = worst_conditions(runs, errors)
    if worst:
        page.table(
            ["condition", "RMSE N", "bias N"],
            [[c.words[:1].upper() + c.words[1:], c.rmse_n, c.bias_n] for c in worst[:12]],
            "Worst first",
        )
    else:
        page.paragraph(f"Nowhere significantly worse than on average, by {len(VARIABLES)} variables.")


def what_is_missing(page: Page, d: Diagnosis, figures: Figures) -> None:
    """The verdict's card, the candidates on theirs, and how they compare."""
    page.section("What is missing")
    cards = [
        Card(
            TITLES[d.verdict],
            d.verdict,
            TONES[d.verdict],
            [("explained", f"{explained_percent(d):.0f} % of what can be removed")] if d.found else [],
        )
    ]
    named = {one["effect"]: one for one in figures["found"]}
    cards += [_candidate(entry, named.get(entry["effect"])) for entry in figures["ranking"]]
    page.cards(cards)
    if figures["ranking"]:
        ranking = figures["ranking"]
        page.figure(
            bar_plot(
                "Held-out error with one effect added",
                "RMSE (N)",
                ["base model alone", *(f"+ {e['effect']}" if e["beside"] else e["effect"] for e in ranking)],
                [Bars("held out", [figures["rmse_n"], *(e["rmse_n"] for e in ranking)])],
                references=[Reference(figures["noise_estimate_n"], "noise")],
            ),
            "Base and effect are fitted together; what counts is the error on data left out of the fit."
            + " With a plus: beside the effects found above it." * any(e["beside"] for e in ranking),
        )
    told = figures["structure"]["courses"]
    if told:
        page.table(
            ["a force that", "takes of what the base leaves, %", "to see it by itself"],
            [[course["force"], course["explained_percent"], course["measure"]] for course in told],
            "Courses that no effect in the library has",
        )
    _maps(page, d)


def _candidate(entry: Figures, found: Figures | None) -> Card:
    name = entry["effect"]
    values = parameter_values(name, entry["parameters"])
    values += [(key, format_quantity(p["value"], p["unit"])) for key, p in entry["derived"].items()]
    beside = f"beside {', '.join(entry['beside'])}" if entry["beside"] else "by itself"
    values.append(("removes", f"{entry['removed_percent']:.1f} % {beside}"))
    rivals = (found or {}).get("rivals", [])
    words = "; ".join(f"rival {r['effect']}: {r['why']}" for r in rivals)
    badge, tone = ("belongs in", "good") if found and not rivals else ("not decided", "warn")
    if not found:
        badge, tone = ("helps alone", "soft") if entry["significant"] else ("not supported", "soft")
    return Card(name, badge, tone, values, entry["equation"], words)  # type: ignore[arg-type]


def parameter_values(name: str, parameters: Mapping[str, Figures]) -> list[tuple[str, str]]:
    """An effect's parameters as a card shows them: with intervals, or where they were held or at a bound.

    Those that are as if they were not there, and were not moved, are left away.
    """
    values = []
    for known in effects()[name].parameters:
        p = parameters.get(known.name)
        if p is None:
            continue
        if p["ci95"] is not None:
            values.append((known.name, format_interval(p["value"], p["ci95"][0], p["ci95"][1], p["unit"])))
        elif p["value"] != known.neutral:
            at = ", at its bound" if p["value"] in {known.low, known.high} else ", not moved by this data"
            values.append((known.name, format_quantity(p["value"], p["unit"]) + at))
    return values


def _maps(page: Page, d: Diagnosis) -> None:
    shown = [m for m in d.left.maps if m.explained_n2 > 0.0 and len(m.signals) > 1][:2]
    if d.verdict != "unexplained" or not shown:
        return
    page.paragraph("What is left is no noise: over these signals it keeps its course from run to run.")
    for one in shown:
        page.figure(_map(one), f"This map alone predicts {root(one.explained_n2):.3g} N of it, held out.")


def _map(one: Map) -> Any:  # noqa: ANN401 - the kit's figure
    first, second = one.signals
    labels = [f"{s[:1].upper()}{s[1:]} ({unit_text(UNITS[s])})" for s in one.signals]
    title = f"What is left by {first} and {second}"
    x, y = one.edges
    return heat_map(title, labels[0], labels[1], x, y, one.mean_n, RESIDUAL, diverging=True)


def what_it_becomes(
    page: Page, steps: Sequence[tuple[Sequence[str], float]], floor: float | None, before: JointFit,
    after: JointFit, records: Sequence[Record], campaign: Campaign, left_out: Sequence[str] = (),
) -> None:  # fmt: skip
    """The held-out error falling, and the runs before and after.

    left_out: the runs that it is the error on; without names, parts of all runs were left out in turn.
    """
    page.section("What it becomes", "The held-out error step by step, and the runs with both models.")
    page.figure(
        falling_error(steps, floor),
        f"Each effect is fitted together with the base. {_held_out(left_out)}",
    )
    old, new = (f.model.on(records).predict(f.theta) for f in (before, after))
    errors = [_at_samples(r, y) for r, y in zip(records, old, strict=True)]
    order = np.argsort([-float(np.mean(error**2)) for error in errors])
    chosen = dict.fromkeys([int(order[0]), int(order[len(order) // 2])])
    spectra = []
    for k in chosen:
        _run(page, records[k], campaign.runs[records[k].run].name, old[k], new[k])
        for label, y, colour in (("before", old[k], 1), ("after", new[k], 0)):
            f, density = spectrum(_at_samples(records[k], y), records[k].rate_hz / records[k].finer)
            keep = (f > 0.0) & (density > 0.0)
            if k == int(order[0]):
                spectra.append(Series(label, f[keep], np.sqrt(density[keep]), colour=colour))
    page.figure(
        line_plot("What is left, by frequency", "Frequency (Hz)", "N/√Hz", spectra, x_log=True, y_log=True),
        "The run with the largest error before. White noise is level.",
    )


def _held_out(names: Sequence[str]) -> str:
    if not names:
        return "Parts of all runs were left out of the fits in turn, and the error is that on them."
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"The error is that on runs that no fit here has seen: {', '.join(names[:NAMED])}{more}."


def falling_error(steps: Sequence[tuple[Sequence[str], float]], floor: float | None) -> Figure:
    """The error on what was left out, effect by effect, down to the noise; in N."""
    befores = [None, *(names for names, _ in steps)]
    labels = [(_step(names, before), rmse) for (names, rmse), before in zip(steps, befores, strict=False)]
    reference = Reference(floor, "noise") if floor is not None else None
    return waterfall("Held-out error", "RMSE (N)", labels, floor=reference, unit="N")


def _step(names: Sequence[str], before: Sequence[str] | None) -> str:
    if before is None:
        return ", ".join(names) or "base model"
    less, more = ([n for n in one if n not in other] for one, other in ((before, names), (names, before)))
    return " ".join([f"- {', '.join(less)}"] * bool(less) + [f"+ {', '.join(more)}"] * bool(more))


def _at_samples(record: Record, modelled_n: Array) -> Array:
    """Measured less modelled force at the samples measured: what is between them has no noise of its own."""
    return np.asarray((record.force_n - modelled_n)[:: record.finer])


def _run(page: Page, record: Record, name: str, old: Array, new: Array) -> None:
    n = min(len(record), round(SHOWN_S * record.rate_hz))
    begin = (len(record) - n) // 2
    part = slice(begin, begin + n)
    time = np.arange(len(record))[part] / record.rate_hz
    force = record.force_n[part]
    errors = [
        Series("before", time, force - old[part], colour=1),
        Series("after", time, force - new[part], colour=0),
    ]
    page.figure(
        panels_plot(
            f"Before and after, {name}",
            "Time (s)",
            [
                Panel(FORCE, [Series("measured", time, force, colour="ink")], height=140),
                Panel(RESIDUAL, errors, height=140),
            ],
        ),
        f"`{name}`: {_rms(_at_samples(record, old)):.3g} N before, "
        f"{_rms(_at_samples(record, new)):.3g} N after.",
    )
    loops = []
    for label, x in (("Velocity (m/s)", record.velocity_m_s), ("Stroke (m)", record.displacement_m)):
        series = [
            Series("measured", x[part], force, colour="ink"),
            Series("before", x[part], old[part], colour=1),
            Series("after", x[part], new[part], colour=0),
        ]
        loops.append(
            (loop_plot(f"Force over {label.split(' (')[0].lower()}, {name}", label, FORCE, series), "")
        )
    page.pair(*loops)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))


def what_next(page: Page, figures: Figures) -> None:
    """The next run, and what this campaign cannot show."""
    page.section("What to measure next")
    run = figures["next_run"]
    courses = figures["structure"]["courses"]
    if run is None and courses:
        page.paragraph(f"To see by itself what no effect describes: {courses[0]['measure']}.")
    elif run is None:
        page.paragraph("No single run is called for by the rivals: there are none, or none would part them.")
    else:
        page.key_figures(
            [
                ("Motion", f"sine, {1e3 * run['amplitude_m']:.3g} mm", f"{run['frequency_hz']:.3g} Hz"),
                ("Current", run["current"], f"{run['seconds']:.0f} s"),
                ("Temperature", f"{run['temperature_c']:.0f} °C", ""),
                ("Separation", f"{run['separation_sigma']:.0f} σ", "between the rivals, all else adapted"),
            ]
        )
        page.paragraph(run["why"][:1].upper() + run["why"][1:] + ".")
    if figures["cannot_reveal"]:
        page.table(
            ["effect", "why this campaign cannot show it"],
            [[name, why] for name, why in figures["cannot_reveal"].items()],
        )


def all_looks(page: Page, d: Diagnosis) -> None:
    """Every candidate's first look."""
    with page.details(f"All {len(d.first.looks)} candidates as first looked at"):
        page.table(
            ["effect", "share of the weighed square sum it would take, %"],
            [
                [
                    look.effect.name,
                    100.0 * max(look.gain, 0.0) / d.first.whole,  # none of it takes nothing
                ]
                for look in d.first.looks
            ],
        )
