"""The LMS algorithm (Eq. 6.1) compiled: sample by sample, and thousands of passes over one record at once.

    e_k = d_k - w_k' x_k,    w_(k+1) = w_k + mu e_k x_k,    x_k the last `taps` inputs, newest first

`lms` does these updates one after another. A pass over a whole record is an affine map of the weights,
w -> A w + b, so `pass_map` sends the unit vectors through one pass, and any number of passes follows from
that, with the same weights as if each had been done.

The little linear algebra that this takes is compiled here, too: runs are worked on side by side, one a core,
and a BLAS that brings threads of its own makes that several times slower.
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


@numba.njit(fastmath=FAST, nogil=True, cache=True)
def _run_two(inputs, count, step, one, two):  # type: ignore[no-untyped-def]  # as above  # noqa: ANN001, ANN202
    """One pass over `count` samples with nothing wanted, of two weights at once: half the loads for each."""
    taps = one.size
    y1, y2 = 0.0, 0.0
    for j in range(taps):
        y1 += one[j] * inputs[j]
        y2 += two[j] * inputs[j]
    for k in range(count):
        push1, push2 = -step * y1, -step * y2
        now = inputs[k : k + taps]
        after = inputs[min(k + 1, count - 1) : min(k + 1, count - 1) + taps]
        y1, y2 = 0.0, 0.0
        for j in range(taps):
            w1 = one[j] + push1 * now[j]
            w2 = two[j] + push2 * now[j]
            one[j] = w1
            two[j] = w2
            y1 += w1 * after[j]
            y2 += w2 * after[j]


@numba.njit(nogil=True, cache=True)
def _map(inputs, wanted, step, A, b):  # type: ignore[no-untyped-def]  # as above  # noqa: ANN001, ANN202
    """One pass from each unit vector with nothing wanted, into the rows of A (A'), and from zero, into b."""
    taps = b.size
    spare = np.zeros(taps)
    for j in range(0, taps, 2):
        A[j, j] = 1.0
        if j + 1 < taps:
            A[j + 1, j + 1] = 1.0
            _run_two(inputs, wanted.size, step, A[j], A[j + 1])
        else:
            _run_two(inputs, wanted.size, step, A[j], spare)
    _run(inputs, wanted, step, b, np.empty(wanted.size))


@numba.njit(fastmath=FAST, nogil=True, cache=True)
def _square(A, out):  # type: ignore[no-untyped-def]  # as above  # noqa: ANN001, ANN202
    """A A into out (n × n), four rows at a time."""
    n = A.shape[0]
    out[:, :] = 0.0
    for i in range(0, n - n % 4, 4):
        o0, o1, o2, o3 = out[i], out[i + 1], out[i + 2], out[i + 3]
        for k in range(n):
            a0, a1, a2, a3, row = A[i, k], A[i + 1, k], A[i + 2, k], A[i + 3, k], A[k]
            for j in range(n):
                x = row[j]
                o0[j] += a0 * x
                o1[j] += a1 * x
                o2[j] += a2 * x
                o3[j] += a3 * x
    for i in range(n - n % 4, n):
        for k in range(n):
            a, row, o = A[i, k], A[k], out[i]
            for j in range(n):
                o[j] += a * row[j]


@numba.njit(fastmath=FAST, nogil=True, cache=True)
def _apply(A, x, out):  # type: ignore[no-untyped-def]  # as above  # noqa: ANN001, ANN202
    """A x + out into out."""
    for i in range(A.shape[0]):
        y, row = 0.0, A[i]
        for j in range(x.size):
            y += row[j] * x[j]
        out[i] += y


@numba.njit(fastmath=FAST, nogil=True, cache=True)
def _cholesky(A, x):  # type: ignore[no-untyped-def]  # as above  # noqa: ANN001, ANN202
    """Solve A x = x in place; A (n × n), symmetric and positive, becomes its lower factor."""
    n = x.size
    for i in range(n):
        for j in range(i + 1):
            total, mine, other = A[i, j], A[i], A[j]
            for k in range(j):
                total -= mine[k] * other[k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]
    for i in range(n):
        total = x[i]
        for k in range(i):
            total -= A[i, k] * x[k]
        x[i] = total / A[i, i]
    for i in range(n - 1, -1, -1):
        x[i] /= A[i, i]
        for k in range(i):
            x[k] -= A[i, k] * x[i]


def lms(inputs: Array, wanted: Array, step: float, weights: Array) -> Array:
    """One pass; changes `weights` (taps, newest first) in place and returns the errors (n).

    inputs (n + taps - 1): the signal with its past in front; wanted (n).
    """
    errors = np.empty(wanted.size)
    turned = weights[::-1].copy()
    _run(inputs, wanted, step, turned, errors)
    weights[:] = turned[::-1]
    return errors


def solve(matrix: Array, right: Array) -> Array:
    """The solution (n) of a symmetric positive definite system (n × n, n)."""
    x = right.copy()
    _cholesky(matrix.copy(), x)
    return x


def form(matrix: Array, x: Array) -> float:
    """The quadratic form x' M x (n × n, n)."""
    product = np.zeros(x.size)
    _apply(matrix, x, product)
    return float(x @ product)


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
        after = self.b.copy()
        _apply(self.A, weights, after)
        return after

    def twice(self) -> PassMap:
        """Two passes as one."""
        A = np.empty_like(self.A)
        _square(self.A, A)
        return PassMap(A, self(self.b))


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
