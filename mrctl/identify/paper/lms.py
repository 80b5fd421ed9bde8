"""The LMS algorithm (Eq. 6.1) compiled: sample by sample, and thousands of passes over one record at once.

    e_k = d_k - w_k' x_k,    w_(k+1) = w_k + mu e_k x_k,    x_k the last `taps` inputs, newest first

`lms` does these updates one after another. A pass over a whole record is an affine map of the weights,
w -> A w + b, so `pass_map` sends the unit vectors through one pass, and any number of passes follows from
that, with the same weights as if each had been done.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]

DOUBLINGS = 3
STRIDE = 2**DOUBLINGS  # passes in one step of `many_passes`, once its curve needs no finer ones

# Sums may be taken in any order, and multiply-add in one rounding; nothing else is relaxed.
FAST = {"reassoc", "contract", "nsz"}


@numba.njit(fastmath=FAST, nogil=True, cache=True)
def _run(inputs, wanted, step, turned, errors):  # type: ignore[no-untyped-def]  # numba infers the types  # noqa: ANN001, ANN202
    """One pass over n samples; `turned` are the weights oldest first, as the inputs lie."""
    taps, count = turned.size, wanted.size
    y = 0.0
    for j in range(taps):
        y += turned[j] * inputs[j]
    for k in range(count):
        error = wanted[k] - y
        errors[k] = error
        push = step * error
        now = inputs[k : k + taps]
        after = inputs[min(k + 1, count - 1) : min(k + 1, count - 1) + taps]
        y = 0.0
        for j in range(taps):  # this sample's update and the next one's output in one go over the weights
            w = turned[j] + push * now[j]
            turned[j] = w
            y += w * after[j]


@numba.njit(nogil=True, cache=True)
def _map(inputs, wanted, step, A, b):  # type: ignore[no-untyped-def]  # numba infers the types  # noqa: ANN001, ANN202
    """One pass from each unit vector with nothing wanted, into the rows of A (A'), and from zero, into b."""
    errors, nothing = np.empty(wanted.size), np.zeros(wanted.size)
    for j in range(b.size):
        A[j, j] = 1.0
        _run(inputs, nothing, step, A[j], errors)
    _run(inputs, wanted, step, b, errors)


def lms(inputs: Array, wanted: Array, step: float, weights: Array) -> Array:
    """One pass; changes `weights` (taps, newest first) in place and returns the errors (n).

    inputs (n + taps - 1): the signal with its past in front; wanted (n).
    """
    errors = np.empty(wanted.size)
    turned = weights[::-1].copy()
    _run(inputs, wanted, step, turned, errors)
    weights[:] = turned[::-1]
    return errors


def windows(inputs: Array, taps: int) -> Array:
    """A view (n, taps) of the signal: row k is x_k of Eq. 6.2, newest first."""
    return sliding_window_view(inputs, taps)[:, ::-1]


@dataclass(frozen=True, slots=True, eq=False)
class PassMap:
    """What one pass does to the weights (newest first): w -> A w + b (taps × taps, taps)."""

    A: Array
    b: Array

    def __call__(self, weights: Array) -> Array:
        """The weights after one more pass."""
        return self.A @ weights + self.b

    def twice(self) -> PassMap:
        """Two passes as one."""
        return PassMap(self.A @ self.A, self.A @ self.b + self.b)


def pass_map(inputs: Array, wanted: Array, step: float, taps: int) -> PassMap:
    """The map of one pass: what `lms` does, for any weights."""
    A, b = np.zeros((taps, taps)), np.zeros(taps)
    _map(inputs, wanted, step, A, b)
    return PassMap(np.ascontiguousarray(A.T[::-1, ::-1]), b[::-1].copy())


def many_passes(one: PassMap, passes: int) -> list[tuple[int, Array]]:
    """The weights, from zero, after some of the passes: each of the first, then every STRIDE-th, the last."""
    several = one
    for _ in range(DOUBLINGS):
        several = several.twice()
    weights = np.zeros(one.b.size)
    history: list[tuple[int, Array]] = []
    done = 0
    while done < passes:
        fits = done >= STRIDE and done + STRIDE <= passes
        weights = (several if fits else one)(weights)
        done += STRIDE if fits else 1
        history.append((done, weights))
    return history
