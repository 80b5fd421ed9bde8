"""From a configuration to a tick plan: names resolved in the DBC, rates turned into ticks."""

from __future__ import annotations

from mrctl.can.database import load_database
from mrctl.can.dbc_file import DbcFile
from mrctl.can.frames import OPTIONAL_FRAMES_OUT, STATE_SIGNALS, signals_of
from mrctl.can.specs import FrameSpec
from mrctl.config import Config
from mrctl.control.laws import LAWS, make_law
from mrctl.control.maps import make_current_map, signals_of_effects
from mrctl.errors import InputError
from mrctl.model.damper import Damper
from mrctl.runtime.channel import ChannelRules
from mrctl.runtime.corner import CornerPlan
from mrctl.runtime.tick import TickPlan

# A signal that feeds (damper index, role) pairs.
Users = list[tuple[int, str]]


def plan_of(config: Config) -> TickPlan:
    """The plan of the tick for a loaded configuration.

    Raises InputError when the DBC does not have what the configuration names.
    """
    inputs, outputs = input_signals(config), frame_specs(config)
    rate_hz, send = config.loop.rate_hz, config.frames.send
    return TickPlan(
        dt_s=1.0 / rate_hz,
        corners=tuple(_corner(config, name) for name in config.dampers),
        rules={
            role: ChannelRules(
                rules.timeout_ms / 1000.0,
                rules.minimum,
                rules.maximum,
                rules.rate_max,
                None if rules.limp_after_ms is None else rules.limp_after_ms / 1000.0,
                None if rules.frozen_after_ms is None else rules.frozen_after_ms / 1000.0,
            )
            for role, rules in config.signals.items()
        },
        start_values={"temperature": config.safety.nominal_temperature_c},
        frames_in=inputs,
        command=outputs["CurrentCommand"],
        command_every=round(rate_hz / send["CurrentCommand"]),
        state=outputs["ControllerState"],
        state_every=round(rate_hz / send["ControllerState"]),
        health=outputs["Health"],
        health_every=round(rate_hz / send["Health"]),
        figures=tuple(
            (outputs[name], round(rate_hz / send[name])) for name in OPTIONAL_FRAMES_OUT if name in outputs
        ),
        good_frames=config.safety.reentry_good_frames,
        init_timeout_s=config.safety.init_timeout_s,
        bus_silent_off_s=config.safety.bus_silent_off_s,
    )


def frame_specs(config: Config) -> dict[str, FrameSpec]:
    """The frames that the controller sends, their signals in the order of the dampers."""
    commands = [damper.command for damper in config.dampers.values()]
    # The state signals carry the same suffix as the damper's command: Cur_FL, State_FL.
    suffixes = [command.partition("_")[2] for command in commands]
    states = [f"{signal}_{suffix}" for signal in STATE_SIGNALS for suffix in suffixes]
    figures = [name for name in ("Health", *OPTIONAL_FRAMES_OUT) if name in config.frames.send]
    return load_database(
        config.database,
        {"CurrentCommand": commands, "ControllerState": states}
        | {name: signals_of(name, ()) for name in figures},
    )


def input_signals(config: Config) -> list[tuple[FrameSpec, list[Users]]]:
    """The frames that the controller reads, each with the users of its signals in the frame's order."""
    users: dict[str, Users] = {}
    for index, damper in enumerate(config.dampers.values()):
        for role, signal in damper.signals.items():
            users.setdefault(signal, []).append((index, role))
    # Only what is asked for: a car's DBC has frames that are none of ours, perhaps without protection.
    messages = DbcFile.read(config.database).messages()
    required = {
        frame: [signal.name for signal in messages[frame].signals if signal.name in users]
        for frame in config.frames.receive
    }
    specs = load_database(config.database, {frame: names for frame, names in required.items() if names})
    return [(spec, [users[signal.name] for signal in spec.signals]) for spec in specs.values()]


def damper_needs(config: Config, name: str) -> frozenset[str]:
    """The roles of the signals without which a damper is not ACTIVE."""
    needs = {"relative_velocity", "temperature", *LAWS[config.control.law].needs}
    if config.control.current_map == "inverse":
        needs |= signals_of_effects(config.calibrations[name].damper)
    if "body_velocity" in needs and "body_velocity" not in config.dampers[name].signals:
        needs.remove("body_velocity")
        needs.add("body_acceleration")
    return frozenset(needs)


def _corner(config: Config, name: str) -> CornerPlan:
    control, safety = config.control, config.safety
    damper: Damper = config.calibrations[name].damper
    needs = damper_needs(config, name)
    missing = sorted(needs - set(config.dampers[name].signals))
    if missing:
        raise InputError.at(
            config.path,
            f"damper {name} has no signal for {', '.join(missing)}, which its law or its effects need",
            "name one below signals",
        )
    return CornerPlan(
        name=name,
        law=make_law(control.law, control.parameters),
        substitute_law=make_law("passive", {"damping_n_s_m": safety.substitute_damping_n_s_m}),
        make_map=lambda dt_s: make_current_map(control.current_map, damper, dt_s, control.map_parameters),
        needs=needs,
        current_max_a=damper.current_max_a,
        slew_a_s=damper.current_slew_a_s,
        limp_current_a=safety.limp_current_a,
        off_ramp_s=safety.off_ramp_s,
        temperature_valid_c=damper.temperature_valid_c,
        anticipation_s=control.anticipation_ms / 1000.0,
        velocity_cutoff_hz=(
            config.body_velocity_from_acceleration.cutoff_hz if "body_acceleration" in needs else None
        ),
    )
