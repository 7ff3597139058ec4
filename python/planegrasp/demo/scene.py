"""Where the demonstration's objects are in each frame, and how an RGB-D camera sees them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import background
from planegrasp.boxes import SIDES, box_face_pose, box_face_size
from planegrasp.demo.objects import CARTON_SIZE
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.simulation import Rectangle, render

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

FRAMES_A_SECOND = 10.0
# The paper that passes in front: width, height and distance [m].
_PAPER = (0.11, 0.075, 0.42)
_CARDBOARD = (176, 141, 98)
_WALL = 2.0  # distance of the background [m]


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One rendered frame and what is exactly true of it.

    Attributes:
        frame: as the camera and its depth sensor see it, with their noise.
        truth: T_camera_object by object.
        tilt_deg: by object, the smallest angle between a printed side's normal and the line of
            sight to it.
        visible: by object, the share of that side, 0 … 1, that nothing hides.
    """

    frame: RGBDFrame
    truth: Mapping[str, RigidTransform]
    tilt_deg: Mapping[str, float]
    visible: Mapping[str, float]


def shots(models: Sequence[ObjectModel], frames: int, seed: int) -> Iterator[Shot]:
    """Render a sequence: the objects turn and move smoothly while a sheet of paper passes by."""
    garage = _four_to_three(background("motorcycle_left"))
    sheet = _brightened(background("text"))
    for i in range(frames):
        share = i / max(frames - 1, 1)
        truth = poses(share)
        things, owners = [], []
        for model in models:
            shown = rectangles(model, truth[model.name])
            things += shown
            owners += [model.name] * len(shown)
        printed = len(things)
        things += _plain_sides(truth["carton"])
        things.append(_paper(sheet, share))
        rendering = render(
            things,
            CAMERA,
            np.random.default_rng([seed, i]),
            background=garage,
            background_depth=_WALL,
            name=f"frame-{i:03d}",
        )
        tilts = [_tilt_deg(rectangle) for rectangle in things[:printed]]
        best = {
            name: min((j for j in range(printed) if owners[j] == name), key=lambda j: tilts[j])
            for name in truth
        }
        yield Shot(
            frame=replace(rendering.frame, timestamp=i / FRAMES_A_SECOND),
            truth=truth,
            tilt_deg={name: tilts[j] for name, j in best.items()},
            visible={name: rendering.visible[j] for name, j in best.items()},
        )


def poses(share: float) -> dict[str, RigidTransform]:
    """T_camera_object of every object at a share, 0 … 1, of the sequence."""
    turn = 2.0 * math.pi * share
    return {
        # Leans back to 65° and rises again, while its axis wanders.
        "astronaut": facing_pose(
            np.array([-0.23 + 0.03 * math.sin(turn), -0.09, 0.71 + 0.08 * math.sin(turn)]),
            tilt=math.radians(35.0 - 30.0 * math.cos(turn)),
            axis=math.radians(70.0 + 60.0 * share),
            roll=math.radians(-12.0 + 30.0 * share),
        ),
        # Comes near and goes away, nodding.
        "cat": facing_pose(
            np.array([0.21, -0.11 + 0.02 * math.cos(turn), 0.72 - 0.13 * math.sin(turn)]),
            tilt=math.radians(33.0 + 27.0 * math.cos(turn)),
            axis=math.radians(200.0 - 70.0 * share),
            roll=math.radians(8.0 * math.sin(turn)),
        ),
        # Turns about its upright axis, seen from above.
        "carton": _carton(
            position=np.array([0.01 + 0.04 * math.sin(turn), 0.13, 0.58]),
            yaw=math.radians(-32.0 + 23.0 * math.cos(turn)),
            pitch=math.radians(28.0),
        ),
    }


def _carton(position: NDArray[np.float64], yaw: float, pitch: float) -> RigidTransform:
    """A box seen from above by `pitch`, then turned about its own upright axis by `yaw`."""
    upright = facing_pose(position, tilt=0.0, axis=0.0, roll=0.0).rotation
    turned = upright * Rotation.from_euler("xy", [pitch, yaw])
    return RigidTransform.from_components(position, turned)


def _plain_sides(T_camera_carton: RigidTransform) -> list[Rectangle]:
    """The sides of the box that have no print."""
    texture = np.full((8, 8, 3), _CARDBOARD, np.uint8)
    return [
        Rectangle(
            texture,
            *box_face_size(CARTON_SIZE, side),
            T_camera_carton * box_face_pose(CARTON_SIZE, side),
        )
        for side in SIDES
        if side not in ("front", "right", "top")
    ]


def _paper(texture: NDArray[np.uint8], share: float) -> Rectangle:
    """A sheet of paper that passes from left to right in front of the pictures."""
    width, height, distance = _PAPER
    position = np.array([-0.36 + 0.74 * share, -0.02, distance])
    pose = facing_pose(position, tilt=math.radians(20.0), axis=math.radians(80.0), roll=-0.25)
    return Rectangle(texture, width, height, pose)


def _tilt_deg(rectangle: Rectangle) -> float:
    """Angle between the normal and the line of sight to the centre."""
    translation, rotation = rectangle.T_camera_rectangle.as_components()
    normal = rotation.as_matrix()[:, 2]
    cosine = float(-normal @ translation / np.linalg.norm(translation))
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def _brightened(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """As white as paper."""
    gain = 225.0 / float(np.median(image))
    return np.asarray(np.clip(gain * image, 0, 255), dtype=np.uint8)


def _four_to_three(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The middle of a wide photograph, in the camera's aspect ratio."""
    rows, columns = image.shape[:2]
    width = min(columns, round(rows * CAMERA.width / CAMERA.height))
    left = (columns - width) // 2
    return np.ascontiguousarray(image[:, left : left + width])
