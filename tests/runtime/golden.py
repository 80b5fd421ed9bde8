"""The golden run: frames of every kind into the tick, and the commands that left when it was recorded.

    PYTHONPATH=tests python tests/runtime/golden.py     records tests/runtime/golden/*.txt anew

To be recorded anew only when the controller is meant to command something else.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from model.dampers import magneride, tables
from runtime.bench import Sender, plan

from mrctl.control.laws import make_law
from mrctl.control.maps import make_current_map
from mrctl.runtime.tick import Tick

FOLDER = Path(__file__).parent / "golden"
HEALTH_ID = 1024
SWITCHING = dataclasses.replace(magneride(), static=tables(off_below=0.5, on_above=0.5))
UNREFINED = dataclasses.replace(magneride(), refine_cutoff_hz=None)

# Name: law, damper, anticipation in s, ticks.
RUNS = {
    "continuous": ("skyhook_continuous", magneride(), 0.006, 2000),
    "switching": ("skyhook_no_jerk", SWITCHING, 0.0, 1000),
    "two_state": ("skyhook_two_state", UNREFINED, 0.006, 1000),
    "liu": ("liu", magneride(), 0.0, 1000),
}

# Relative velocities: corner, value, first and last tick of each second.
FAULTY_VALUES = (
    (0, math.nan, 200, 202),  # not available, shorter than the time-out
    (1, math.nan, 230, 259),  # and longer
    (2, 2.04, 270, 271),  # out of range
    (3, -1.9, 280, 280),  # an implausible jump
)


def golden_tick(name: str) -> Tick:
    """The tick of a golden run, before its first step."""
    law, damper, anticipation_s, _ = RUNS[name]
    whole = plan()
    return Tick(
        dataclasses.replace(
            whole,
            corners=tuple(
                dataclasses.replace(
                    corner,
                    law=make_law(law),
                    make_map=lambda dt: make_current_map("inverse", damper, dt),
                    anticipation_s=anticipation_s,
                )
                for corner in whole.corners
            ),
        )
    )


def drive(name: str):
    """Tick by tick: the frames and the periods since the last tick. A rough road with every fault on it."""
    sender = Sender()
    for n in range(RUNS[name][3]):
        t, phase = n / 500.0, n % 500
        velocity = [
            0.25 * math.sin(9.0 * t + k) + 0.15 * math.sin(71.0 * t * (1 + 0.1 * k)) for k in range(4)
        ]
        for corner, value, first, last in FAULTY_VALUES:
            if first <= phase <= last:
                velocity[corner] = value
        body = [0.3 * math.sin(7.0 * t + 2 * k) for k in range(4)]
        frames = [sender.frame("RelativeVelocity", velocity), sender.frame("BodyVelocity", body)]
        if n % 50 == 0:
            frames.append(sender.frame("CaseTemperature", [25.0 + k + 20.0 * t for k in range(4)]))
        yield with_faulty_frames(frames, phase), {480: 2, 484: 3, 490: 60}.get(phase, 1)


def with_faulty_frames(frames, phase):
    """The frames of a tick, some of them spoilt or gone."""
    can_id, data = frames[0]
    if 300 <= phase < 340:  # body velocity gone for longer than its time-out
        frames.pop(1)
    if phase in {350, 352, 353}:  # CRC wrong
        frames[0] = can_id, bytes([data[0] ^ 0x10, *data[1:]])
    if phase == 360:  # repeated, remote, too short, foreign
        frames += [frames[0], (can_id | 0x40000000, b""), (can_id, data[:5]), (0x7FF, data)]
    return [] if 400 <= phase < 470 else frames


def commands(name: str) -> list[str]:
    """What left in each tick of a golden run: identifier and payload in hex, the health frame left out."""
    tick, ticks = golden_tick(name), RUNS[name][3]
    lines = []
    for n, (frames, periods) in enumerate(drive(name)):
        if n == ticks - 60:
            tick.shut_down()
        out = [frame for frame in tick.step(frames, periods) if frame[0] != HEALTH_ID]
        lines.append(" ".join(f"{can_id:03X}#{data.hex().upper()}" for can_id, data in out))
    return lines


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name in RUNS:
        (FOLDER / f"{name}.txt").write_text("\n".join(commands(name)) + "\n", encoding="ascii")
