"""The model over whole runs, at the desk: the same steps as on the vehicle, compiled."""

from mrctl.simulate.run import Run
from mrctl.simulate.trace import Trace, simulate, trace

__all__ = ["Run", "Trace", "simulate", "trace"]
