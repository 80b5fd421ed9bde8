"""Finds the effects: the files of this package, plug-ins, and files that a user points at.

An effect's file holds one `EFFECT`. Found are

- the modules of `mrctl.model.effects`;
- entry points of the group `mrctl.effects`, each naming a module or an `Effect`;
- the files and folders in the environment variable MRCTL_EFFECTS, separated as in PATH.

What begins with _ in a folder is no effect: `__init__.py`, or a helper of the effects beside it.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import pkgutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from mrctl.errors import InputError, Problem
from mrctl.model.damper import Damper
from mrctl.model.effects.base import Effect, EffectError, Settings, Stage, Vector
from mrctl.model.effects.faults import faults

GROUP = "mrctl.effects"
VARIABLE = "MRCTL_EFFECTS"
NOT_EFFECTS = frozenset({"base", "card", "faults", "registry", "size"})

# What running someone else's file can raise; each is told with the file's name.
BROKEN = (
    ImportError, SyntaxError, NameError, AttributeError, TypeError, ValueError, LookupError, ArithmeticError,
    AssertionError, OSError, RuntimeError,
)  # fmt: skip


@lru_cache(maxsize=1)
def effects() -> Mapping[str, Effect]:
    """All effects by name, in the order of computation. Raises InputError naming every broken file."""
    found: dict[str, Effect] = {}
    origin: dict[str, str] = {}
    problems: list[Problem] = []
    for place, load in _sources():
        try:
            effect = load()
        except InputError as error:
            problems += error.problems
            continue
        if effect.name in found:
            what = f"the effect {effect.name} is already there, from {origin[effect.name]}"
            problems.append(Problem(place, None, what, "give it another name"))
            continue
        found[effect.name], origin[effect.name] = effect, place
    if problems:
        raise InputError(problems)
    return {effect.name: effect for effect in sorted(found.values(), key=_order)}


def effect(name: str) -> Effect:
    """The effect of that name. Raises EffectError listing the known ones."""
    known = effects()
    if name not in known:
        raise EffectError(f"there is no effect {name}; there are {', '.join(known)}")
    return known[name]


def forget() -> None:
    """Look for effects anew at the next question."""
    effects.cache_clear()


def of_damper(damper: Damper) -> Settings:
    """The damper's effects with their parameter vectors, by stage. Raises EffectError for unsound ones."""
    return in_order((one.name, one.parameters) for one in damper.effects)


def in_order(settings: Iterable[tuple[str, Mapping[str, float]]]) -> Settings:
    """Named settings as (effect, parameter vector) by stage, each stage in its order of computation.

    Raises EffectError for unknown or doubled effects and unsound parameters.
    """
    chosen: dict[str, tuple[Effect, Vector]] = {}
    for name, values in settings:
        if name in chosen:
            raise EffectError(f"{name} stands twice")
        one = effect(name)
        chosen[name] = one, one.vector(values)
    ordered = sorted(chosen.values(), key=lambda pair: _order(pair[0]))
    return {stage: [pair for pair in ordered if pair[0].stage is stage] for stage in Stage}


def load_file(path: Path) -> Effect:
    """The effect in a Python file. Raises InputError naming the file and what is wrong with it."""
    if not path.is_file():
        raise InputError.at(path, "there is no such file")
    name = f"mrctl_effect_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError.at(path, "this is not a Python file", "an effect's file ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # so that the compiler finds the step again by module and name
    try:
        spec.loader.exec_module(module)
    except BROKEN as error:
        del sys.modules[name]
        raise _broken(str(path), error) from error
    return _sound(str(path), module)


def _sources() -> Iterator[tuple[str, Callable[[], Effect]]]:
    """Where each effect comes from, and what loads it."""
    package = importlib.import_module(__package__ or "mrctl.model.effects")
    for info in pkgutil.iter_modules(package.__path__):
        if info.name not in NOT_EFFECTS and not info.name.startswith("_"):
            place = str(Path(package.__path__[0]) / f"{info.name}.py")
            yield (
                place,
                partial(_load, place, partial(importlib.import_module, f"{package.__name__}.{info.name}")),
            )
    for point in entry_points(group=GROUP):
        place = f"entry point {point.name} = {point.value}"
        yield place, partial(_load, place, point.load)
    for entry in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        path = Path(entry)
        for file in sorted(path.glob("[!_]*.py")) if path.is_dir() else [path]:
            yield str(file), partial(load_file, file)


def _load(place: str, load: Callable[[], ModuleType | Effect]) -> Effect:
    try:
        loaded = load()
    except BROKEN as error:
        raise _broken(place, error) from error
    return _sound(place, loaded)


def _order(one: Effect) -> tuple[int, int, str]:
    return list(Stage).index(one.stage), one.rank, one.name


def _broken(place: str, error: BaseException) -> InputError:
    line = error.lineno if isinstance(error, SyntaxError) else _line_in(place, error)
    what = f"the effect cannot be loaded ({type(error).__name__}: {error})"
    return InputError.at(place, what, "mend the file or take it away", line)


def _line_in(place: str, error: BaseException) -> int | None:
    """The last line of the file itself that the error passed through."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == place:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def _sound(place: str, found: ModuleType | Effect) -> Effect:
    one = found if isinstance(found, Effect) else getattr(found, "EFFECT", None)
    if not isinstance(one, Effect):
        raise InputError.at(place, "it holds no EFFECT", "`mrctl effects --new NAME` writes a file that does")
    try:
        wrong = faults(one)
    except BROKEN as error:
        raise _broken(place, error) from error
    if wrong:
        raise InputError(Problem(place, None, f"{one.name or 'effect'}: {what}") for what in wrong)
    return one
