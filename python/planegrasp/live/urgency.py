"""Who waits for whom: what a frame's answer needs comes first, a search beside it second."""

from __future__ import annotations

import ctypes
import gc
import os
import platform
import sys
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["prompt", "step_back"]

# How much less of a busy processor a search gets: a tenth of what another thread has.
_NICE = 10
# A turn longer than what Linux gives by itself, 1 to 3 ms [ns].
_LONG_TURN = 10_000_000
# sched_setattr(2), which no library that Python comes with knows: its number differs.
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
# How long a thread of Python that waits for the interpreter lets another one go on [s].
_SHORT_TURN = 0.0005


class _Attributes(ctypes.Structure):
    """`struct sched_attr` of Linux, as sched_setattr(2) has it."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )


def step_back() -> None:
    """Let the calling thread come second, where there are not enough processors (Linux).

    It gets less of a processor that others want, and whoever wakes up need not wait for the end of
    its turn: since Linux 6.12 a thread is interrupted at once by those that ask for shorter turns.
    Where the system does not know of turns, it is only less urgent; elsewhere nothing happens.
    """
    with suppress(AttributeError, OSError):
        thread = threading.get_native_id()
        nice = max(_NICE, os.getpriority(os.PRIO_PROCESS, thread))
        if not _ask_for_long_turns(nice):
            os.setpriority(os.PRIO_PROCESS, thread, nice)


def _ask_for_long_turns(nice: int) -> bool:
    number = _SCHED_SETATTR.get(platform.machine())
    if number is None or not sys.platform.startswith("linux"):
        return False
    size = ctypes.sizeof(_Attributes)
    wanted = _Attributes(size=size, policy=os.SCHED_OTHER, nice=nice, runtime=_LONG_TURN)
    this_thread = 0
    syscall = ctypes.CDLL(None).syscall
    return bool(syscall(number, this_thread, ctypes.byref(wanted), 0) == 0)


@contextmanager
def prompt() -> Iterator[None]:
    """While frames are answered: short turns of Python's threads, and short collections.

    By default a thread that waits for the interpreter lets another one go on for 5 ms, longer than
    tracking takes; and a collection of all garbage looks at every object that was loaded, 20 ms.
    Both are settings of the whole process: this is for its main function.
    """
    turn = sys.getswitchinterval()
    sys.setswitchinterval(_SHORT_TURN)
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(turn)
