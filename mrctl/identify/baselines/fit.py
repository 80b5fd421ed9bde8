"""All baselines by name, and their fit to a campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mrctl.errors import InputError
from mrctl.identify.baselines.bouc_wen import fit_bouc_wen, fit_spencer
from mrctl.identify.baselines.liu import fit_liu
from mrctl.identify.baselines.reader import fit_reader
from mrctl.identify.baselines.result import BaselineFit, Model
from mrctl.identify.records import Record, records_of
from mrctl.identify.result import errors_of
from mrctl.measurements.run import Campaign

BASELINES: dict[str, Callable[[Sequence[Record]], Model]] = {
    "Reader": fit_reader,
    "Liu": fit_liu,
    "Bouc-Wen": fit_bouc_wen,
    "Spencer": fit_spencer,
}


def fit_baselines(
    campaign: Campaign,
    which: Sequence[str] = tuple(BASELINES),
    progress: Callable[[int, int, str], None] = lambda _done, _total, _what: None,
) -> list[BaselineFit]:
    """Fit the baselines named in `which`; progress(done, total, what) is told how far it is.

    Raises InputError for a name that is none, and where no run can be fitted.
    """
    unknown = [name for name in which if name not in BASELINES]
    if unknown:
        raise InputError.at(
            "baselines", f"there is no {unknown[0]!r}", f"take some of {', '.join(BASELINES)}"
        )
    records = records_of(campaign.runs)
    if not records:
        raise InputError.at(
            campaign.root, "no run has motion, current and force", "measure these three together"
        )
    fits = []
    for done, name in enumerate(which):
        progress(done, len(which), name)
        model = BASELINES[name](records)
        forces = [model.predict(campaign.runs[r.run]) for r in records]
        errors = errors_of(campaign, [r.run for r in records], forces)
        fits.append(BaselineFit(name, model.parameters, errors, model.predict))
    progress(len(which), len(which), "done")
    return fits
