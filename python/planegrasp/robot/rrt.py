"""RRT-Connect by OMPL, the same for the same seed."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from ompl import base, geometric, util

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]

# OMPL has one generator of seeds for the whole process.
_OMPL = threading.Lock()
_SHORTENINGS = 3


# So many attempts in vain, and another one will hardly find a path.
_HOPELESS = 2


def find_waypoints(
    is_free: Callable[[Float64Array], bool],
    start: Float64Array,
    goal: Float64Array,
    *,
    lower: Float64Array,
    upper: Float64Array,
    resolution: float,
    time_limit: float,
    most_checks: int,
    attempts: int,
    seed: int,
) -> Float64Array | None:
    """Corners of a free polygonal path, the shortest of several; None without.

    Args:
        is_free: whether joint positions (n) touch nothing.
        start: n, free and within limits.
        goal: n, likewise.
        lower: of the space that is searched, n.
        upper: of it, n. Joints that turn without end are searched like others, between limits that
            are a turn or more apart: whole turns away lies the same again.
        resolution: Euclidean distance of the points checked between corners [rad].
        time_limit: after which no further attempt begins [s]; an attempt may take as long, too.
        most_checks: postures that are checked in an attempt before it is given up.
        attempts: number of paths to choose from; no more are looked for after two in vain.
        seed: ≥ 0.
    """
    if seed < 0:
        raise InvalidInputError(f"a seed must be ≥ 0, got {seed}")
    shortest: Float64Array | None = None
    length, failures = np.inf, 0
    end = time.monotonic() + time_limit
    for attempt in range(attempts):
        left = end - time.monotonic()
        if left <= 0:
            break
        with _OMPL, _quiet():
            # OMPL takes a seed of 0 for "any".
            util.RNG.setSeed(1 + (seed * 1_000_003 + attempt) % (2**31 - 2))
            corners = _plan(
                is_free=is_free,
                start=start,
                goal=goal,
                lower=lower,
                upper=upper,
                resolution=resolution,
                time_limit=left,
                most_checks=most_checks,
            )
        if corners is None:
            failures += 1
            if failures == _HOPELESS:
                break
            continue
        candidate = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
        if candidate < length:
            shortest, length = corners, candidate
    return shortest


def _plan(
    *,
    is_free: Callable[[Float64Array], bool],
    start: Float64Array,
    goal: Float64Array,
    lower: Float64Array,
    upper: Float64Array,
    resolution: float,
    time_limit: float,
    most_checks: int,
) -> Float64Array | None:
    n, checks = len(start), 0
    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    for i in range(n):
        bounds.setLow(i, float(lower[i]))
        bounds.setHigh(i, float(upper[i]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def is_valid(state: base.State) -> bool:
        nonlocal checks
        checks += 1
        return is_free(np.array(state[0:n]))

    setup.setStateValidityChecker(is_valid)
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    states = []
    for q in (start, goal):
        state = space.allocState()
        state[0:n] = q.tolist()
        states.append(state)
    setup.setStartAndGoalStates(*states)
    setup.setPlanner(geometric.RRTConnect(information))
    in_time = base.timedPlannerTerminationCondition(time_limit)
    in_checks = base.PlannerTerminationCondition(lambda: checks >= most_checks)
    setup.solve(base.plannerOrTerminationCondition(in_time, in_checks))
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    simplifier = geometric.PathSimplifier(information)
    for _ in range(_SHORTENINGS):
        simplifier.reduceVertices(path)
        simplifier.partialShortcutPath(path)
    simplifier.collapseCloseVertices(path)
    corners = [path.getState(i)[0:n] for i in range(path.getStateCount())]
    return np.array(corners, dtype=np.float64)


@contextmanager
def _quiet() -> Iterator[None]:
    """OMPL reports on the standard output unless told otherwise."""
    level = util.getLogLevel()
    util.setLogLevel(util.LOG_NONE)
    try:
        yield
    finally:
        util.setLogLevel(level)
