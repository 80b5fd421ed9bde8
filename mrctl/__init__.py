"""mrctl: makes a magnetorheological damper do what a control law asks."""

from __future__ import annotations

__version__ = "0.1.0"
