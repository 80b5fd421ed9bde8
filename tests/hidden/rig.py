"""A hidden damper back on its rig: further runs of a case, with its own simulator, sensors and noise."""

from __future__ import annotations

import fine
import numpy as np
import other
import sensing
from physics import IX
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt
from spec import make_spec

STEP_SHARE = 0.05  # of the largest current: a change between samples by more is a step, by less a slope


class Rig:
    """The damper of one case; `key` is (seed, family, index)."""

    def __init__(self, key, stream=0):
        seed, family, index = key
        self.other = family == "H"
        self.spec = other.other_spec(seed, index) if self.other else make_spec(seed, family, index)
        # What is drawn here has nothing of what the campaign drew.
        self.spec["rng"] = np.random.default_rng([seed, ord(family), index, 21, stream])
        self.rng = self.spec["rng"]
        self.current_max_a = float(self.spec["P"][IX["IMAX"]])

    def drawn(self, plan):
        """A run of the generator's own kind; `plan` as in draw.py."""
        make = other.other_run if self.other else fine.fine_run
        return make(self.spec, plan)

    def followed(self, record):
        """A run with the motion, current and temperature of a record of mrctl's, at rest before it."""
        hz, n = record.rate_hz, len(record)
        t, os_, n_pre = fine.fine_grid(self.spec, (n - 1) / hz)
        rest = round(fine.PRE * hz) + 2
        at = (np.arange(n + rest) - rest) / hz
        x = CubicSpline(at, np.r_[np.full(rest, record.displacement_m[0]), record.displacement_m])
        held = np.clip(np.floor(t * hz + 1e-9).astype(int), 0, n - 1)
        i = np.asarray(record.current_a)
        steps = np.abs(np.diff(i, append=i[-1:])) > STEP_SHARE * max(float(i.max()), 1e-9)
        slope = np.interp(t, np.arange(n) / hz, i)
        current = np.maximum(np.round(np.where(steps[held], i[held], slope), 4), 0.0)
        return dict(
            t=t,
            x=x(t),
            v=x(t, 1),
            a=x(t, 2),
            cmd=current,
            Tc=np.interp(t, np.arange(n) / hz, record.temperature_c),
            os=os_,
            n_pre=n_pre,
            dt=1.0 / (self.spec["fs"] * os_),
        )

    def force(self, r, i=None, *, late=True):
        """Force on the fine grid, with the current of the run or `i`; late: as a late sensor has it."""
        if self.other:
            return other.other_force(self.spec, r, i)[0]
        spec = self.spec
        if not late:
            spec = spec | {"path": {q: w for q, w in spec["path"].items() if q != "delay"}}
        return fine.true_force(spec, r, i=i)[0]

    def measured(self, r, file):
        """Write the run as its sensors see it; the force's noise, and the error of a perfect model."""
        if self.other:
            F, act = other.other_force(self.spec, r)[0], r["cmd"]
        else:
            F, act, _ = fine.true_force(self.spec, r)
        columns, at, clean, noise = sensing.sense(self.spec, r, F, act)
        file.parent.mkdir(parents=True, exist_ok=True)
        sensing.write_csv(columns, file)
        heard = noise if self.other else sensing.heard_error(self.spec, r, columns, at, clean, noise)
        return noise, heard

    def smooth_current(self, r, hz=2.0, low=0.05, high=0.85):
        """A random current without steps, between these shares of the largest."""
        n, before = r["t"].size, int(2.0 / r["dt"])
        lowpass = butter(2, hz, fs=1.0 / r["dt"], output="sos")
        y = sosfilt(lowpass, self.rng.standard_normal(before + n))[before:]
        share = (y - y.min()) / (y.max() - y.min())
        return self.current_max_a * (low + (high - low) * share)
