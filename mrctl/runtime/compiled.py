"""Whether the tick is compiled to machine code (an optional build) or interpreted."""

from __future__ import annotations

from types import FunctionType
from typing import Final

from mrctl.runtime.receiver import FrameReceiver

COMPILED: Final = not isinstance(FrameReceiver.take, FunctionType)


def receiver_kind() -> type[FrameReceiver]:
    """The receiver that is cheapest in this build."""
    if COMPILED:
        return FrameReceiver
    from mrctl.runtime.written import WrittenReceiver  # noqa: PLC0415  # cannot be, of a compiled base

    return WrittenReceiver
