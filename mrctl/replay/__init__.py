"""Replay: a recorded bus through the tick that runs live, and what it commands against what was commanded."""
