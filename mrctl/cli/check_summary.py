"""What `mrctl check` says of a sound file: figures for JSON, and the same figures as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mrctl.calibration import Calibration, cascade_error
from mrctl.can.busload import LIMIT, BusLoad, FrameRate, bus_load
from mrctl.can.database import load_database
from mrctl.config import Config
from mrctl.control.laws import LAWS
from mrctl.control.maps import CURRENT_MAPS
from mrctl.model.damper import Span
from mrctl.model.filters import Filter
from mrctl.printable import printable
from mrctl.report.terminal import table

# Where a DBC says nothing of the bus it is for.
_DBC_BITRATE = 500_000


def calibration_summary(calibration: Calibration) -> dict[str, Any]:
    """Name, ranges, limits, poles, and how far forward times inverse filter is from 1."""
    damper, static = calibration.damper, calibration.damper.static
    gain_db, phase_deg = cascade_error(damper.forward_filter, damper.inverse_filter)
    return {
        "name": calibration.name,
        "source": calibration.provenance.source,
        "created": calibration.provenance.created,
        "sha256": calibration.sha256,
        "force_n": [static.force_n[0], static.force_n[-1]],
        "current_max_a": damper.current_max_a,
        "current_slew_a_s": damper.current_slew_a_s,
        "valid": {
            "velocity_m_s": _pair(damper.velocity_valid_m_s),
            "temperature_c": _pair(damper.temperature_valid_c),
            "current_a": _pair(damper.current_valid_a),
        },
        "h_hottest": {
            "temperature_c": static.temperature_c[-1],
            "off": static.h_off[-1],
            "on": static.h_on[-1],
        },
        "forward_filter": _filter(damper.forward_filter),
        "inverse_filter": _filter(damper.inverse_filter),
        "cascade_error": {"upper_hz": 20.0, "gain_db": gain_db, "phase_deg": phase_deg},
        "effects": [effect.name for effect in damper.effects],
    }


def config_summary(config: Config) -> dict[str, Any]:
    """Bus, loop, law, dampers with their calibrations, and the worst-case load of the bus."""
    return {
        "interface": config.bus.interface,
        "channel": config.bus.channel,
        "database": str(config.database),
        "rate_hz": config.loop.rate_hz,
        "law": config.control.law,
        "current_map": config.control.current_map,
        "dampers": {
            name: {
                "calibration": str(damper.calibration),
                "calibration_name": config.calibrations[name].name,
                "signals": dict(damper.signals),
                "command": damper.command,
            }
            for name, damper in config.dampers.items()
        },
        "bus_load": _load(
            config.bus_load, config.bus.bitrate, config.bus.data_bitrate, config.bus.load_limit
        ),
    }


def dbc_summary(path: Path) -> dict[str, Any]:
    """Frames, and the load of a classic bus if all were sent at their cycle times; raises InputError."""
    specs = load_database(path)
    rates = [
        FrameRate(spec.name, spec.length, spec.extended, 1.0 / spec.cycle_s)
        for spec in specs.values()
        if spec.cycle_s and spec.length <= 8
    ]
    return {
        "frames": {
            spec.name: {
                "id": spec.can_id,
                "extended": spec.extended,
                "bytes": spec.length,
                "cycle_s": spec.cycle_s,
                "signals": [signal.name for signal in spec.signals],
            }
            for spec in specs.values()
        },
        "bus_load": _load(bus_load(rates, _DBC_BITRATE), _DBC_BITRATE, None, LIMIT),
    }


def summary_text(kind: str, summary: dict[str, Any]) -> str:
    """The summary of a calibration, config or dbc as indented lines."""
    lines = {"calibration": _calibration_lines, "config": _config_lines, "dbc": _dbc_lines}[kind](summary)
    return "\n".join(f"  {line}" for line in lines)


def _calibration_lines(s: dict[str, Any]) -> list[str]:
    cascade, (soft, firm), hot = s["cascade_error"], s["force_n"], s["h_hottest"]
    valid = (_range(s["valid"][key]) for key in ("velocity_m_s", "temperature_c", "current_a"))
    lines = [f"{printable(s['name'])}, {s['created']}"]
    lines += [f"force       {soft:g} N without current to {firm:g} N, at the nominal temperature"]
    lines += [f"            at {hot['temperature_c']:.3g} degC {hot['off']:.3g} of it, on {hot['on']:.3g}"]
    lines += [f"limits      {s['current_max_a']:g} A, {s['current_slew_a_s']:g} A/s"]
    lines += ["valid       {} m/s, {} degC, {} A".format(*valid)]
    for key in ("forward", "inverse"):
        one = s[f"{key}_filter"]
        lines += [f"{key:<11} {one['sample_rate_hz']:g} Hz, poles {_poles(one['poles'])}"]
    error = f"{cascade['gain_db']:.2f} dB and {cascade['phase_deg']:.1f} degrees"
    lines += [f"cascade     forward times inverse is 1 within {error} up to {cascade['upper_hz']:g} Hz"]
    return [*lines, f"effects     {', '.join(s['effects']) or 'none'}"]


def _config_lines(s: dict[str, Any]) -> list[str]:
    by_calibration: dict[str, list[str]] = {}
    for name, damper in s["dampers"].items():
        by_calibration.setdefault(f"{damper['calibration']} ({damper['calibration_name']})", []).append(name)
    return [
        f"bus         {s['channel']} ({s['interface']}), {s['database']}",
        f"loop        {s['rate_hz']:g} Hz",
        f"law         {s['law']}: {LAWS[s['law']].summary}",
        f"map         {s['current_map']}: {CURRENT_MAPS[s['current_map']].summary}",
        *(f"dampers     {', '.join(names)}: {calibration}" for calibration, names in by_calibration.items()),
        *_load_lines(s["bus_load"]),
    ]


def _dbc_lines(s: dict[str, Any]) -> list[str]:
    headers = ("frame", "ID", "bytes", "signals", "every ms", "load")
    loads = {f["name"]: f"{100.0 * f['fraction']:.2f} %" for f in s["bus_load"]["frames"]}
    rows = [
        (
            name,
            f"0x{frame['id']:X}" + ("x" if frame["extended"] else ""),
            str(frame["bytes"]),
            str(len(frame["signals"])),
            f"{1000.0 * frame['cycle_s']:g}" if frame["cycle_s"] else "-",
            loads.get(name, "-"),
        )
        for name, frame in s["frames"].items()
    ]
    return [_load_line(s["bus_load"], "if all were sent"), *table(headers, rows, align="llrrrr").splitlines()]


def _load_lines(load: dict[str, Any]) -> list[str]:
    """The bus load in total against its limit, and frame by frame."""
    headers = ("frame", "Hz", "µs", "load")
    rows = [
        (f["name"], f"{f['rate_hz']:g}", f"{1e6 * f['duration_s']:.0f}", f"{100.0 * f['fraction']:.2f} %")
        for f in load["frames"]
    ]
    return [_load_line(load), *(f"  {line}" for line in table(headers, rows, align="lrrr").splitlines())]


def _load_line(load: dict[str, Any], condition: str = "at worst") -> str:
    speed = f"{load['bitrate'] / 1000:g} kbit/s"
    if load["data_bitrate"]:
        speed += f" and {load['data_bitrate'] / 1000:g} kbit/s (CAN FD)"
    return (
        f"bus load    {100.0 * load['total']:.1f} % of {speed} {condition}; limit {100.0 * load['limit']:g} %"
    )


def _load(load: BusLoad, bitrate: int, data_bitrate: int | None, limit: float) -> dict[str, Any]:
    return {
        "bitrate": bitrate,
        "data_bitrate": data_bitrate,
        "limit": limit,
        "total": load.total,
        "frames": [
            {"name": f.name, "rate_hz": f.rate_hz, "duration_s": f.duration_s, "fraction": f.fraction}
            for f in load.frames
        ],
    }


def _pair(span: Span) -> list[float]:
    return [span.low, span.high]


def _filter(f: Filter) -> dict[str, Any]:
    poles = sorted(f.poles(), key=lambda p: (p.real, p.imag))
    return {"sample_rate_hz": f.sample_rate_hz, "poles": [[float(p.real), float(p.imag)] for p in poles]}


def _range(pair: list[float]) -> str:
    return f"{pair[0]:.3g} to {pair[1]:.3g}"


def _poles(poles: list[list[float]]) -> str:
    """Poles as text, a conjugate pair as one."""
    shown = [
        f"{real:.4f}" if imag == 0.0 else f"{real:.4f} ± {imag:.4f}j" for real, imag in poles if imag >= 0.0
    ]
    return ", ".join(shown) or "none"
