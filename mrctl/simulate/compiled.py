"""Compiles the model's plain functions with numba, on first use, and keeps the result on disk.

The vehicle's functions are compiled as they stand: whatever plain function they call is made known to
numba by following their globals, and `bisect_right`, which is C in Python, gets a body here. Machine code
is kept in the user's cache folder under a digest of every source file that went into it, so that an
effect whose file changes is compiled anew.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from threading import RLock
from types import FunctionType
from typing import Any, cast

import numba
from numba.core import config
from numba.core.errors import NumbaError, UnsupportedBytecodeError
from numba.extending import register_jitable

from mrctl.errors import InputError
from mrctl.model.effects.base import Effect, Stage, Step
from mrctl.simulate import extension, loops

Kernel = Callable[..., None]

_known: set[FunctionType] = set()
_compiling = RLock()


def run_step(effect: Effect, *arguments: object) -> None:
    """The effect's step over whole arrays; `loops` tells the arguments.

    Raises InputError naming the effect's file where numba cannot compile it, or it divides by zero.
    """
    try:
        with blaming(effect):
            _kernel(effect.stage, effect.step, effect.name)(*arguments)
    except ArithmeticError as error:
        raise divided(effect, error) from error


@contextmanager
def blaming(effect: Effect) -> Iterator[None]:
    """Name the effect's file where its step cannot be compiled: raises InputError."""
    try:
        yield
    except (NumbaError, UnsupportedBytecodeError) as error:
        reason = next((line for line in str(error).splitlines() if line and "nopython" not in line), "")
        raise InputError.at(
            effect.step.__code__.co_filename,
            f"the step of {effect.name} cannot be compiled ({reason.strip()})",
            "keep to floats, math and plain functions",
            effect.step.__code__.co_firstlineno,
        ) from error


def divided(effect: Effect, error: ArithmeticError) -> InputError:
    """What an effect's step or start raised at some values, as a fault of its file."""
    return InputError.at(
        effect.step.__code__.co_filename,
        f"the step of {effect.name} fails at some values ({error})",
        "divide by nothing that can be 0",
        effect.step.__code__.co_firstlineno,
    )


@cache
def _kernel(stage: Stage, step: Step, name: str) -> Kernel:
    """An effect's loop, whatever size of damper its bounds are for."""
    return compiled(loops.LOOPS[stage], step, name)


def compiled(make_loop: loops.LoopOf, step: Step, name: str, signature: object = None) -> Kernel:
    """The loop that `make_loop` builds around a step, compiled when first called; from any thread.

    With a signature it is compiled at once, for that alone, and other loops may be given it as a pointer.
    """
    with _compiling:
        return _compiled(make_loop, step, name, signature)


@cache
def _compiled(make_loop: loops.LoopOf, step: Step, name: str, signature: object) -> Kernel:
    loop = make_loop(step)
    used = [f for own in _enclosed(loop) for f in _make_known(own)]
    files = _source_files([loop, extension.bisect_right, *used])
    if files is None:  # typed in at a prompt: nothing to tell two versions apart by
        return cast("Kernel", numba.njit(signature, nogil=True)(loop))
    # numba keeps compiled code by this name: the digest in it makes stale code unreachable.
    loop.__qualname__ = f"{name}_{_digest(files)}"
    with _cache_folder() as there:
        return cast("Kernel", numba.njit(signature, nogil=True, cache=there)(loop))


def _make_known(step: FunctionType) -> list[FunctionType]:
    """Make a plain function, and all that it calls or is built around, callable from compiled code."""
    found: list[FunctionType] = []
    todo = [step]
    while todo:
        function = todo.pop()
        if function in found:
            continue
        found.append(function)
        if function not in _known:
            _known.add(function)
            register_jitable(forceinline=True)(function)
        names = function.__code__.co_names
        todo += [f for f in map(function.__globals__.get, names) if isinstance(f, FunctionType)]
        todo += _enclosed(function)
    return found


def _enclosed(function: Any) -> list[FunctionType]:  # noqa: ANN401 - any callable may be built around others
    """The plain functions that a function was built around."""
    found = []
    for cell in function.__closure__ or ():
        with suppress(ValueError):  # an empty one
            if isinstance(cell.cell_contents, FunctionType):
                found.append(cell.cell_contents)
    return found


def _source_files(functions: list[Any]) -> list[Path] | None:
    files = {Path(function.__code__.co_filename) for function in functions}
    return sorted(files) if all(file.is_file() for file in files) else None


def _digest(files: list[Path]) -> str:
    digest = hashlib.sha256(f"{sys.version} {numba.__version__}".encode())
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Where compiled code is kept: MRCTL_CACHE_DIR, or the user's cache folder."""
    given = os.environ.get("MRCTL_CACHE_DIR")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "mrctl"


@contextmanager
def _cache_folder() -> Iterator[bool]:
    """Have numba cache in our folder for the while; False where none can be written."""
    folder = cache_folder() / "compiled"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        yield False
        return
    if not os.access(folder, os.W_OK):
        yield False
        return
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
    try:
        yield True
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]
