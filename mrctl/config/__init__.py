"""The configuration file: bus, dampers, control law, safety, and how often what is sent."""

from __future__ import annotations

from mrctl.config.config import Config, DamperConfig, FramesConfig
from mrctl.config.load import config_from_document, load_config
from mrctl.config.models import (
    BodyVelocityConfig,
    BusConfig,
    ControlConfig,
    LogConfig,
    LoopConfig,
    PlantConfig,
    RealtimeConfig,
    SafetyConfig,
)
from mrctl.config.signal_rules import SignalRules

__all__ = [
    "BodyVelocityConfig",
    "BusConfig",
    "Config",
    "ControlConfig",
    "DamperConfig",
    "FramesConfig",
    "LogConfig",
    "LoopConfig",
    "PlantConfig",
    "RealtimeConfig",
    "SafetyConfig",
    "SignalRules",
    "config_from_document",
    "load_config",
]
