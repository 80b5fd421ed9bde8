"""What a report draws of a replay, in constant memory: extremes in buckets of ticks that widen."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrctl.config import Config
from mrctl.model.forward import ForwardModel
from mrctl.model.pipeline import ForwardPipeline
from mrctl.runtime.corner import Corner
from mrctl.runtime.tick import Tick

Array = NDArray[np.float64]

SIGNALS = (
    "relative_velocity_m_s",
    "body_velocity_m_s",
    "temperature_c",
    "force_wish_n",
    "force_model_n",
    "current_a",
    "state",
)
BUCKETS_MAX = 3000
_BLOCK_TICKS = 4096


class Trace:
    """An observer of a Player.

    lows, highs: (buckets, 2 + signals of all dampers), time in s and the count of rejected first.
    """

    def __init__(self, config: Config) -> None:
        dt_s = 1.0 / config.loop.rate_hz
        self.dampers = tuple(config.dampers)
        self.ticks_per_bucket = 1
        self._models = [
            ForwardPipeline(calibration.damper, dt_s)
            if calibration.damper.effects
            else ForwardModel(calibration.damper, dt_s)
            for calibration in (config.calibrations[name] for name in self.dampers)
        ]
        self._rows: list[list[float]] = []
        self._block = _BLOCK_TICKS
        width = 2 + len(SIGNALS) * len(self.dampers)
        self.lows: Array = np.empty((0, width))
        self.highs: Array = np.empty((0, width))

    def __call__(self, now_ns: int, tick: Tick) -> None:
        """Take what the tick has now."""
        row = [now_ns / 1e9, float(tick.rejected.total())]
        for corner, model in zip(tick.corners, self._models, strict=True):
            row += _signals(corner, model)
        self._rows.append(row)
        if len(self._rows) >= self._block:
            self.flush()

    def flush(self) -> None:
        """Put what was taken into buckets."""
        if not self._rows:
            return
        rows = np.array(self._rows)
        self._rows.clear()
        starts = np.arange(0, len(rows), self.ticks_per_bucket)
        # NaN, a signal that is not there, counts only where a bucket has nothing else.
        self.lows = np.concatenate([self.lows, np.fmin.reduceat(rows, starts)])
        self.highs = np.concatenate([self.highs, np.fmax.reduceat(rows, starts)])
        while len(self.lows) > BUCKETS_MAX:
            pairs = np.arange(0, len(self.lows), 2)
            self.lows, self.highs = np.fmin.reduceat(self.lows, pairs), np.fmax.reduceat(self.highs, pairs)
            self.ticks_per_bucket *= 2
            self._block = max(_BLOCK_TICKS, self.ticks_per_bucket)

    def line(self, damper: int, signal: str, begin_s: float) -> tuple[Array, Array]:
        """Time since begin_s in s, and a line that goes through the extremes of every bucket."""
        column = 2 + damper * len(SIGNALS) + SIGNALS.index(signal)
        time = self.lows[:, 0] - begin_s
        low, high = self.lows[:, column], self.highs[:, column]
        if self.ticks_per_bucket == 1:
            return time, low
        return np.repeat(time, 2), np.stack((low, high), axis=1).ravel()

    def rejected(self, begin_s: float) -> tuple[Array, Array]:
        """Time since begin_s in s, and how many frames and values had been rejected."""
        return self.highs[:, 0] - begin_s, self.highs[:, 1]


def _signals(corner: Corner, model: ForwardModel | ForwardPipeline) -> tuple[float, ...]:
    channels = corner.channels
    velocity, temperature = channels["relative_velocity"], channels["temperature"]
    body = channels.get("body_velocity")
    if isinstance(model, ForwardPipeline):
        stroke = channels.get("displacement")
        x = 0.0 if stroke is None else stroke.value
        force = model.step(velocity.value, corner.current_a, temperature.value, x)
    else:
        force = model.step(velocity.value, corner.current_a, temperature.value)
    return (
        velocity.value if velocity.ok else math.nan,
        body.value if body is not None and body.ok else math.nan,
        temperature.value if temperature.ok else math.nan,
        corner.wish_n if velocity.ok else math.nan,
        force,
        corner.current_a,
        float(corner.state),
    )
