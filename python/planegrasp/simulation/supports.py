"""What holds the object up until it is taken: a tripod, or a human hand."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot.scene import Obstacle
from planegrasp.simulation._dependencies import mujoco

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.body import BoxBody

    Float64Array = NDArray[np.float64]

SUPPORT = "support"
_PLATE_THICKNESS = 0.008
_STEEL = (0.22, 0.22, 0.24, 1.0)
_SKIN = (0.80, 0.60, 0.48, 1.0)
_SLEEVE = (0.25, 0.33, 0.50, 1.0)
_HOLDS: dict[str, tuple[int, int]] = {
    "left": (-1, 0),
    "right": (1, 0),
    "top": (0, 1),
    "bottom": (0, -1),
    "top-left": (-1, 1),
    "top-right": (1, 1),
    "bottom-left": (-1, -1),
    "bottom-right": (1, -1),
}

Hold = Literal[
    "left", "right", "top", "bottom", "top-left", "top-right", "bottom-left", "bottom-right"
]


@dataclass(frozen=True, slots=True)
class Tripod:
    """A slim pole on three legs, with a small plate at the back of the object.

    Attributes:
        pole_radius: [m].
        plate: width of the square plate [m].
        gap: between the object's back and the pole [m].
        lowered: where the plate is between the middle of the back (0) and its lowest edge (1).
    """

    pole_radius: float = 0.010
    plate: float = 0.04
    gap: float = 0.03
    lowered: float = 0.5

    def add_to(
        self, spec: mujoco.MjSpec, T_world_object: RigidTransform, body: BoxBody, floor: float
    ) -> None:
        """Put it behind an object as the body `SUPPORT`, in the world's frame.

        Args:
            spec: of the world.
            T_world_object: pose of the object.
            body: of the object.
            floor: height of the floor [m].
        """
        tripod = spec.worldbody.add_body(name=SUPPORT)
        plate, rods = self._parts(T_world_object, body, floor)
        _box(tripod, "plate", plate, (self.plate, self.plate, _PLATE_THICKNESS))
        for name, ends, radius in rods:
            _capsule(tripod, name, ends, radius, _STEEL)

    def obstacles(
        self, T_base_object: RigidTransform, body: BoxBody, floor: float
    ) -> tuple[Obstacle, ...]:
        """What a laboratory knows of its own tripod, where it sees the object.

        Args:
            T_base_object: pose of the object, as estimated; the base is upright.
            body: of the object.
            floor: height of the floor in the base frame [m].

        Returns:
            Boxes around the tripod's plate, neck, pole and legs, in the base frame.
        """
        plate, rods = self._parts(T_base_object, body, floor)
        boxes = [Obstacle("tripod-plate", (self.plate, self.plate, _PLATE_THICKNESS), plate)]
        for name, (start, end), radius in rods:
            along = end - start
            length = float(np.linalg.norm(along))
            turn = Rotation.align_vectors(along / length, [0.0, 0.0, 1.0])[0]
            pose = RigidTransform.from_components((start + end) / 2, turn)
            size = (2 * radius, 2 * radius, length + 2 * radius)
            boxes.append(Obstacle(f"tripod-{name}", size, pose))
        return tuple(boxes)

    def _parts(
        self, T_world_object: RigidTransform, body: BoxBody, floor: float
    ) -> tuple[RigidTransform, list[tuple[str, tuple[Float64Array, Float64Array], float]]]:
        """Pose of the plate; names, ends and radii of the rods; in a frame with z up."""
        down = T_world_object.rotation.inv().apply([0.0, 0.0, -1.0])[:2]
        half = np.array(body.size) / 2
        reach = np.linalg.norm(down)
        offset = np.zeros(2)
        if reach > 1e-6:
            # As far as the edge in that direction.
            to_edge = np.min(half[:2] / np.maximum(np.abs(down / reach), 1e-9))
            offset = self.lowered * to_edge * down / reach
        back = np.array([*offset, -half[2]]) + body.centre
        shift = RigidTransform.from_translation(back - (0.0, 0.0, _PLATE_THICKNESS / 2))
        neck = T_world_object.apply(back - np.array([0.0, 0.0, self.gap]))
        foot = np.array([neck[0], neck[1], floor])
        rods = [
            ("neck", (T_world_object.apply(back), neck), self.pole_radius),
            ("pole", (neck, foot), self.pole_radius),
        ]
        for i in range(3):
            angle = 2 * np.pi * i / 3
            spread = 0.18 * np.array([np.cos(angle), np.sin(angle), 0.0])
            ends = (foot + np.array([0.0, 0.0, 0.15]), foot + spread)
            rods.append((f"leg-{i}", ends, 0.007))
        return T_world_object * shift, rods


@dataclass(frozen=True, slots=True)
class Hand:
    """A hand that holds an edge or a corner: some fingers before the face, some behind.

    It is a mocap body: `World.move_support` says where it is. Its frame is the object's.

    Attributes:
        hold: where, as seen on the face.
        front: what lies before the face: the thumb, or the four fingers.
        reach: how far the fingertips and the thumb's tip reach over the object [m].
        along: the hand's place along a held edge, 0 in its middle, ±1 at its ends; no effect at a
            corner.

    Raises:
        InvalidInputError: there is no such hold, or the reach or the place is out of range.
    """

    hold: Hold = "bottom"
    front: Literal["thumb", "fingers"] = "thumb"
    reach: float = 0.06
    along: float = 0.0

    def __post_init__(self) -> None:
        if self.hold not in _HOLDS:
            raise InvalidInputError(
                f"a hand cannot hold {self.hold!r}; it can hold: {', '.join(_HOLDS)}"
            )
        if self.front not in ("thumb", "fingers"):
            raise InvalidInputError(f"before the face are 'thumb' or 'fingers', got {self.front!r}")
        if not 0.0 < self.reach <= 0.10:
            raise InvalidInputError(f"a hand reaches over 0 … 0.10 m, got {self.reach}")
        if not -1.0 <= self.along <= 1.0:
            raise InvalidInputError(f"the place along an edge is -1 … 1, got {self.along}")

    @property
    def direction(self) -> Float64Array:
        """Unit vector along the object's x and y from its middle to where the arm comes from."""
        signs = np.array(_HOLDS[self.hold], dtype=np.float64)
        return np.asarray(signs / np.linalg.norm(signs), dtype=np.float64)

    def add_to(
        self, spec: mujoco.MjSpec, T_world_object: RigidTransform, body: BoxBody, floor: float
    ) -> None:
        """Put it onto an object as the mocap body `SUPPORT`, see `Tripod.add_to`."""
        del floor
        hand = spec.worldbody.add_body(name=SUPPORT, mocap=True)
        _place(hand, T_world_object)
        T_object_hold, depth = self._frame(body)
        # In the frame of the hold: x from the edge outwards, z out of the face, y along the edge.
        side = 1.0 if self.front == "thumb" else -1.0
        front, back = side * depth / 2, -side * depth / 2
        thumb, finger = 0.0125, 0.0095

        def limb(name: str, points: ArrayLike, radius: float) -> None:
            line = T_object_hold.apply(np.asarray(points, dtype=np.float64))
            for i, ends in enumerate(pairwise(line)):
                _capsule(hand, f"{name}-{i}", ends, radius, _SKIN)

        z = back - side * (finger + 0.001)
        for i in range(4):
            y = 0.021 * (i - 1.5)
            reach = self.reach * (1.0, 1.12, 1.06, 0.85)[i]
            limb(f"finger-{i}", [[0.045, y, z], [-0.5 * reach, y, z], [-reach, y, z]], finger)
        z = front + side * (thumb + 0.001)
        limb("thumb", [[0.05, -0.02, 0.5 * z], [0.015, -0.015, z], [-self.reach, 0.0, z]], thumb)
        thickness = max(depth + 0.02, 0.03)
        palm = T_object_hold * RigidTransform.from_translation([0.055, 0.0, 0.0])
        _box(hand, "palm", palm, (0.07, 0.085, thickness), _SKIN, kind="ellipsoid")
        wrist = T_object_hold.apply([[0.075, 0.0, 0.0], [0.13, 0.0, -0.02], [0.40, 0.0, -0.14]])
        _capsule(hand, "wrist", (wrist[0], wrist[1]), 0.026, _SKIN)
        _capsule(hand, "forearm", (wrist[1], wrist[2]), 0.038, _SLEEVE)

    def _frame(self, body: BoxBody) -> tuple[RigidTransform, float]:
        """T_object_hold, and the thickness of the object there [m]."""
        signs = np.array(_HOLDS[self.hold], dtype=np.float64)
        half = np.array(body.size) / 2
        edge = signs * half[:2]
        outwards = self.direction
        if np.count_nonzero(signs) == 1:
            # The hand's half width stays on the edge.
            room = np.maximum(half[:2] - 0.04, 0.0)
            edge = edge + self.along * room * np.abs(outwards[::-1])
        origin = np.array([*edge, 0.0]) + body.centre
        turn = Rotation.from_euler("z", np.arctan2(outwards[1], outwards[0]))
        return RigidTransform.from_components(origin, turn), float(body.size[2])


Support = Tripod | Hand


def _place(thing: mujoco.MjsBody | mujoco.MjsGeom, T: RigidTransform) -> None:
    x, y, z, w = T.rotation.as_quat()
    thing.pos, thing.quat = T.translation, [w, x, y, z]


def _capsule(
    body: mujoco.MjsBody,
    name: str,
    ends: tuple[Float64Array, Float64Array],
    radius: float,
    rgba: tuple[float, ...],
) -> None:
    body.add_geom(
        name=f"{SUPPORT}:{name}",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=np.concatenate(ends),
        size=[radius, 0.0, 0.0],
        rgba=rgba,
    )


def _box(
    body: mujoco.MjsBody,
    name: str,
    T: RigidTransform,
    size: tuple[float, float, float],
    rgba: tuple[float, ...] = _STEEL,
    *,
    kind: Literal["box", "ellipsoid"] = "box",
) -> None:
    geom = body.add_geom(
        name=f"{SUPPORT}:{name}",
        type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"),
        size=np.array(size) / 2,
        rgba=rgba,
    )
    _place(geom, T)
