"""The refined inverse filter, for the tick: from a force wish to the static force that H turns into it.

    back    = inverse(wish)
    missing = wish - forward(back)
    refined = back + inverse(lowpass(missing))

Forward times inverse filter, G, is not quite 1 (up to 0.7 dB and 3 degrees in the paper's band). What is
left, 1 - G, is formed from the wish, low-passed and sent through the inverse filter once more, which squares
the remaining error.

Four filters in a row are most of the arithmetic of a tick. So they are written out as one function, its
coefficients as numbers and its states as variables: the same numbers as from `iir_step`, in half the time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mrctl.model.filters import Filter, settled_state

Step = Callable[[float], float]
Settle = Callable[[float], None]

_SOURCE = """
def make():
    {zeroed}

    def step(wish):
        nonlocal {states}
        {body}

    def settle(values):
        nonlocal {states}
        [{states}] = values

    return step, settle
"""


def make_refined_inverse(inverse: Filter, forward: Filter, lowpass: Filter | None) -> tuple[Step, Settle]:
    """The refined inverse filter: its step, and what brings it to where a constant wish leads.

    All filters belong to the same sample rate. Without a low-pass nothing is refined.
    """
    states: list[str] = []
    body = _section("back", inverse, "wish", states)
    if lowpass is None:
        body.append("return back")
    else:
        body += _section("made", forward, "back", states)
        body.append("missing = wish - made")
        body += _section("low", lowpass, "missing", states)
        body += _section("more", inverse, "low", states)
        body.append("return back + more")
    source = _SOURCE.format(
        states=", ".join(states),
        zeroed=" = ".join([*states, "0.0"]),
        body="\n        ".join(body),
    )
    scope: dict[str, Any] = {}
    exec(compile(source, "<refined inverse>", "exec"), scope)  # noqa: S102  # made here, of numbers only
    step, take = scope["make"]()

    def settle(wish_n: float) -> None:
        known = {
            f"{name}{k}": value
            for name, section in (("back", inverse), ("made", forward))
            for k, value in enumerate(settled_state(section.coefficients, wish_n), start=1)
        }
        take([known.get(state, 0.0) for state in states])

    settle(0.0)
    return step, settle


def _section(output: str, section: Filter, given: str, states: list[str]) -> list[str]:
    """The statements of one filter from variable `given` to `output`, as `iir_step`; adds its states."""
    b, a = section.b, section.a
    order = max((k for k in range(1, len(a)) if b[k] or a[k]), default=1)
    names = [f"{output}{k}" for k in range(1, order + 1)]
    states += names
    carried = [f" + {name}" for name in names] + [""]
    return [
        f"{output} = {b[0]!r} * {given}{carried[0]}",
        *(
            f"{name} = {b[k]!r} * {given} - {a[k]!r} * {output}{carried[k]}"
            for k, name in enumerate(names, start=1)
        ),
    ]
