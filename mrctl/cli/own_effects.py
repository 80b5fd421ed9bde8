"""Effects by name for the commands, and a trial of the user's own before a fit depends on them."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

from mrctl.calibration import load_calibration
from mrctl.errors import InputError, Problem
from mrctl.model.effects.base import Effect
from mrctl.model.effects.registry import effects
from mrctl.share_path import share_file

_OURS = "mrctl.model.effects."


def effects_named(names: Iterable[str], place: str) -> list[Effect]:
    """The effects of these names, each once. Raises InputError at `place` for one that is not there."""
    known = effects()
    wanted = list(dict.fromkeys(names))
    for name in wanted:
        if name not in known:
            close = get_close_matches(name, known, n=1)
            mend = f"did you mean {close[0]}?" if close else f"there are {', '.join(known)}"
            raise InputError.at(place, f"there is no effect {name}", mend)
    return [known[name] for name in wanted]


def try_own_effects() -> None:
    """Raises InputError naming each effect from outside that fails where `mrctl effects --check` tries it."""
    own = [one for one in effects().values() if not one.step.__module__.startswith(_OURS)]
    if not own:
        return
    from mrctl.simulate.promises import failures  # noqa: PLC0415 - only who has such effects needs numba for it

    damper = load_calibration(share_file("config/calibration.yaml")).damper
    problems = [
        Problem(file_of(one), None, f"{one.name}: {what}", _mend(one))
        for one in own
        for what in failures(one, damper)
    ]
    if problems:
        raise InputError(problems)


def file_of(one: Effect) -> str:
    """The file that an effect's step stands in."""
    return one.step.__code__.co_filename


def _mend(one: Effect) -> str:
    return f"mend it, `mrctl effects {one.name} --check` tries it; or take it away"
