"""Many logs: each on its own, on all cores of this machine or of a Dask cluster; the results are the same.

Logs are replayed whole by one process each, which loads the configuration by its path. A log that cannot be
replayed gives a result with an `error`, and the others go on.
"""

from __future__ import annotations

import functools
import multiprocessing
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrctl.config import Config, load_config
from mrctl.errors import MrctlError
from mrctl.replay.run import Options, replay

Figures = dict[str, Any]
SUMMED = ("frames", "ticks", "commands", "differences", "seconds")


@dataclass(frozen=True, slots=True)
class Job:
    """One log to replay, and where its output and report go; everything by path, for another process."""

    log: str
    config: str
    options: Options
    out: str | None = None
    report: str | None = None
    command: str = ""


def run_job(job: Job) -> Figures:
    """The figures of one log, or what is wrong with it as `error`."""
    try:
        return _replayed(job)
    except MrctlError as error:
        return failed(job, str(error))


def failed(job: Job, error: str) -> Figures:
    """The result for a log that could not be replayed."""
    return {"log": job.log, "error": error}


def _replayed(job: Job) -> Figures:
    config = _config(job.config)
    out = None if job.out is None else Path(job.out)
    if job.report is None:
        return replay(Path(job.log), config, job.options, out=out).figures
    from mrctl.replay.report import reported  # noqa: PLC0415  # it needs the desk, a replay alone does not

    return reported(
        Path(job.log), config, job.options, Path(job.report), out=out, command=job.command
    ).figures


@functools.cache
def _config(path: str) -> Config:
    return load_config(path)


def on_this_machine(jobs: Sequence[Job], processes: int) -> Iterator[tuple[int, Figures]]:
    """(number of the job, its figures) as they are finished."""
    # Spawned, not forked: nothing of this process can be in their way.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(processes, len(jobs)), mp_context=context)
    try:
        numbers: dict[Future[Figures], int] = {pool.submit(run_job, job): k for k, job in enumerate(jobs)}
        for future in as_completed(numbers):
            number = numbers[future]
            try:
                yield number, future.result()
            except BrokenProcessPool:
                yield (
                    number,
                    failed(jobs[number], f"{jobs[number].log}: its process was killed; is there memory?"),
                )
    finally:
        pool.shutdown(cancel_futures=True)


def together(results: Sequence[Figures], took_s: float) -> Figures:
    """The figures of all logs: sums, and each log's own as `logs`, in their order."""
    good = [result for result in results if "error" not in result]
    rejected: Counter[str] = Counter()
    for result in good:
        rejected.update(result["rejected"])
    sums = {key: sum(result[key] for result in good) for key in SUMMED}
    return {
        **sums,
        "rejected": dict(sorted(rejected.items())),
        "realtime_factor": round(sums["seconds"] / took_s, 2) if took_s > 0.0 else None,
        "broken": len(results) - len(good),
        "logs": list(results),
    }
