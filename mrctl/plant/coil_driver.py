"""The power stage of the dampers: obeys current commands it can trust, and gives up on ones that stop."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from mrctl.can import e2e
from mrctl.can.codec import make_decoder
from mrctl.can.specs import FrameSpec

# Without a good command for so long, the stage drops to 0 A.
TIMEOUT_S = 0.1
# A step of the counter up to this is frames lost on the way; a larger one is no continuation.
COUNTER_STEP_MAX = 5


class CoilDriver:
    """Takes the payloads of the command frame; knows nothing of the controller but what the bus brings."""

    def __init__(self, spec: FrameSpec, current_max_a: Sequence[float]) -> None:
        """current_max_a: the largest current of each signal of the frame."""
        self._spec = spec
        self._decode = make_decoder(spec)
        self._current_max_a = tuple(current_max_a)
        self._commands_a = [0.0] * len(self._current_max_a)
        self._counter: int | None = None
        self._good_at_s = -math.inf
        self._obeying = False
        self.good = 0
        self.timeouts = 0
        self.rejected: Counter[str] = Counter()

    def take(self, data: bytes, now_s: float) -> None:
        """A payload that arrived at now_s; obeyed, or counted by the reason for which it is not."""
        reason = self._fault(data)
        if reason is not None:
            self.rejected[reason] += 1
            return
        self.good += 1
        self._good_at_s = now_s
        self._obeying = True
        self._commands_a = [
            0.0 if math.isnan(current) else min(max(current, 0.0), largest)
            for current, largest in zip(self._decode(data), self._current_max_a, strict=True)
        ]

    def currents_a(self, now_s: float) -> list[float]:
        """The current that each coil is driven to at now_s."""
        if self._obeying and now_s - self._good_at_s > TIMEOUT_S:
            self._obeying = False
            self.timeouts += 1
            self._commands_a = [0.0] * len(self._commands_a)
        return self._commands_a

    def _fault(self, data: bytes) -> str | None:
        if len(data) != self._spec.length:
            return "malformed"
        if not e2e.check(data, self._spec.data_ids):
            return "crc"
        counter = e2e.counter_of(data)
        step = 1 if self._counter is None else e2e.counter_delta(counter, self._counter)
        if step == 0:
            return "counter"
        self._counter = counter  # the next one in order is obeyed again
        return "counter" if step > COUNTER_STEP_MAX else None
