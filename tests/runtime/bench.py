"""A tick for four MagneRide-like dampers on the shipped DBC, and a sender of good frames to drive it."""

from __future__ import annotations

from model.dampers import magneride

from mrctl.can.codec import make_decoder, make_encoder
from mrctl.can.database import load_database
from mrctl.can.frames import State, signals_of
from mrctl.control.laws import make_law
from mrctl.control.maps import make_current_map
from mrctl.runtime.channel import ChannelRules
from mrctl.runtime.corner import CornerPlan
from mrctl.runtime.tick import Tick, TickPlan
from mrctl.share_path import share_file

DAMPERS = ("FL", "FR", "RL", "RR")
DAMPER = magneride()
RATE_HZ = 500.0
LIMP_A = 1.0
GOOD_FRAMES = 10
RULES = {
    "relative_velocity": ChannelRules(0.010, -2.0, 2.0, 1000.0, 0.050),
    "body_velocity": ChannelRules(0.050, -4.0, 4.0, 200.0, None),
    "temperature": ChannelRules(1.0, -40.0, 150.0, 20.0, None),
}
ROLES = {
    "RelativeVelocity": "relative_velocity",
    "BodyVelocity": "body_velocity",
    "CaseTemperature": "temperature",
}
FRAMES = {name: signals_of(name, DAMPERS) for name in (*ROLES, "CurrentCommand", "ControllerState", "Health")}
SPECS = load_database(share_file("dbc/mrctl.dbc"), FRAMES)


def plan(law="skyhook_continuous", current_map="inverse", rate_hz=RATE_HZ) -> TickPlan:
    corner = {
        "law": make_law(law),
        "substitute_law": make_law("passive"),
        "make_map": lambda dt: make_current_map(current_map, DAMPER, dt),
        "needs": frozenset(ROLES.values()),
        "current_max_a": DAMPER.current_max_a,
        "slew_a_s": DAMPER.current_slew_a_s,
        "limp_current_a": LIMP_A,
        "off_ramp_s": 0.2,
        "temperature_valid_c": DAMPER.temperature_valid_c,
        "anticipation_s": 0.0,
        "velocity_cutoff_hz": None,
    }
    return TickPlan(
        dt_s=1.0 / rate_hz,
        corners=tuple(CornerPlan(name=name, **corner) for name in DAMPERS),
        rules=RULES,
        start_values={"temperature": 40.0},
        frames_in=[(SPECS[name], [[(k, role)] for k in range(4)]) for name, role in ROLES.items()],
        command=SPECS["CurrentCommand"],
        command_every=1,
        state=SPECS["ControllerState"],
        state_every=10,
        health=SPECS["Health"],
        health_every=50,
        good_frames=GOOD_FRAMES,
        init_timeout_s=2.0,
        bus_silent_off_s=5.0,
    )


class Sender:
    """Encodes sensor frames as a car would, counters running."""

    def __init__(self):
        self._encode = {name: make_encoder(SPECS[name]) for name in ROLES}
        self._counter = dict.fromkeys(ROLES, 0)

    def frame(self, name, values):
        self._counter[name] += 1
        return SPECS[name].linux_id, self._encode[name](values, self._counter[name])

    def all(self, velocity=0.1, body=0.2, temperature=50.0):
        """One frame of each kind, the same value for all four dampers."""
        return [
            self.frame("RelativeVelocity", [velocity] * 4),
            self.frame("BodyVelocity", [body] * 4),
            self.frame("CaseTemperature", [temperature] * 4),
        ]


_decode_command = make_decoder(SPECS["CurrentCommand"])
_decode_state = make_decoder(SPECS["ControllerState"])


def currents(frames):
    """The four currents of the CurrentCommand frame among these, in A."""
    (data,) = [data for can_id, data in frames if can_id == SPECS["CurrentCommand"].linux_id]
    return _decode_command(data)


def active(tick: Tick, sender: Sender, ticks=GOOD_FRAMES + 2):
    """Drive the tick with good frames until it is ACTIVE."""
    for _ in range(ticks):
        out = tick.step(sender.all())
    assert [c.state for c in tick.corners] == [State.ACTIVE] * 4
    return out
