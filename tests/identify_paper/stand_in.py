"""A small campaign of a damper that is known: inside the paper's model class, or a little outside it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from mrctl.calibration import load_calibration
from mrctl.measurements.run import Campaign, Run
from mrctl.share_path import share_file
from mrctl.simulate import simulate

TEMPERATURES_C = (28.9, 55.6, 82.8)
CURRENTS_A = (0.0, 1.0, 2.0, 3.0)


def damper():
    return replace(load_calibration(share_file("config/calibration.yaml")).damper, effects=())


def sine_run(
    truth,
    current_a,
    temperature_c,
    *,
    frequency_hz=2.387,
    amplitude_m=0.0254,
    cycles=9,
    rate_hz=2000.0,
    noise_n=5.0,
    seed=0,
    name=None,
):
    t = np.arange(round(cycles / frequency_hz * rate_hz)) / rate_hz
    omega = 2.0 * np.pi * frequency_hz
    x = amplitude_m * np.sin(omega * t)
    v = amplitude_m * omega * np.cos(omega * t) * np.minimum(1.0, t * frequency_hz)
    a = np.gradient(v, 1.0 / rate_hz)
    force = simulate(truth, 1.0 / rate_hz, v, current_a, temperature_c, x, a)
    noise = np.random.default_rng([seed, int(1000 * temperature_c)]).normal(0.0, noise_n, t.size)
    name = name or f"{current_a:g}A_{temperature_c:g}C"
    return Run(
        name=name,
        file=Path(f"{name}.csv"),
        time_s=t,
        velocity_m_s=v,
        current_a=np.full(t.size, float(current_a)),
        temperature_c=np.full(t.size, float(temperature_c)),
        force_n=force + noise,
        displacement_m=x,
        acceleration_m_s2=a,
        sample_rate_hz=rate_hz,
    )


def campaign(*runs):
    return Campaign(Path("campaign"), tuple(runs), "0" * 64)


def protocol(truth=None, currents_a=CURRENTS_A, temperatures_c=TEMPERATURES_C, **how):
    truth = truth or damper()
    return campaign(
        *(
            sine_run(truth, i, T, seed=n, **how)
            for n, (i, T) in enumerate(product(currents_a, temperatures_c))
        )
    )
