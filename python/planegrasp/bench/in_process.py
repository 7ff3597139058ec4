"""Measurements in a process of their own: the core reads its number of threads when it starts."""

from __future__ import annotations

import multiprocessing
import os
from typing import TYPE_CHECKING, TypeVar, cast

import cv2

from planegrasp.errors import PlanegraspError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

Result = TypeVar("Result")


def in_process(
    threads: int, work: Callable[[Callable[[], None]], Result], advance: Callable[[], None]
) -> Result:
    """Do some work in a new process with a number of threads, 0 = all.

    Args:
        threads: of the core and of OpenCV.
        work: can be pickled; it gets a function to call after each step.
        advance: called here after each step there.

    Raises:
        PlanegraspError: the process ended without a result.
    """
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    before = os.environ.get("RAYON_NUM_THREADS")
    os.environ["RAYON_NUM_THREADS"] = str(threads)
    try:
        process = context.Process(target=_worker, args=(sender, threads, work))
        process.start()
    finally:
        if before is None:
            del os.environ["RAYON_NUM_THREADS"]
        else:
            os.environ["RAYON_NUM_THREADS"] = before
    sender.close()
    try:
        while (result := receiver.recv()) is None:
            advance()
    except EOFError:
        process.join()
        raise PlanegraspError(
            f"the measuring process ended with exit code {process.exitcode}"
        ) from None
    process.join()
    return cast("Result", result)


def _worker(sender: Connection, threads: int, work: Callable[[Callable[[], None]], object]) -> None:
    """Send None after each step, then the result."""
    if threads:
        cv2.setNumThreads(threads)
    sender.send(work(lambda: sender.send(None)))
