"""When the objects of a rendered stream go away and come back."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.scenes import facing_pose
from planegrasp.bench.stream_covers import Sheet, board
from planegrasp.bench.stream_motion import Move, Path, travel_time
from planegrasp.geometry import RigidTransform

if TYPE_CHECKING:
    from planegrasp.bench.stream_layout import Region, Side

__all__ = ["DISTANCE", "Absence", "Life", "live"]

# Of the plane in which the objects rest [m].
DISTANCE = 0.8
# Tilt at rest against the line of sight [rad]; a hand turns it further.
_LARGEST_TILT = np.radians(25.0)
# How long an object stays before it goes away [s], and how long it is hidden [s].
_STAY = (1.5, 3.0)
_HIDDEN = (0.3, 1.0)
# How long the stream goes on at least after the last object has come back [s].
_AFTER = 0.5
# Greatest speed of an object that goes or comes, and of a board before it [m/s].
_SPEED = (0.4, 1.0)


@dataclass(frozen=True, slots=True)
class Absence:
    """An object is away for a while; frames are counted from 0.

    Attributes:
        name: of the object.
        behind_board: whether a board hides it; otherwise it leaves the image.
        leaves: the last frame before it, or the board, begins to move.
        hidden: the first frame in which nothing of it is seen.
        appears: the first frame in which something of it may be seen again.
        returned: the first frame in which it is in its new place, or the board gone.
    """

    name: str
    behind_board: bool
    leaves: int
    hidden: int
    appears: int
    returned: int


@dataclass(frozen=True, slots=True)
class Life:
    """What happens to one object.

    Attributes:
        path: where it is held, T_camera_object but for the hand's own motion.
        absences: when it is away.
        boards: those that hide it, in the order of time.
    """

    path: Path
    absences: tuple[Absence, ...]
    boards: tuple[Sheet, ...]


@dataclass(frozen=True, slots=True)
class _Event:
    """An absence: when it begins, hides, shows and ends [s], and what moves."""

    times: tuple[float, float, float, float]
    moves: tuple[Move, ...]
    board: Sheet | None = None


def live(
    name: str,
    region: Region,
    radius: float,
    rng: np.random.Generator,
    *,
    seconds: float,
    rate: int,
    leaving: bool,
) -> Life:
    """Draw what happens to an object.

    Args:
        name: of the object.
        region: of the image; the object is inside of it, or beyond borders of the image.
        radius: of a sphere about where it is held that it never leaves [m].
        rng: draws places, times and speeds.
        seconds: length of the stream; the last absence ends half a second before.
        rate: frames a second, to tell times in frames.
        leaving: whether it goes away, again and again.
    """
    first = rest = _rest(region, radius, rng)
    events: list[_Event] = []
    behind_board = bool(rng.integers(2))
    start = rng.uniform(*_STAY)
    while leaving:
        goal = _rest(region, radius, rng)
        draw = _behind_board if behind_board else _out_of_the_image
        event = draw(region, radius, (rest, goal), start, rng)
        if event.times[3] + _AFTER > seconds:
            break
        events.append(event)
        rest, behind_board = goal, not behind_board
        start = event.times[3] + rng.uniform(*_STAY)
    return Life(
        Path(first, tuple(move for event in events for move in event.moves)),
        tuple(
            Absence(
                name,
                event.board is not None,
                floor(event.times[0] * rate),
                ceil(event.times[1] * rate),
                floor(event.times[2] * rate) + 1,
                ceil(event.times[3] * rate),
            )
            for event in events
        ),
        tuple(event.board for event in events if event.board is not None),
    )


def _out_of_the_image(
    region: Region,
    radius: float,
    rests: tuple[RigidTransform, RigidTransform],
    start: float,
    rng: np.random.Generator,
) -> _Event:
    """The object leaves over one border and comes over any to another place."""
    sides = _sides(region, rng)
    speeds, hidden = rng.uniform(*_SPEED, 2), rng.uniform(*_HIDDEN)
    away, back = (
        _beyond(region, side, rest, radius, rng) for side, rest in zip(sides, rests, strict=True)
    )
    gone = start + travel_time(rests[0], away, speeds[0])
    appears = gone + hidden
    end = appears + travel_time(back, rests[1], speeds[1])
    moves = (Move(start, gone, rests[0], away), Move(appears, end, back, rests[1]))
    return _Event((start, gone, appears, end), moves)


def _behind_board(
    region: Region,
    radius: float,
    rests: tuple[RigidTransform, RigidTransform],
    start: float,
    rng: np.random.Generator,
) -> _Event:
    """A board comes before the object, which moves to another place until the board goes."""
    sides = _sides(region, rng)
    speeds, hidden = rng.uniform(*_SPEED, 2), rng.uniform(*_HIDDEN)
    sheet = board(
        region,
        rests,
        radius,
        over=sides,
        speeds=(speeds[0], speeds[1]),
        start=start,
        hidden=hidden,
    )
    come, go = sheet.path.moves
    moves = (Move(come.end, go.start, *rests),)
    return _Event((start, come.end, go.start, go.end), moves, sheet)


def _sides(region: Region, rng: np.random.Generator) -> tuple[Side, Side]:
    first, second = rng.integers(len(region.sides), size=2)
    return region.sides[first], region.sides[second]


def _rest(region: Region, radius: float, rng: np.random.Generator) -> RigidTransform:
    """A random place in the region, any roll, some tilt about any axis."""
    x, y = (rng.uniform(*region.bounds(axis, DISTANCE, radius)) for axis in (0, 1))
    tilt, axis, roll = rng.uniform((0, 0, 0), (_LARGEST_TILT, 2 * np.pi, 2 * np.pi))
    return facing_pose(np.array([x, y, DISTANCE]), tilt, axis, roll)


def _beyond(
    region: Region,
    side: Side,
    rest: RigidTransform,
    radius: float,
    rng: np.random.Generator,
) -> RigidTransform:
    """A random place beyond a border of the image that is reached without leaving the region."""
    place = rest.translation.copy()
    across = 1 - side.axis
    place[across] = rng.uniform(*region.bounds(across, DISTANCE, radius))
    # The image goes on a little beyond the region.
    place[side.axis] = region.outside(side, DISTANCE, radius) + 0.01 * side.sign
    return RigidTransform.from_components(place, rest.rotation)
