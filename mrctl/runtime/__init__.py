"""The daemon: pure tick, supervisor, output guard, fixed-step loop, wiring."""
