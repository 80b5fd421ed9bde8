"""Runs the protocols on the virtual damper: a campaign in memory, or as a folder of CSV files."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrctl.errors import InputError
from mrctl.measurements import Campaign, RawRun, Run, assemble, write_run_csv
from mrctl.model.baselines.bouc_wen import SPENCER_1997, BoucWen
from mrctl.model.damper import Damper, EffectSetting
from mrctl.model.effects.registry import effect
from mrctl.plant.dyno.current import LARGEST_A
from mrctl.plant.dyno.damper import DynoStates, simulate
from mrctl.plant.dyno.parameters import MAGNERIDE_LIKE, DynoDamper
from mrctl.plant.dyno.protocols import PROTOCOLS, Drive, Protocol
from mrctl.plant.dyno.sensors import FORCE_NOISE_N, bench_sensors
from mrctl.plant.spencer import LARGEST_V, simulate_bouc_wen
from mrctl.simulate.run import Run as SimulatedRun
from mrctl.simulate.trace import trace

Array = NDArray[np.float64]

DAMPERS: dict[str, DynoDamper | BoucWen] = {"magneride": MAGNERIDE_LIKE, "spencer": SPENCER_1997}


@dataclass(frozen=True, slots=True, eq=False)
class DynoRun:
    """A run as measured, what drove it, and what truly happened in the damper."""

    run: Run
    drive: Drive
    truth: DynoStates


@dataclass(frozen=True, slots=True)
class Bench:
    """A damper on the dyno. The same seed gives the same campaign; `noise_n` is the load cell's RMS.

    Spencer's damper is commanded by a voltage, which stands in the place of the current: drives from 0 to 3 A
    become 0 to 2.25 V. It knows no temperature. A calibration's damper is that calibration's model to the
    letter, with its effects, and does not warm up unless one of them says so.
    """

    damper: DynoDamper | BoucWen | Damper = MAGNERIDE_LIKE
    seed: int = 1
    noise_n: float = FORCE_NOISE_N

    def drives(self, protocol: str, rate_hz: float | None = None) -> Sequence[Drive]:
        """What the protocol will do. Raises InputError for a protocol that does not exist."""
        chosen = _protocol(protocol)
        random = np.random.default_rng([self.seed, *chosen.name.encode()])
        return list(chosen.make(rate_hz or chosen.rate_hz, random))

    def measure(self, drive: Drive, number: int = 0) -> DynoRun:
        """One run of a drive; `number` tells runs of the same name apart in their noise."""
        truth = self._states(drive)
        random = np.random.default_rng([self.seed, number, *drive.name.encode()])
        sensors = bench_sensors(self.noise_n)
        channels = {
            "time_s": np.arange(len(drive.motion)) / drive.rate_hz,
            "velocity_m_s": sensors.velocity_m_s.read(drive.motion.velocity_m_s, random),
            "current_a": self._command(drive),
            "temperature_c": sensors.temperature_c.read(truth.case_temperature_c, random),
            "force_n": sensors.force_n.read(truth.force_n, random),
        }
        return DynoRun(assemble(RawRun(drive.name, Path(f"{drive.name}.csv"), channels)), drive, truth)

    def _command(self, drive: Drive) -> Array:
        if isinstance(self.damper, BoucWen):
            return np.round(drive.current_a * (LARGEST_V / LARGEST_A), 6)
        return drive.current_a

    def _states(self, drive: Drive) -> DynoStates:
        moving = drive.motion
        if isinstance(self.damper, DynoDamper):
            return simulate(
                self.damper,
                drive.rate_hz,
                moving.displacement_m,
                moving.velocity_m_s,
                drive.current_a,
                drive.temperature_c,
                drive.air_c,
            )
        command = self._command(drive)
        warm = np.full(len(moving), drive.temperature_c)
        if isinstance(self.damper, Damper):
            signals = (moving.velocity_m_s, command, warm, moving.displacement_m)
            seen = trace(SimulatedRun.of(1.0 / drive.rate_hz, *signals), self.damper)
            return DynoStates(seen.force_n, seen.current_a, seen.temperature_c, warm)
        force = simulate_bouc_wen(
            self.damper, drive.rate_hz, moving.displacement_m, moving.velocity_m_s, command
        )
        return DynoStates(force, command, warm, warm)

    def runs(self, protocol: str, rate_hz: float | None = None) -> Iterator[DynoRun]:
        """Every run of a protocol, one at a time."""
        for number, drive in enumerate(self.drives(protocol, rate_hz)):
            yield self.measure(drive, number)

    def campaign(self, protocol: str, rate_hz: float | None = None) -> Campaign:
        """The measured runs of a protocol, as they would be read from a folder."""
        runs = tuple(item.run for item in self.runs(protocol, rate_hz))
        digest = hashlib.sha256()
        for run in runs:
            digest.update(run.name.encode() + run.force_n.tobytes())
        return Campaign(Path(f"dyno-{protocol}"), runs, digest.hexdigest())


def with_typical(damper: Damper, names: Sequence[str]) -> Damper:
    """The damper with these effects too, each at its typical size. Raises EffectError for unknown ones."""
    added = tuple(EffectSetting(e.name, e.mapping(e.typical)) for e in map(effect, names))
    return replace(damper, effects=damper.effects + added)


def write_campaign(
    bench: Bench,
    protocol: str,
    folder: Path,
    rate_hz: float | None = None,
    done: Callable[[str], None] = lambda _: None,
) -> list[DynoRun]:
    """Write a protocol's runs as CSV files into a folder without any; `done` gets each name.

    Raises InputError for an unknown protocol, and for a folder that holds CSV files already: with them the
    campaign would be another one.
    """
    drives = bench.drives(protocol, rate_hz)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        others = sorted(folder.rglob("*.csv"))
    except OSError as error:
        raise InputError.at(
            folder, f"cannot be a folder ({error.strerror or error})", "name another place"
        ) from None
    if others:
        raise InputError.at(
            folder, f"holds {len(others)} CSV files already, {others[0].name} first", "name a new folder"
        )
    written = []
    for number, drive in enumerate(drives):
        item = bench.measure(drive, number)
        write_run_csv(item.run, folder / f"{drive.name}.csv")
        written.append(item)
        done(drive.name)
    return written


def _protocol(name: str) -> Protocol:
    try:
        return PROTOCOLS[name]
    except KeyError:
        raise InputError.at(
            "--protocol", f"there is no protocol {name!r}", f"take one of {', '.join(PROTOCOLS)}"
        ) from None
