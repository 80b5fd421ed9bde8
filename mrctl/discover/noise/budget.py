"""What a fit leaves, and how much of that is noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrctl.discover.noise.noise_floor import NoiseFloor
from mrctl.discover.noise.spectral_floor import mean_square, spectral_floor
from mrctl.identify.noise import SCALE

Array = NDArray[np.float64]

CYCLE_DOUBT, SPECTRAL_DOUBT = 0.25, 0.35  # relative doubt about the noise's mean square, by where it is from
KNOWN_SHARE = 0.5  # of the samples whose noise must be known from cycles to speak for all
FEW_DOUBT = 0.7  # as CYCLE_DOUBT, where fewer are, and of the runs that do not repeat beside the others
UNSEEN_DOUBT = 0.7  # as SPECTRAL_DOUBT, about noise beside which nothing is seen
MOST_COLOURED = 5.0  # noise over its sample-to-sample part, for noise that remembers 95 % of a sample
MOST_HEARD = 6.0  # as MOST_COLOURED, where runs that repeat show it: what wanders more is no sensor's
HEARD_SHARE = 0.5  # of the samples, that records must have which are sampled fast enough to speak for all
QUIET = 0.25  # quantile of the records, by what they leave over their sample-to-sample noise
# RMS that is still one noise: over the quiet records', over the usual sample's.
UNSTEADY, OUTBURSTS = 1.3, 1.5
LOUD = 2.0  # as UNSTEADY, of one record: no sensor's noise grows so from run to run


@dataclass(frozen=True, slots=True)
class Budget:
    """Mean squares in N² at full rate: what a fit leaves, that where the noise is known, the noise there."""

    total: float
    judged: float
    noise: float
    measured: bool  # from cycle to cycle
    most_noise: float  # that cannot be ruled out
    certain: float = 0.0  # what some of the runs leave over their noise, beyond doubt
    brought: float = 0.0  # by the noise of the motion, of all samples
    spectral: bool = (
        True  # where it is not measured: read off a spectrum, not off how loud all that is left is
    )

    @property
    def how(self) -> str:
        """How the noise is known, in words."""
        if self.measured:
            return "from cycle to cycle"
        return "by its spectrum above 30 Hz" if self.spectral else "at most, by what is left"

    @property
    def excess(self) -> float:
        """What is left beyond any noise that there may be."""
        return max(self.judged - self.most_noise, self.certain, 0.0)

    @property
    def drowned(self) -> bool:
        """Whether the noise of the motion makes as much as is left by itself.

        It does not repeat, but where the damper is steep a fit to it is blurred, and its misses do.
        """
        return self.brought >= self.judged

    @property
    def unseen(self) -> float:
        """The excess of what no signal predicts: where no run repeats, more of that may be noise."""
        if self.measured:
            return self.excess
        return max(min(self.excess, self.judged - (1.0 + UNSEEN_DOUBT) * self.noise), self.certain)


def budget_of(
    errors: Sequence[Array],
    brought: Sequence[Array],
    floors: Sequence[NoiseFloor],
    rates_hz: Sequence[float],
) -> Budget:
    """The budget of what a fit leaves of each record (n each, N) at its rate.

    The noise is measured where runs repeat; elsewhere read off the spectrum of what the fit leaves. What the
    velocity's noise makes of the model's force (`brought`, n each) comes on top, as far as what is left does
    not repeat: the true force knows nothing of it. Where neither shows it, all that is left counts as noise,
    but for what the signals predict of it.
    """
    total, input_n2 = mean_square(errors), mean_square(brought)
    beside = np.array([float(np.mean(b * b)) for b in brought])
    sizes = np.array([e.size for e in errors])
    own = np.array([float(np.mean(e * e)) for e in errors])
    least = np.maximum([f.lower_bound_n for f in floors], 1e-12)
    known = np.array([f.floor_n is not None for f in floors])
    samples = max(int(sizes[known].sum()), 1)
    noises = np.array([_measured(f, b, e) for f, b, e in zip(floors, beside, errors, strict=True)])
    measured = float(sizes[known] @ noises[known]) / samples
    judged = float(sizes[known] @ own[known]) / samples
    # One sensor measured all runs: the others' noise is coloured as that of those that repeat.
    coloured = float(np.max((noises - beside)[known] / least[known] ** 2, initial=0.0))
    if samples >= KNOWN_SHARE * sizes.sum():
        most = (1.0 + FEW_DOUBT) * (max(coloured, 1.0) * least**2 + beside)
        over = float(sizes[~known] @ (own - most)[~known]) / sizes.sum()
        return Budget(
            total,
            judged,
            measured,
            measured=True,
            most_noise=(1.0 + CYCLE_DOUBT) * measured,
            certain=max(over, 0.0),
            brought=input_n2,
        )
    spectral = spectral_floor(errors, rates_hz, brought)
    # Sharp physics that no effect follows reaches above 30 Hz too, but not up to the sample rate.
    usual = float(np.median(least)) ** 2
    red = MOST_COLOURED**2 * usual + input_n2
    most = min(red, _steady(errors, own, beside, least))
    noise = min(total, most) if spectral is None else min(spectral.noise_n**2, total, most)
    upper = noise if spectral is None else min(spectral.most_n**2, most)
    if known.any():  # nor does it remember more than where runs repeat: it is one sensor's
        upper = min(upper, (1.0 + FEW_DOUBT) * (max(coloured, 1.0) * usual + input_n2))
    doubted = min((1.0 + SPECTRAL_DOUBT) * noise, max(most, noise))
    # The sensor has at least the noise that it is known to have in some runs.
    sensor = float(sizes[known] @ np.maximum(noises - beside, 0.0)[known]) / samples
    everywhere = sensor + float(np.average(beside, weights=sizes))
    shared = (1.0 + CYCLE_DOUBT) * everywhere if known.any() else 0.0
    reddest = max(red, min((1.0 + CYCLE_DOUBT) * coloured, MOST_HEARD**2) * usual + input_n2)
    highest = max(doubted, upper, min(shared, reddest))
    # A record whose force jumps from sample to sample by more than is left of it follows no motion so fast.
    heard = own > least**2
    certain = _over_the_quiet(own, beside, least, sizes, heard)
    spoken = total
    if sizes[heard].sum() >= HEARD_SHARE * sizes.sum():
        spoken = min(total, float(np.average(own[heard], weights=sizes[heard])))
    over = judged - (1.0 + FEW_DOUBT) * measured
    if over > 0.0:  # of the few that repeat, and of all, as far as the others leave as much
        share = float(samples / sizes.sum())
        others = min(total - (1.0 + FEW_DOUBT) * everywhere, judged - measured)
        certain = max(certain, share * over, others)
    return Budget(
        total,
        spoken,
        noise,
        measured=False,
        most_noise=highest,
        certain=certain,
        brought=input_n2,
        spectral=spectral is not None and noise == spectral.noise_n**2,
    )


def _measured(floor: NoiseFloor, brought: float, error: Array) -> float:
    """The mean square of noise in a run's residual, the input's included; NaN where nothing repeats."""
    if floor.floor_n is None:
        return float("nan")
    own = floor.floor_n**2
    unrepeated = floor.unrepeated(error)
    return own + brought if unrepeated is None else max(own, min(own + brought, unrepeated))


def _over_the_quiet(
    own: Array, beside: Array, least: Array, sizes: NDArray[np.intp], heard: NDArray[np.bool_]
) -> float:
    """The mean square that records far beyond the quiet ones' noise leave over it.

    Over all records together, a little too much everywhere and a lot in one look alike. Where the fast motion
    of slow samples reaches into what changes from sample to sample, that is no noise to compare by; where it
    nearly does, what the quiet ones leave is.
    """
    if not heard.any():
        return 0.0
    by_sample = float(np.quantile((own / least**2)[heard], QUIET)) * least**2
    like_the_quiet = np.maximum(by_sample, float(np.quantile(own[heard], QUIET)))
    over = own - (1.0 + FEW_DOUBT) * beside - like_the_quiet
    loud = heard & (over > (LOUD**2 - 1.0) * like_the_quiet)
    return float(np.average(np.where(loud, over, 0.0), weights=sizes))


def _steady(errors: Sequence[Array], own: Array, beside: Array, least: Array) -> float:
    """The largest mean square that noise can have which is the same in all records and at all times.

    From run to run it may differ in size, then from sample to sample too. A model's errors come and go.
    own, beside, least (records each): what is left, of it the input's, in N²; noise from sample to sample, N.
    """
    sizes = [e.size for e in errors]
    quiet = float(np.quantile(np.sqrt(np.maximum(own - beside, 0.0)) / least, QUIET))
    usual = np.array([SCALE * float(np.median(np.abs(e - np.median(e)))) for e in errors])
    by_record = (UNSTEADY * quiet * least) ** 2 + beside
    by_sample = (OUTBURSTS * usual) ** 2 + beside
    return float(min(np.average(by_record, weights=sizes), np.average(by_sample, weights=sizes)))
