"""What the paper leaves open or fixes by hand, with its own values as defaults."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PaperOptions:
    """Settings of the paper's method; the defaults are the paper's where it names a value.

    The paper's "3000 iterations" are taken as passes over a run's record: 3000 single updates of Eq. 6.1
    would end before the first pass does (six cycles at 2 kHz are 5027 samples), and Fig. 6.2 speaks of
    a mean squared error, which a pass has and a sample has not. A longer record takes fewer passes, as many
    as bring the same number of updates.
    """

    sample_rate_hz: float = 2000.0  # of the filters; runs at other rates are brought to it
    cutoff_hz: float = 20.0  # Sec. 5.1
    bins: int = 50  # Sec. 5.2
    drop_first_cycles: int = 2  # of nine, together with the last: Fig. 5.4 shows six
    drop_last_cycles: int = 1
    taps: int = 500  # Sec. 6.2
    step_per_n2: float = 1e-9  # Sec. 6.2; made smaller where it would not be stable
    passes: int = 3000  # Sec. 6.2
    current_max_a: float | None = None  # of the calibration; None: the largest current of the campaign
    current_slew_a_s: float = 400.0  # of the calibration; not identified
    workers: int = 2  # threads for the adaptive filters
