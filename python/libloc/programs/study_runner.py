"""Runs the tasks of a study: here, in processes of a local cluster, or on the workers of a dask scheduler.

A task's result depends on the task alone, not on where and in which order tasks run.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import libloc

Task = TypeVar("Task")
Result = TypeVar("Result")

# Each worker is one process on one core: libraries with threads of their own would get in each other's way.
_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


class StudyError(Exception):
    """The study cannot run; the message says why."""


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def _without_interrupt() -> Iterator[None]:
    """Ctrl-C is ignored within, and by processes that are started within, which inherit that."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def _client(jobs: int, scheduler: str | None) -> Iterator[Any]:
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError as error:
        raise StudyError(
            f"runs in parallel need dask.distributed ({error}): pip install 'libloc[study]', or use --jobs 1"
        ) from error
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=10)
        except (OSError, ValueError) as error:
            raise StudyError(f"--scheduler {scheduler}: {error}") from error
        with client:
            versions = client.run(_version)
            if not versions:
                raise StudyError(f"--scheduler {scheduler}: it has no workers")
            for worker, version in versions.items():
                if version != libloc.__version__:
                    raise StudyError(f"worker {worker} has libloc {version}, this is {libloc.__version__}")
            yield client
        return
    with _without_interrupt():
        cluster = LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # any port that is free: a study may run beside another
            silence_logs=logging.CRITICAL,
            env=_ONE_THREAD,
        )
        client = Client(cluster)
        # The terminal sends Ctrl-C to all processes: this one answers it, and stops the workers.
        client.run(_ignore_interrupt)
    with cluster, client:
        yield client


def _ignore_interrupt() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _version() -> str:
    return libloc.__version__


def _distributed(
    function: Callable[[Task], Result], tasks: Sequence[Task], jobs: int, scheduler: str | None
) -> Iterator[tuple[Task, Result]]:
    with _client(jobs, scheduler) as client:
        from dask.distributed import as_completed

        futures = client.map(function, tasks, pure=False)
        task_of = dict(zip(futures, tasks, strict=True))
        try:
            for future in as_completed(futures):
                yield task_of[future], future.result()
        finally:
            client.cancel(futures)


def results(
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    jobs: int,
    scheduler: str | None,
) -> Iterator[tuple[Task, Result]]:
    """Each task with its result, as they come. function must be one that another process can import.

    jobs: processes; 1: this one. scheduler: address of a dask scheduler, instead of jobs. Raises StudyError,
    and whatever function raises.
    """
    if scheduler is None and (jobs == 1 or len(tasks) < 2):
        for task in tasks:
            yield task, function(task)
        return
    yield from _distributed(function, tasks, min(jobs, len(tasks)), scheduler)


@contextlib.contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[], None]]:
    """A bar on the error stream, where that is a terminal. Gives the function to call after every task."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    try:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
    except ImportError:
        print("no progress bar: pip install 'libloc[study]' for one", file=sys.stderr)
        yield lambda: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=total)
        yield lambda: bar.advance(task)
