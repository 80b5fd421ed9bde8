"""The control laws by name."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches

from mrctl.control.base import ForceLaw, Law
from mrctl.control.external import EXTERNAL
from mrctl.control.groundhook import GROUNDHOOK, HYBRID
from mrctl.control.liu import LIU
from mrctl.control.parameters import resolve
from mrctl.control.passive import PASSIVE, REFERENCE_DAMPER
from mrctl.control.skyhook import CONTINUOUS, NO_JERK, TWO_STATE

LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        TWO_STATE,
        CONTINUOUS,
        NO_JERK,
        GROUNDHOOK,
        HYBRID,
        REFERENCE_DAMPER,
        LIU,
        EXTERNAL,
        PASSIVE,
    )
}


def make_law(name: str, parameters: Mapping[str, object] | None = None) -> ForceLaw:
    """The law of that name, ready to be called once a tick; parameters not given take their defaults.

    Raises ValueError: unknown name, unknown parameter, value out of bounds, values that do not go together;
    the text says the mend.
    """
    law = LAWS.get(name)
    if law is None:
        close = get_close_matches(name, LAWS, n=1)
        mend = f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(LAWS)}"
        raise ValueError(f"no control law {name!r}; {mend}")
    values = resolve(name, law.parameters, parameters or {})
    try:
        return law.make(values)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
