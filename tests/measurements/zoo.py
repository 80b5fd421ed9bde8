"""A zoo of broken campaigns: each defect that benches, exports and people make, one a folder."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from motions import HEADER, csv_text, rows, sine, write_csv

MAT_MAGIC = b"MATLAB 5.0 MAT-file" + bytes(200)


@dataclass(frozen=True)
class Animal:
    """A broken campaign: how it is made, and what is said: `refused` in one line, `read` with a note."""

    name: str
    make: Callable[[Path], None]
    refused: str | None = None
    read: str | None = None
    warned: str | None = None


def table(**options) -> np.ndarray:
    return rows(sine(**options))


def _text(change: Callable[[str], str | bytes]) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        data = change(csv_text(rows()))
        (folder / "run.csv").write_bytes(data if isinstance(data, bytes) else data.encode())

    return make


def _array(change: Callable[[np.ndarray], np.ndarray | None], header: str = HEADER) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        data = rows()
        changed = change(data)
        write_csv(folder / "run.csv", data if changed is None else changed, header=header)

    return make


def _column(index: int, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Path], None]:
    def apply(data: np.ndarray) -> None:
        data[:, index] = change(data[:, index])

    return _array(apply)


def _line(number: int, change: Callable[[str], str]) -> Callable[[Path], None]:
    def edit(text: str) -> str:
        lines = text.split("\n")
        lines[number - 1] = change(lines[number - 1])
        return "\n".join(lines)

    return _text(edit)


def _cell(row: int, column: int, value: str) -> Callable[[Path], None]:
    def edit(line: str) -> str:
        cells = line.split(",")
        cells[column] = value
        return ",".join(cells)

    return _line(row, edit)


def _million(folder: Path) -> None:
    tail = [line.split(",", 1)[1] for line in csv_text(rows(sine(1.0, 2.0, 5000))).split()[1:]]
    body = "\n".join([f"{k / 5000:.4f},{tail[k % 10_000]}" for k in range(1_000_000)])
    (folder / "run.csv").write_text(f"{HEADER}\n{body}\n")


def _loop(folder: Path) -> None:
    write_csv(folder / "run.csv")
    (folder / "again").symlink_to(folder)
    (folder / "self").symlink_to("self")


def _unreadable(folder: Path) -> None:
    path = write_csv(folder / "run.csv")
    path.unlink()
    os.mkfifo(folder / "pipe")
    (folder / "run.csv").symlink_to("/proc/self/mem")


def _stuck(values: np.ndarray) -> np.ndarray:
    values[800:900] = values[800]
    return values


def _still(folder: Path) -> None:
    data = rows()
    step = data[1, 0]
    rest = np.tile([0.0, 0.0, 1.0, 30.0, 30.0], (3000, 1))
    rest[:, 0] = np.arange(3000) * step
    rest[:, 1] = 1e-3 * np.random.default_rng(0).standard_normal(3000)
    data[:, 0] += 3.0
    write_csv(folder / "run.csv", np.vstack((rest, data)))


def _disagree(folder: Path, factor: float) -> None:
    motion = sine()
    data = np.column_stack((rows(motion), factor * motion.x))
    write_csv(folder / "run.csv", data, header=HEADER + ",displacement_m")


def _delayed(data: np.ndarray) -> None:
    data[:, 4] = np.roll(data[:, 4], 25)


ZOO = (
    Animal("empty file", _text(lambda _: ""), refused="is empty"),
    Animal("blank lines only", _text(lambda _: "\n\n \n"), refused="is empty"),
    Animal("header only", _text(lambda _: HEADER + "\n"), refused="run.csv:1: has a header but no rows"),
    Animal("one row", _text(lambda t: "\n".join(t.split("\n")[:2])), refused="has only 1 row"),
    Animal("forty rows", _text(lambda t: "\n".join(t.split("\n")[:41])), refused="too short: 40 rows"),
    Animal("binary", _text(lambda _: bytes(range(256)) * 40), refused="is not text"),
    Animal("MATLAB file named csv", _text(lambda _: MAT_MAGIC), refused="is a MATLAB file"),
    Animal("Excel workbook named csv", _text(lambda _: b"PK\x03\x04" + bytes(99)), refused="Excel workbook"),
    Animal("a million rows", _million, read=""),
    Animal("UTF-16", _text(lambda t: t.encode("utf-16")), read="read as utf-16"),
    Animal("broken UTF-16", _text(lambda t: t.encode("utf-16")[:-1]), refused="is not utf-16 as it claims"),
    Animal("Latin-1", _text(lambda t: ("# °C\n" + t).encode("latin-1")), read="read as latin-1"),
    Animal("Windows line ends", _text(lambda t: t.replace("\n", "\r\n")), read=""),
    Animal("decimal commas", _text(lambda t: t.replace(",", ";").replace(".", ",")), read="decimal commas"),
    Animal(
        "commas for both",
        _text(lambda t: t.replace(".", ",").replace("e,", "e.")),
        refused="cells where 5 are due",
    ),
    Animal("semicolons", _text(lambda t: t.replace(",", ";")), read="separated by semicolon"),
    Animal(
        "duplicate columns", _array(lambda d: d, HEADER.replace("force_N", "time_s")), refused="there twice"
    ),
    Animal("missing column", _array(lambda d: d[:, :4], HEADER[:-8]), refused="a column is missing: force_N"),
    Animal(
        "no header", _text(lambda t: t.split("\n", 1)[1]), refused="run.csv:1: the first row holds numbers"
    ),
    Animal("foreign names", _array(lambda d: d, "t,v,i,T,F"), refused="no known column name in the header"),
    Animal("Python number", _cell(17, 4, "1_0"), refused="run.csv:17: force_N is not a number: '1_0'"),
    Animal("text in a number", _cell(17, 4, "n/a"), refused="run.csv:17: force_N is not a number: 'n/a'"),
    Animal("empty cell", _cell(99, 1, ""), refused="run.csv:99: velocity_m_s is empty"),
    Animal(
        "mixed lengths", _line(50, lambda s: s + ",1,2"), refused="run.csv:50: the row has 7 cells where 5"
    ),
    Animal("cut at the end", _text(lambda t: t[:-20]), refused="the last row looks cut off"),
    Animal("NaN", _cell(300, 4, "NaN"), refused="run.csv:300: force_N is NaN"),
    Animal("infinite", _cell(300, 1, "-inf"), refused="run.csv:300: velocity_m_s is infinite"),
    Animal("time backwards", _column(0, lambda t: np.where(t > 2, t - 1, t)), refused="time goes backwards"),
    Animal("time repeats", _cell(300, 0, "0.297"), refused="run.csv:300: time stands still at 0.297 s"),
    Animal("a gap", _array(lambda d: np.delete(d, np.s_[500:900], axis=0)), refused="run.csv:502: a gap"),
    Animal("lost samples", _array(lambda d: np.delete(d, [50, 51], axis=0)), read="interpolated"),
    Animal("time in ms", _column(0, lambda t: 1e3 * t), refused="time_s steps by 1 s a row: is it in ms?"),
    Animal("clipped force", _column(4, lambda f: np.clip(f, -900, 900)), refused="force_N looks clipped"),
    Animal(
        "clipped velocity", _column(1, lambda v: np.clip(v, -0.15, 9)), refused="velocity_m_s looks clipped"
    ),
    Animal("flipped sign", _column(4, lambda f: -f), refused="is the sign flipped?"),
    Animal("velocity in mm/s", _column(1, lambda v: 1e3 * v), refused="is it in mm/s?"),
    Animal("velocity in in/s", _column(1, lambda v: 39.37 * v), refused="mm/s or in/s?"),
    Animal("degF", _column(3, lambda _: 180.0), refused="temperature_C reaches 180: is it in degF?"),
    Animal("kelvin", _column(3, lambda _: 303.0), refused="is it in kelvin?"),
    Animal("kN", _column(4, lambda f: 1e-3 * f), refused="is it in kN?"),
    Animal("mA", _column(2, lambda i: 1e3 * i), refused="current_A reaches 1000: is it in mA?"),
    Animal("negative current", _column(2, lambda i: -i), refused="current_A is negative"),
    Animal("stuck load cell", _column(4, _stuck), refused="force_N is stuck at"),
    Animal("no load cell", _column(4, lambda f: 0 * f), refused="force_N is zero throughout"),
    Animal("no motion", _column(1, lambda v: 0 * v), refused="no motion"),
    Animal(
        "noise for motion",
        _column(1, lambda v: np.random.default_rng(5).normal(0, 0.1, len(v))),
        refused="noise only",
    ),
    Animal(
        "sampled too slowly",
        lambda p: write_csv(p / "run.csv", table(cycles=40, rate=12)),
        refused="sample rate is too low",
    ),
    Animal("silent stretch", _still, warned="no motion in rows 2 to"),
    Animal("displacement in mm", lambda p: _disagree(p, 1e3), refused="displacement_m spans 22.86"),
    Animal("displacement in cm", lambda p: _disagree(p, 1e2), refused="is it in mm?"),
    Animal(
        "displacement in inches",
        lambda p: _disagree(p, 39.37),
        refused="39.37 times what velocity_m_s adds up to: is",
    ),
    Animal(
        "displacement turned round",
        lambda p: _disagree(p, -1.0),
        refused="displacement_m and velocity_m_s have opposite",
    ),
    Animal("delayed force", _array(_delayed), warned="force lags velocity by"),
    Animal(
        "no csv",
        lambda p: (p / "run.txt").write_text("1 2 3"),
        refused="no CSV, MAT or MDF file in this folder",
    ),
    Animal("empty folder", lambda _: None, refused="no CSV, MAT or MDF file in this folder; check the path"),
    Animal("symlink loop", _loop, warned="a link to a folder that is read already"),
    Animal("unreadable", _unreadable, refused="cannot be read"),
    Animal(
        "the same run twice",
        lambda p: [write_csv(p / n) for n in ("a.csv", "b.csv")],
        warned="the same measurement as a.csv",
    ),
)
