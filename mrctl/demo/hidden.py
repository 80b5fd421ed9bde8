"""The demonstration's second part: a damper with something in it that its model does not know.

The dyno measures it, `discover` gets the CSV files only, and what it finds goes into a calibration; then both
models' inverses ask the damper for the same force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from mrctl.config import Config, load_config
from mrctl.demo.bus import BusRun, run_on_bus
from mrctl.model.damper import Damper
from mrctl.model.pipeline import ForwardPipeline, InversePipeline
from mrctl.yaml_source.writer import write_atomically

Array = NDArray[np.float64]
Report = Callable[[float, str], None]

HIDDEN = "gas_spring"
PROTOCOL, RATE_HZ, NOISE_N = "steps", 500.0, 5.0
RUNS = (0, 5, 7)  # of the protocol's: each frequency and each temperature once
TRACKED_S, TRACKED_C = 4.0, 45.0
BUS_SECONDS = 2.0
STROKE = "Disp_"  # of the DBC's signals, before the damper's own letters


@dataclass(frozen=True)
class Story:
    """What was hidden, what was found, and what that is good for; errors are RMS in N."""

    hidden: str
    found: tuple[str, ...]
    verdict: str
    steps: tuple[tuple[tuple[str, ...], float], ...]  # effects in the model, error on what it has not seen
    campaign: Path
    config: Path
    report: Path
    tracking_before_n: float
    tracking_after_n: float
    bus: BusRun  # four such dampers, commanded with what was found

    def lines(self) -> list[str]:
        """The story for the terminal."""
        falls = " -> ".join(f"{rmse:.1f} N" for _, rmse in self.steps)
        before_n, after_n = self.tracking_before_n, self.tracking_after_n
        sent, refused = self.bus.frames_from_controller, self.bus.rejected
        found = ", ".join(self.found) or "nothing"
        return [
            f"A damper with a hidden {self.hidden}, from its CSV files: found {found}.",
            f"Held-out error {falls}; the noise is {NOISE_N:g} N.",
            f"Asked for a force it misses by {before_n:.0f} N, with what was found by {after_n:.0f} N.",
            f"Four such dampers on the bus: {sent} frames sent, {refused} refused; as in {self.config}.",
            f"report: {self.report}",
        ]


def can_be_told() -> bool:
    """Whether the desk's libraries are installed."""
    return all(find_spec(name) is not None for name in ("numba", "scipy"))


def tell(config: Config, folder: Path, report: Report) -> Story:
    """Measure, discover, command.

    Writes campaign/, found.yaml, found.html, falling_error.svg and vehicle.yaml into the folder.
    """
    # Here, since who has no desk installed runs the rest of the demonstration.
    from mrctl.calibration import load_calibration  # noqa: PLC0415
    from mrctl.discover.discover import discover  # noqa: PLC0415
    from mrctl.discover.extended_calibration import write_extended  # noqa: PLC0415
    from mrctl.discover.reports.discover_report import write_discovery  # noqa: PLC0415
    from mrctl.discover.reports.figures import diagnosis_figures  # noqa: PLC0415
    from mrctl.discover.reports.report_parts import falling_error  # noqa: PLC0415
    from mrctl.identify.finish import damper_of  # noqa: PLC0415
    from mrctl.measurements import load_campaign, write_run_csv  # noqa: PLC0415
    from mrctl.plant.dyno.campaign import Bench, with_typical  # noqa: PLC0415

    known = next(iter(config.calibrations.values())).damper
    damper = with_typical(replace(known, effects=()), [HIDDEN])
    bench = Bench(damper, noise_n=NOISE_N)
    runs = folder / "campaign"
    runs.mkdir(parents=True, exist_ok=True)
    drives = bench.drives(PROTOCOL, RATE_HZ)
    for number in RUNS:
        write_run_csv(bench.measure(drives[number], number).run, runs / f"{drives[number].name}.csv")
    campaign = load_campaign(runs)
    result = discover(campaign, lambda share, what: report(0.9 * share, what))
    found, page = folder / "found.yaml", folder / "found.html"
    extension = result.extension
    write_extended(extension, "a damper with a secret", campaign, str(runs), str(found), "discover")
    told = diagnosis_figures(result.diagnosis)
    write_discovery(result, told, campaign, page, f"mrctl discover {runs} -o {found}")
    write_atomically(folder / "falling_error.svg", falling_error(extension.steps, NOISE_N).standalone())
    report(0.95, "commanding")
    better = load_calibration(found)
    extended = folder / "vehicle.yaml"
    write_atomically(extended, configured(config, found.name))
    steps = tuple((tuple(names), rmse) for names, rmse in extension.steps)
    return Story(
        HIDDEN,
        tuple(extension.effects),
        result.verdict,
        steps,
        runs,
        extended,
        page,
        missed_by(damper, damper_of(extension.base)),
        missed_by(damper, better.damper),
        run_on_bus(load_config(extended), BUS_SECONDS),
    )


def configured(config: Config, calibration: str) -> str:
    """The configuration with this calibration for all dampers, as YAML; the stroke comes over the bus too."""
    text = yaml.safe_load(config.path.read_text(encoding="utf-8"))
    text |= {"calibration": calibration, "database": str(config.database.resolve())}
    for damper in text["dampers"].values():
        damper.pop("calibration", None)
        damper["signals"]["displacement"] = STROKE + damper["signals"]["relative_velocity"].rpartition("_")[2]
    rates = text["frames"]["receive"]
    rates["Displacement"] = rates["RelativeVelocity"]
    return yaml.safe_dump(text, sort_keys=False, allow_unicode=True)


def missed_by(damper: Damper, model: Damper) -> float:
    """RMS in N between a force that the damper can make and what it makes when this model asks for it."""
    dt_s = 1.0 / RATE_HZ
    t = np.arange(0.0, TRACKED_S, dt_s)
    pulse = 2.0 * np.pi * 2.0
    x, v = 0.02 * np.sin(pulse * t), 0.02 * pulse * np.cos(pulse * t)
    current = 1.2 + 0.6 * np.sin(2.0 * np.pi * 0.7 * t)
    wish = _driven(damper, dt_s, x, v, current.tolist().__getitem__)
    inverse = InversePipeline(model, dt_s)
    inverse.reset(float(wish[0]), float(current[0]))
    made = _driven(damper, dt_s, x, v, lambda n: inverse.step(wish[n], v[n], TRACKED_C, x[n]))
    settled = t > 0.5
    return float(np.sqrt(np.mean((made - wish)[settled] ** 2)))


def _driven(damper: Damper, dt_s: float, x: Array, v: Array, current: Callable[[int], float]) -> Array:
    forward = ForwardPipeline(damper, dt_s)
    forward.settle(v[0], current(0), TRACKED_C, x[0])
    return np.array([forward.step(v[n], current(n), TRACKED_C, x[n]) for n in range(x.size)])
