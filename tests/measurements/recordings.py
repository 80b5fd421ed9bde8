"""One known run in every binary format, as the tools of the field write it."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import scipy.io
from asammdf import MDF, Signal
from motions import damper_force, sine

from mrctl.can.codec import make_encoder
from mrctl.can.database import load_database
from mrctl.can.quiet_import import can
from mrctl.share_path import share_file

MOTION = sine(rate=1000)
FORCE = damper_force(MOTION)
CAN_MAP = """
schema: mrctl/columns/1
dbc: mrctl.dbc
signals:
  velocity_m_s: RelVel_FL
  displacement_m: Displacement.Disp_FL
  current_A: Cur_FL
  temperature_C: CaseTemp_FL
  force_N: Force_FL
"""


def channels() -> dict[str, np.ndarray]:
    n = len(MOTION.time_s)
    return {
        "time_s": MOTION.time_s,
        "velocity_m_s": MOTION.v,
        "current_A": np.full(n, 1.0),
        "temperature_C": np.full(n, 30.0),
        "force_N": FORCE,
    }


def write_mat(path: Path, variables: dict, *, hdf5: bool = False, version: str = "5") -> Path:
    if not hdf5:
        scipy.io.savemat(path, variables, format=version)
        return path
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            branch = value if isinstance(value, dict) else {"": value}
            for part, array in branch.items():
                file[f"{name}/{part}" if part else name] = np.atleast_2d(np.asarray(array, dtype=float)).T
    data = bytearray(path.read_bytes())
    data[:18] = b"MATLAB 7.3 MAT-fil"
    path.write_bytes(bytes(data))
    return path


def write_mdf(
    path: Path, units: dict[str, tuple[str, float]] | None = None, twice: tuple[str, ...] = ()
) -> Path:
    """MDF with each channel in a group of its own, at its own rate; `units` gives unit and factor of some."""
    with MDF(version="4.10") as file:
        for index, (name, values) in enumerate(channels().items()):
            if name == "time_s":
                continue
            unit, factor = (units or {}).get(name, ("", 1.0))
            step = (1, 2, 100, 500, 1)[index]
            signal = Signal(values[::step] * factor, MOTION.time_s[::step] + 5.0, unit=unit, name=name)
            for _ in range(2 if name in twice else 1):
                file.append([signal])
        file.save(path, overwrite=True)
    return path


def messages(seconds: float = 3.0, *, start: float = 1000.0, damage: bool = False) -> list[can.Message]:
    """A bus: velocity and force at 1 kHz, displacement at 500, current at 100, temperature at 2 Hz."""
    specs = load_database(share_file("dbc/mrctl.dbc"))
    values = {
        "RelativeVelocity": (MOTION.v, 1),
        "MeasuredForce": (FORCE, 1),
        "Displacement": (MOTION.x, 2),
        "CurrentCommand": (np.where(MOTION.time_s < 1.5, 1.0, 2.0), 10),
        "CaseTemperature": (np.full(len(MOTION.x), 41.5), 500),
    }
    encoders = {name: make_encoder(specs[name]) for name in values}
    result, counter = [], dict.fromkeys(values, 0)
    for tick in range(int(seconds * 1000)):
        for offset, (name, (signal, every)) in enumerate(values.items()):
            if tick % every:
                continue
            payload = bytearray(encoders[name]([signal[tick], 0.0, 0.0, -signal[tick]], counter[name]))
            counter[name] = (counter[name] + 1) % 16
            if damage and tick % 100 == 50:
                payload[3] ^= 0x10
            stamp = start + tick * 1e-3 + offset * 1e-4
            result.append(
                can.Message(
                    timestamp=stamp,
                    arbitration_id=specs[name].can_id,
                    data=bytes(payload),
                    is_extended_id=False,
                )
            )
    return result


def write_mf4_log(path: Path, frames: list[can.Message]) -> Path:
    """Bus logging as ASAM describes it: one group of channels CAN_DataFrame.*."""
    names = ["ID", "IDE", "BusChannel", "DataLength", "DataBytes"]
    samples = [
        np.array([frame.arbitration_id for frame in frames], dtype=np.uint32),
        np.zeros(len(frames), dtype=np.uint8),
        np.full(len(frames), 2, dtype=np.uint8),
        np.array([len(frame.data) for frame in frames], dtype=np.uint8),
        np.array([list(frame.data) for frame in frames], dtype=np.uint8),
    ]
    stamps = np.array([frame.timestamp for frame in frames])
    with MDF(version="4.10") as file:
        file.append(
            [Signal(s, stamps, name=f"CAN_DataFrame.{n}") for n, s in zip(names, samples, strict=True)]
        )
        file.save(path, overwrite=True)
    return path


def write_log(path: Path, frames: list[can.Message]) -> Path:
    """A log by python-can's writer for the extension."""
    if path.suffix == ".mf4":
        return write_mf4_log(path, frames)
    kind = {".log": "CanutilsLog", ".asc": "ASC", ".blf": "BLF", ".trc": "TRC"}[path.suffix]
    with getattr(can, kind + "Writer")(str(path)) as writer:
        for frame in frames:
            writer.on_message_received(frame)
    return path
