"""What the fit of a baseline gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrctl.identify.result import Errors
from mrctl.measurements.run import Run

Array = NDArray[np.float64]
Predict = Callable[[Run], Array]


class Quantity(NamedTuple):
    """A parameter's value and its unit."""

    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Model:
    """A fitted model: parameters by name, and its force in N (n) in a run."""

    parameters: Mapping[str, Quantity]
    predict: Predict


@dataclass(frozen=True, slots=True)
class BaselineFit:
    """A fitted model and how it follows the campaign that it was fitted to."""

    name: str
    parameters: Mapping[str, Quantity]
    errors: Errors
    predict: Predict
