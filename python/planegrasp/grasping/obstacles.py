"""What the depth camera sees around an object, as boxes to keep away from.

A hand that holds the object, a tripod, a shelf: whatever is measured near the object, and is
neither the object nor the robot, becomes an obstacle. The boxes lie along the object's axes, so
that they end at its sides, and can move along with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.grasping.cells import Grid, boxes_around
from planegrasp.grasping.hidden_fingers import hidden_fingers
from planegrasp.robot import frames
from planegrasp.robot.scene import Obstacle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.robot.model import Robot
    from planegrasp.robot.state import RobotState

    Points = NDArray[np.float64]

__all__ = ["ObstacleConfig", "holding", "obstacles_from_depth"]

# Cells grow by this until there are few enough boxes.
_COARSER = 1.4
# That many cells are around a body of one cell.
_LEAST_BOXES = 26


@dataclass(frozen=True, slots=True)
class ObstacleConfig:
    """What of the measured points counts, and how finely.

    Attributes:
        radius: around the middle of the object in which obstacles are looked for [m].
        depth_sigma: standard deviation of depth is this times its square [1/m]. The default is for
            a Kinect v1 with the quantisation of its disparity.
        sigmas: points that so many standard deviations of their depth may have moved off the object
            are taken for it.
        margin: so are those within this of the object in any direction: its pose and the pixels at
            its edges are not exact [m].
        robot_margin: points within this of the robot are taken for it [m].
        cell: edge of the cells in which points are counted and joined [m].
        share: of the pixels that a side of a cell fills when it faces the camera, so many must be
            measured in a cell for it to be more than noise,
        fewest: but no fewer than these.
        thickness: what is seen goes on behind its surface by this [m].
        edge: what is seen within so many pixels of the image's edge goes on beyond it, away from
            the object: an arm that holds it does [px],
        beyond: by so much, within the radius [m].
        fingers: a hand that holds the object has fingers over its edges, before and behind it, of
            which little or nothing is seen: they reach in by this from where the hand is seen [m].
            0 where nobody holds it.
        most: boxes, at least 26; where there are more, larger cells are joined.

    Raises:
        InvalidInputError: a value is out of its range.
    """

    radius: float = 0.60
    depth_sigma: float = 2.5e-3
    sigmas: float = 3.0
    margin: float = 0.006
    robot_margin: float = 0.03
    cell: float = 0.025
    share: float = 0.08
    fewest: int = 8
    thickness: float = 0.05
    edge: int = 8
    beyond: float = 0.25
    fingers: float = 0.0
    most: int = 80

    def __post_init__(self) -> None:
        for name in ("radius", "cell"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidInputError(f"{name} must be > 0 m, got {getattr(self, name)}")
        if self.most < _LEAST_BOXES:
            raise InvalidInputError(f"most must be ≥ {_LEAST_BOXES} boxes, got {self.most}")
        for name in self.__slots__:
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise InvalidInputError(f"{name} must be ≥ 0, got {getattr(self, name)}")


def obstacles_from_depth(
    frame: RGBDFrame,
    T_base_camera: RigidTransform,
    T_base_object: RigidTransform,
    body: BoxBody,
    *,
    robot: Robot | None = None,
    state: RobotState | None = None,
    config: ObstacleConfig | None = None,
) -> tuple[Obstacle, ...]:
    """Boxes around what is seen near an object, without the object and the robot.

    Args:
        frame: with depth; without there are no obstacles.
        T_base_camera: pose of the optical frame when the frame was taken.
        T_base_object: where the object was then.
        body: of the object.
        robot: that may be in the image; None where it is not.
        state: where its joints were; at home where None.
        config: what counts.

    Returns:
        Obstacles "seen-0", "seen-1", …, none of which reaches into the object's body.
    """
    config = config or ObstacleConfig()
    if not frame.has_depth:
        return ()
    T_camera_object = T_base_camera.inv() * T_base_object
    middle = T_camera_object.apply(np.asarray(body.centre))
    points = _measured(frame, middle, config.radius)
    points = points[~_may_be_object(points, T_camera_object, body, config)]
    if robot is not None:
        state = robot.home if state is None else state
        in_base = np.asarray(T_base_camera.apply(points))
        points = points[~_on_robot(in_base, robot, state, config.robot_margin)]
    points = _without_noise(points, frame.camera.fx, T_camera_object, body, config)
    points = np.concatenate([points, _out_of_view(points, frame.camera, middle, config)])
    solid = np.asarray(T_camera_object.inv().apply(_thick(points, config)))
    solid = np.concatenate([solid, hidden_fingers(solid, body, config.fingers)])
    solid = solid[~_inside(solid, body, 0.0)]
    if not len(solid):
        return ()
    low, high = _few_boxes(solid, body, config)
    middles = np.asarray(T_base_object.apply((low + high) / 2))
    # A single row of pixels has no width.
    sizes = np.maximum(high - low, 1e-3).tolist()
    return tuple(
        Obstacle(
            f"seen-{i}",
            (size[0], size[1], size[2]),
            RigidTransform.from_components(middles[i], T_base_object.rotation),
        )
        for i, size in enumerate(sizes)
    )


def holding(
    obstacles: Iterable[Obstacle], T_base_object: RigidTransform, body: BoxBody, gap: float = 0.03
) -> tuple[str, ...]:
    """Names of the obstacles that hold the object: they touch it, or what touches it, and so on.

    Args:
        obstacles: boxes along the object's axes, as `obstacles_from_depth` makes them.
        T_base_object: pose of the object.
        body: of the object.
        gap: boxes that are no farther apart touch, for what is not measured between them [m].
    """
    boxes = tuple(obstacles)
    T_object_base = T_base_object.inv()
    places = [(T_object_base * box.T_base_box).translation for box in boxes]
    centres = np.array([body.centre, *places])
    halves = np.array([body.size, *(box.size for box in boxes)]) / 2
    apart = np.abs(centres[:, None] - centres) - halves[:, None] - halves
    touches = np.all(apart <= gap, axis=2)
    held = touches[0]
    while True:
        grown = np.any(touches[held], axis=0)
        if np.array_equal(grown, held):
            return tuple(box.name for box, holds in zip(boxes, held[1:], strict=True) if holds)
        held = grown


def _measured(frame: RGBDFrame, middle: Points, radius: float) -> Points:
    """N×3 measured points within a radius of a point, camera frame."""
    assert frame.depth is not None
    # Zero is no measurement.
    near = (frame.depth > 0) & (np.abs(frame.depth - middle[2]) <= radius)
    rows, columns = np.nonzero(near)
    depth = frame.depth[rows, columns].astype(np.float64)
    rays = frame.camera.rays(np.column_stack([columns, rows]).astype(np.float64))
    points = rays * depth[:, None]
    return np.asarray(points[np.linalg.norm(points - middle, axis=1) <= radius])


def _may_be_object(
    points: Points, T_camera_object: RigidTransform, body: BoxBody, config: ObstacleConfig
) -> NDArray[np.bool_]:
    """Which points the noise of their depth may have moved off the object's body.

    The true point is somewhere on the line of sight; does that piece of it meet the body?
    """
    noise = config.sigmas * config.depth_sigma * points[:, 2:]
    T_object_camera = T_camera_object.inv()
    nearer = T_object_camera.apply(points * (1 - noise)) - np.asarray(body.centre)
    way = T_object_camera.apply(points * (1 + noise)) - np.asarray(body.centre) - nearer
    half = np.asarray(body.size) / 2 + config.margin
    # Where the line crosses the two planes of each pair of sides, 0 … 1 along the piece.
    way = np.where(np.abs(way) < 1e-12, 1e-12, way)
    crossings = np.stack([(-half - nearer) / way, (half - nearer) / way])
    enters = crossings.min(axis=0).max(axis=1)
    leaves = crossings.max(axis=0).min(axis=1)
    return np.asarray((enters <= leaves) & (enters <= 1.0) & (leaves >= 0.0))


def _inside(points: Points, body: BoxBody, margin: float) -> NDArray[np.bool_]:
    """Which points (object's frame) are within a margin of the body."""
    away = np.abs(points - np.asarray(body.centre)) - np.asarray(body.size) / 2
    return np.asarray(np.all(away < margin, axis=1))


def _on_robot(points: Points, robot: Robot, state: RobotState, margin: float) -> NDArray[np.bool_]:
    """Which points (base frame) are within a margin of the boxes around the robot's parts."""
    model = robot.model
    data = mujoco.MjData(model)
    data.qpos[:] = state.qpos
    mujoco.mj_kinematics(model, data)
    world = frames.world_pose(model, data, robot.base_frame).apply(points)
    found = np.zeros(len(points), dtype=bool)
    if not len(points):
        return found
    low, high = world.min(axis=0) - margin, world.max(axis=0) + margin
    for geom in np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE):
        # Most parts are far away.
        position, radius = data.geom_xpos[geom], model.geom_rbound[geom]
        if np.any(position + radius < low) or np.any(position - radius > high):
            continue
        local = (world - position) @ data.geom_xmat[geom].reshape(3, 3)
        centre, half = np.split(model.geom_aabb[geom], 2)
        found |= np.all(np.abs(local - centre) <= half + margin, axis=1)
    return found


def _without_noise(
    points: Points,
    focal_length: float,
    T_camera_object: RigidTransform,
    body: BoxBody,
    config: ObstacleConfig,
) -> Points:
    """The points (camera frame) in cells with enough of them."""
    grid = Grid.around(body, config.radius, config.cell)
    cells = grid.cells(np.asarray(T_camera_object.inv().apply(points)))
    inside = cells >= 0
    points, cells = points[inside], cells[inside]
    counts = np.bincount(cells, minlength=1)[cells]
    pixels = (config.cell * focal_length / points[:, 2]) ** 2
    return points[counts >= np.maximum(config.share * pixels, config.fewest)]


def _out_of_view(
    points: Points, camera: PinholeCamera, middle: Points, config: ObstacleConfig
) -> Points:
    """What of the points (camera frame) at the image's edge goes on beyond it, as more points."""
    pixels = camera.project(points)
    inside = np.minimum(pixels, (camera.width - 1, camera.height - 1) - pixels).min(axis=1)
    last = points[inside < config.edge]
    away = last - middle
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    steps = math.ceil(config.beyond / (config.cell / 2))
    ways = np.linspace(0.0, config.beyond, steps + 1)[1:]
    further = np.concatenate([np.empty((0, 3)), *(last + way * away for way in ways)])
    return np.asarray(further[np.linalg.norm(further - middle, axis=1) <= config.radius])


def _thick(points: Points, config: ObstacleConfig) -> Points:
    """The points, and others behind them along their lines of sight, no farther than a cell."""
    steps = math.ceil(config.thickness / (config.cell / 2))
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    depths = np.linspace(0.0, config.thickness, steps + 1)
    return np.concatenate([points + depth * rays for depth in depths])


def _few_boxes(points: Points, body: BoxBody, config: ObstacleConfig) -> tuple[Points, Points]:
    """Boxes around points (object's frame), lowest and highest corners."""
    size = config.cell
    while True:
        reach = config.radius + config.thickness + size
        low, high = boxes_around(points, Grid.around(body, reach, size))
        if len(low) <= config.most:
            return low, high
        size *= _COARSER
