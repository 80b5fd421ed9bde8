"""The frames that leave a tick: when each is due, and what the slower ones say of the controller."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

from mrctl.can.codec import Encoder, make_encoder
from mrctl.can.specs import FrameSpec

Frame = tuple[int, bytes]  # CAN ID with the flag bits of Linux, payload

# In the order of HealthRejects.
_REASONS = (
    ("crc",),
    ("counter",),
    ("range",),
    ("rate", "frozen"),
    ("not_available",),
    ("malformed",),
    ("remote_frame", "error_frame", "fd_frame"),
)


class LoopFigures(NamedTuple):
    """What the loop tells the health frames: times in µs of the last second, counts since the start."""

    lateness_p50_us: float = 0.0
    lateness_p99_us: float = 0.0
    lateness_max_us: float = 0.0
    skipped: int = 0
    lateness_p999_us: float = 0.0
    duration_p50_us: float = 0.0
    duration_p99_us: float = 0.0
    duration_max_us: float = 0.0
    long_ticks: int = 0  # that took longer than a period
    dropped: int = 0  # frames that the receive buffer lost


class Sender:
    """A cyclic frame: when it is due, and with which counter it leaves."""

    __slots__ = ("_counter", "_encode", "_every", "_id", "next")

    def __init__(
        self, spec: FrameSpec, every: int, first: int | None = None, encode: Encoder | None = None
    ) -> None:
        """every: ticks from one to the next; first: the tick of the first, `every` if left out.

        encode: where the values are none that the spec's own encoder takes.
        """
        self._encode = encode or make_encoder(spec)
        self._id = spec.linux_id
        self._every = every
        self.next = every if first is None else first  # the tick when the next is due
        self._counter = 0

    def frame(self, now: int, values: Sequence[float]) -> Frame:
        """The frame of tick `now` with these values."""
        if now == self.next:
            self.next += self._every
        else:  # what was skipped stays out
            self.next += self._every * ((now - self.next) // self._every + 1)
        self._counter += 1
        return self._id, self._encode(values, self._counter)


class SlowFrames:
    """ControllerState and the health frames, which leave now and then."""

    def __init__(
        self,
        state: tuple[FrameSpec, int],
        health: tuple[FrameSpec, int],
        figures: Sequence[tuple[FrameSpec, int]],
        dt_s: float,
        states: Callable[[], list[float]],
        rejected: Counter[str],
    ) -> None:
        """Each frame with its ticks from one to the next. figures: HealthTiming, HealthRejects or neither.

        states: asked for the values of ControllerState when it is due. rejected: counts so far, by reason.
        """
        values = {"HealthTiming": self._timing, "HealthRejects": self._rejects}
        self._frames: list[tuple[Sender, Callable[[int, LoopFigures], list[float]]]] = [
            (Sender(*state), lambda _now, _figures: states()),
            (Sender(*health), self._health),
            # With the first health frame of a second, so that their figures are of the same one.
            *((Sender(spec, every, first=health[1]), values[spec.name]) for spec, every in figures),
        ]
        self.next = 0  # the tick when the next of these is due, or a second is over
        self._dt_s = dt_s
        self._second = max(1, round(1.0 / dt_s))
        self._second_ends = self._second
        self._rejected = rejected
        self._rejected_before: Counter[str] = Counter()
        self._rejected_lately: Counter[str] = Counter()  # in the last whole second

    def due(self, now: int, figures: LoopFigures) -> list[Frame]:
        """The frames of tick `now`; to be called once it is as late as `next`."""
        if now >= self._second_ends:
            self._second_ends += self._second * ((now - self._second_ends) // self._second + 1)
            self._rejected_lately = self._rejected - self._rejected_before
            self._rejected_before = self._rejected.copy()
        out = [
            sender.frame(now, values(now, figures)) for sender, values in self._frames if now >= sender.next
        ]
        self.next = min(self._second_ends, *(sender.next for sender, _ in self._frames))
        return out

    def _health(self, now: int, figures: LoopFigures) -> list[float]:
        return [*figures[:4], self._rejected_lately.total(), now * self._dt_s]

    @staticmethod
    def _timing(_now: int, figures: LoopFigures) -> list[float]:
        return list(figures[4:9])

    def _rejects(self, _now: int, figures: LoopFigures) -> list[float]:
        lately = self._rejected_lately
        return [*(sum(lately[reason] for reason in reasons) for reasons in _REASONS), figures.dropped]
