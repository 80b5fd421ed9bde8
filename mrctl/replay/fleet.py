"""A fleet's worth of logs through Dask: a local cluster, or any scheduler that sees the same files."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator, Sequence
from types import ModuleType

from mrctl.errors import MrctlError
from mrctl.replay.many import Figures, Job, failed, run_job

CONNECT_S = 10


def on_a_cluster(jobs: Sequence[Job], scheduler: str | None, processes: int) -> Iterator[tuple[int, Figures]]:
    """(number of the job, its figures) as they are finished.

    scheduler: its address; None starts a cluster of so many processes here. Raises MrctlError without Dask or
    where the scheduler does not answer.
    """
    dask = _dask()
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            # No dashboard: it would open a port that nobody asked for.
            scheduler = stack.enter_context(
                dask.LocalCluster(
                    n_workers=min(processes, len(jobs)), threads_per_worker=1, dashboard_address=None
                )
            )
        try:
            client = stack.enter_context(dask.Client(scheduler, timeout=CONNECT_S))
        except (OSError, TimeoutError, ValueError) as error:
            why = " ".join(str(error).split())
            raise MrctlError(
                f"the scheduler {scheduler} cannot be reached: {why}; check its address"
            ) from error
        futures = client.map(run_job, jobs, pure=False)
        numbers = {future.key: k for k, future in enumerate(futures)}
        for future in dask.as_completed(futures):
            number = numbers[future.key]
            failure = future.exception()
            if failure is None:
                yield number, future.result()
            else:  # the worker died, or has another mrctl
                yield number, failed(jobs[number], f"{jobs[number].log}: {type(failure).__name__}: {failure}")
            future.release()


def _dask() -> ModuleType:
    """dask.distributed, untyped as it is. Raises MrctlError where the extra is not installed."""
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise MrctlError("dask.distributed is not installed; pip install 'mrctl[fleet]'") from None
