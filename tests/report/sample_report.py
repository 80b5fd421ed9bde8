"""A page that uses every part of the kit on plausible damper data, for the tests and for looking at."""

from __future__ import annotations

import numpy as np

from mrctl.report.bars import Bars, Reference, bar_plot, waterfall
from mrctl.report.heatmap import heat_map
from mrctl.report.page import Card, Page
from mrctl.report.plots import histogram, line_plot, loop_plot, panels_plot, small_multiples
from mrctl.report.quantity import format_interval
from mrctl.report.series import Mark, Panel, Series
from mrctl.report.tables import Cell

EFFECTS = [
    "viscous_damping", "gas_spring", "off_state_backbone", "coulomb_friction", "stroke_dependent_damping",
    "fluid_inertia", "magnetic_hysteresis", "sensor_delay",
]  # fmt: skip
CONTROLLERS = [
    "Passive, soft", "Passive, firm", "Skyhook, linear current map", "Skyhook, Reader inverse",
    "Liu, temperature-corrected", "Skyhook, inverse model",
]  # fmt: skip


def _force(v: np.ndarray, current: float, temperature: float, rng: np.random.Generator) -> np.ndarray:
    lagged = v - 0.012 * np.gradient(v, 1 / 2000.0)
    level = (120 + 620 * current - 60 * current**2) * (1 - 0.0022 * (temperature - 25))
    force: np.ndarray = level * np.tanh(lagged / 0.035) + 480 * v + rng.normal(0, 9, v.size)
    return force


def sample_page() -> Page:
    """The page; the same bytes each time."""
    rng = np.random.default_rng(7)
    page = Page(
        "Where the calibration fails, and what is missing",
        "`bench_2024.yaml` against 40 runs of the campaign `dyno/`, held out in five folds",
        command="mrctl diagnose bench_2024.yaml dyno/ --report report.html",
        inputs=[("bench_2024.yaml", "9f2b6c01d4e8a375"), ("dyno/ (40 files)", "77c0e1a94b2d6f18")],
    )
    _how_good(page, rng)
    _where(page, rng)
    _missing(page)
    _extended(page, rng)
    _loop(page, rng)
    return page


def _how_good(page: Page, rng: np.random.Generator) -> None:
    page.section("How good", "The error over all held-out runs, against the noise floor of the campaign.")
    page.key_figures(
        [
            ("Held-out error", "41.7 N", "RMSE, 3.4 % of peak"),
            ("Noise floor", "11.2 N", "cycle to cycle, 9 cycles"),
            ("Fit", "93.1 %", "pooled over 40 runs"),
            ("Removable", "92.8 %", "of the mean square error"),
        ]
    )
    t = np.arange(0, 8.4, 1 / 2000)
    v = 0.19 * np.sin(2 * np.pi * 2.387 * t) * np.clip(t / 0.8, 0, 1)
    measured = _force(v, 2.0, 55, rng)
    model = _force(v, 1.97, 58, np.random.default_rng(1)) * 0.96
    model[6000:6400] = np.nan
    current = np.where((t > 1) & (t < 7.5), 2.0, 0.0)
    temperature = 55 + 3 * (1 - np.exp(-t / 6))
    page.figure(
        panels_plot(
            "Run 27: 2.0 A, 55 °C",
            "Time (s)",
            [
                Panel(
                    "Force (N)",
                    [Series("measured", t, measured, colour="ink"), Series("model", t, model)],
                    [Mark(1.0, "coil on", "x"), Mark(3.0, "no model", "x", until=3.2, tone="warn")],
                ),
                Panel("Error (N)", [Series("error", t, measured - model, colour=1)], [Mark(0.0)], height=90),
                Panel("Current (A)", [Series("current", t, current, "step", colour=2)], height=60),
                Panel("Case temperature (°C)", [Series("temperature", t, temperature, colour=4)], height=60),
            ],
        ),
        "All 16 800 samples of each signal are in the drawing: every peak is kept.",
    )
    one = slice(8000, 8838)
    x = 0.0127 * np.cos(2 * np.pi * 2.387 * t)
    loops = [(i, _force(v[one], i, 55, rng)) for i in (0.0, 1.0, 2.0, 3.0)]
    page.pair(
        (
            loop_plot(
                "Force over velocity",
                "Velocity (m/s)",
                "Force (N)",
                [Series(f"{i:g} A", v[one], f) for i, f in loops],
            ),
            "One cycle each at 55 °C.",
        ),
        (
            loop_plot(
                "Force over stroke",
                "Stroke (mm)",
                "Force (N)",
                [Series(f"{i:g} A", 1000 * x[one], f) for i, f in loops],
            ),
            "",
        ),
    )
    with page.details("Every run"):
        page.table(
            ["File", "Current (A)", "Temperature (°C)", "RMSE (N)", "Fit (%)", "Status"],
            [
                [
                    f"dyno/cold/run_{k:02d}_1in_2.387Hz.csv",
                    float(k % 4),
                    29.0 + 9 * (k // 4),
                    20 + 31.7 * rng.random(),
                    90 + 9 * rng.random(),
                    Cell("clipped", tone="warn") if k == 5 else "sound",
                ]
                for k in range(8)
            ],
            "Runs of the campaign",
            best={3: "min", 4: "max"},
        )


def _where(page: Page, rng: np.random.Generator) -> None:
    page.section("Where it fails", "Worst conditions first; a cell needs at least 200 samples.")
    v_edges = np.linspace(-0.2, 0.2, 11)
    t_edges = np.linspace(25, 85, 7)
    rmse = 15 + 60 * np.exp(-((np.arange(10)[None, :] - 7) ** 2) / 6 - (np.arange(6)[:, None] - 5) ** 2 / 5)
    rmse = rmse + 4 * rng.random((6, 10))
    rmse[0, 0] = rmse[1, 0] = rmse[5, 9] = np.nan
    page.figure(
        heat_map(
            "Error by velocity and temperature",
            "Velocity (m/s)",
            "Case temperature (°C)",
            v_edges,
            t_edges,
            rmse,
            "RMSE (N)",
        ),
        "Hatched: fewer than 200 samples.",
    )
    bias = np.sin(np.arange(24)[None, :] / 4) * np.cos(np.arange(16)[:, None] / 5) * 38
    counts = np.eye(8) * 38 + rng.integers(0, 3, (8, 8))
    page.pair(
        (
            heat_map(
                "Mean residual",
                "Velocity (m/s)",
                "Stroke (mm)",
                np.linspace(-0.2, 0.2, 25),
                np.linspace(-12, 12, 17),
                bias,
                "Bias (N)",
                diverging=True,
                half=True,
            ),
            "Structure that no candidate explains.",
        ),
        (
            heat_map("Confusion", "Named", "True effect", EFFECTS, EFFECTS, counts, "Cases", half=True),
            "Forty hidden effects each.",
        ),
    )
    page.figure(
        small_multiples(
            "Error over velocity, by run",
            "Velocity (m/s)",
            [
                Panel(
                    "Error (N)",
                    [
                        Series(
                            "error",
                            v := np.sort(rng.uniform(-0.2, 0.2, 700)),
                            40 * np.tanh(v * 10) * k / 5 + rng.normal(0, 9, 700),
                            "dots",
                        ),
                        Series("mean", v[::50], 40 * np.tanh(v[::50] * 10) * k / 5, colour="ink"),
                    ],
                    title=f"Run {k}: {k % 4} A, {25 + 10 * k} °C",
                    zero=True,
                )
                for k in range(1, 7)
            ],
        )
    )
    page.figure(
        histogram(
            "Tick lateness",
            "Lateness (µs)",
            [("loaded", rng.gamma(2.0, 14.0, 20000)), ("idle", rng.gamma(2.0, 6.0, 20000))],
            marks=[Mark(100, "limit", "x", tone="bad")],
            y_log=True,
        )
    )


def _missing(page: Page) -> None:
    page.section("What is missing")
    page.cards(
        [
            Card(
                "viscous_damping",
                "found",
                "good",
                [
                    ("c25", format_interval(481.2, 462.9, 499.5, "N·s/m")),
                    ("slope", format_interval(-3.2, -3.9, -2.5, "N·s/m/K")),
                    ("Held-out error", "41.7 → 14.9 N"),
                ],
                "F += c(T) v\nc(T) = c25 (1 + a (T - 25))",
                "Significant at 1 %, family-wise over 17 candidates.",
            ),
            Card(
                "gas_spring",
                "ambiguous",
                "warn",
                [("k", "9.1 kN/m"), ("Rivals", "end_stop")],
                "F += k x + F0",
            ),
            Card(
                "end_stop", "not supported", "soft", text="The campaign never comes within 4 mm of the stop."
            ),
        ]
    )
    ranking = [(name, 14.9 + 4.2 * i, 88.0 - 11 * i) for i, name in enumerate(EFFECTS)]
    page.table(
        ["Effect", "Held-out RMSE (N)", "Removed (%)", "Significant", "Rivals"],
        [
            [n, r, p, Cell("yes", tone="good") if p > 60 else "no", "end_stop" if n == "gas_spring" else None]
            for n, r, p in ranking
        ],
        "Candidates, best first",
        best={1: "min"},
    )
    page.figure(
        bar_plot(
            "Held-out error after adding one effect",
            "RMSE (N)",
            [n for n, _, _ in ranking],
            [
                Bars(
                    "RMSE",
                    [r for _, r, _ in ranking],
                    [r * 0.93 for _, r, _ in ranking],
                    [r * 1.08 for _, r, _ in ranking],
                )
            ],
            references=[Reference(11.2, "noise floor 11.2 N"), Reference(41.7, "today 41.7 N")],
        )
    )


def _extended(page: Page, rng: np.random.Generator) -> None:
    page.section("What it becomes")
    page.figure(
        waterfall(
            "Held-out error, effect by effect",
            "RMSE (N)",
            [
                ("f·g·h with filter", 41.7),
                ("+ viscous_damping", 21.4),
                ("+ gas_spring", 15.2),
                ("+ friction", 12.6),
            ],
            floor=Reference(11.2, "noise floor 11.2 N"),
            unit="N",
        )
    )
    i = np.linspace(0, 3, 13)
    f = 120 + 620 * i - 60 * i**2
    page.pair(
        (
            line_plot(
                "Force level f(i)",
                "Current (A)",
                "Force (N)",
                [
                    Series("before", i, f * 0.95, colour="soft", dashed=True),
                    Series("after, 95 % band", i, f, low=f - 25, high=f + 25),
                    Series(
                        "backbone points",
                        np.repeat(i[::4], 5),
                        np.repeat(f[::4], 5) + rng.normal(0, 22, 20),
                        "dots",
                        colour=1,
                    ),
                ],
                half=True,
            ),
            "",
        ),
        (
            line_plot(
                "Filter",
                "Frequency (Hz)",
                "Gain",
                [
                    Series("mean FRF", w := np.geomspace(0.5, 200, 80), 1 / np.hypot(1, w / 30), "dots"),
                    Series("IIR, order 3", w, 1 / np.hypot(1, w / 30) ** 1.03, colour="ink"),
                ],
                x_log=True,
                y_log=True,
                marks=[Mark(20, "20 Hz", "x")],
                half=True,
            ),
            "",
        ),
    )
    page.section("What to measure next")
    page.paragraph(
        "Two runs would tell `gas_spring` from `end_stop`: **0 A, slow, full stroke**, 25 and 85 °C."
    )
    page.code("mrctl extend bench_2024.yaml dyno/ --effect viscous_damping -o bench_2025.yaml")


def _loop(page: Page, rng: np.random.Generator) -> None:
    page.section("Closed loop on the bus")
    tracking = [
        [38.1, 40.2, 43.9], [52.0, 49.5, 45.2], [9.2, 14.1, 21.7], [8.8, 11.5, 15.3],
        [7.9, 8.8, 10.1], [2.6, 2.8, 3.1],
    ]  # fmt: skip
    page.table(
        ["Controller", "25 °C", "55 °C", "85 °C", "Body accel. (m/s²)", "Tyre load (N)"],
        [
            [n, *e, 1.2 + 0.1 * k, 431.0 - 9 * k]
            for k, (n, e) in enumerate(zip(CONTROLLERS, tracking, strict=True))
        ],
        "Force-tracking error, % of peak (RMS), and ride on the same road",
        best={1: "min", 2: "min", 3: "min", 4: "min", 5: "min"},
    )
    page.figure(
        bar_plot(
            "Force-tracking error",
            "RMS error (% of peak)",
            CONTROLLERS,
            [Bars(f"{t} °C", [row[k] for row in tracking]) for k, t in enumerate((25, 55, 85))],
        )
    )
    t = np.arange(0, 30, 0.001)
    page.figure(
        line_plot(
            "Command against recorded command",
            "Time (s)",
            "Current (A)",
            [
                Series("recorded", t, 1 + np.cumsum(rng.normal(0, 0.02, t.size)), colour="soft"),
                Series("replayed", t, 1 + np.sin(t) * np.exp(-t / 20)),
            ],
            marks=[Mark(11.0, "LIMP", "x", until=14.0, tone="bad"), Mark(20.0, "bus-off", "x", tone="warn")],
        )
    )
