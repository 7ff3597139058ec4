"""What is taught: planar faces with their size, and objects made of one to six of them.

A face has two coordinate systems. On its reference image points are in *edge coordinates*: (0, 0)
is the outer corner of the first pixel, (w, h) that of the last, so a pixel's centre lies at index
+ ½. On the face itself they are in metres: x right, y up, z out of the face, origin at its centre.
`geometry.edge_from_pixel` and `PlanarFace.face_from_edge` are the only places that convert.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.body import BoxBody, body_behind
from planegrasp.checks import check_length, check_name
from planegrasp.errors import GraspError, InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.rgbd import check_color

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.rgbd import RGBDFrame

    Image = NDArray[np.uint8] | str | Path

__all__ = ["ObjectModel", "PlanarFace"]

_MOST_FACES = 6
# A pixel this much longer than wide on the object means a turned image or swapped sizes.
_LARGEST_PIXEL_ASPECT = 2.0


@dataclass(frozen=True, slots=True, eq=False, init=False)
class PlanarFace:
    """A flat, textured rectangle of known size.

    Attributes:
        name: of the face within its object, for example "front".
        image: H×W×3 uint8 RGB, read-only: the face seen straight on, filling the image.
        width: of the face along the image's rows [m].
        height: of the face along the image's columns [m].
        T_object_face: pose of the face (x right, y up, z out, origin at the centre) in the object.

    Raises:
        InvalidInputError: for a name that cannot be a file's name, a size that is not positive and
            finite, or a size that does not go with the image's aspect ratio.
        ImageError: the image is not H×W×3 uint8.
    """

    name: str
    image: NDArray[np.uint8]
    width: float
    height: float
    T_object_face: RigidTransform

    def __init__(
        self,
        name: str,
        image: NDArray[np.uint8],
        width: float,
        height: float | None = None,
        T_object_face: RigidTransform | None = None,
    ) -> None:
        """Make a face; height None takes the image's aspect ratio, no pose is the identity."""
        pixels = check_color(image).copy()
        pixels.flags.writeable = False
        rows, columns = pixels.shape[:2]
        width = check_length(width, f"width of face {name!r}")
        if height is None:
            height = width * rows / columns
        height = check_length(height, f"height of face {name!r}")
        pixel_aspect = (width / columns) / (height / rows)
        if not 1 / _LARGEST_PIXEL_ASPECT <= pixel_aspect <= _LARGEST_PIXEL_ASPECT:
            raise InvalidInputError(
                f"face {name!r} is {width:.4g} × {height:.4g} m but its image is "
                f"{columns}×{rows} pixels: is the image turned, or are width and height swapped? "
                f"(the image alone would make it {width * rows / columns:.4g} m high)"
            )
        if T_object_face is None:
            T_object_face = RigidTransform.identity()
        object.__setattr__(self, "name", check_name(name, "a face"))
        object.__setattr__(self, "image", pixels)
        object.__setattr__(self, "width", width)
        object.__setattr__(self, "height", height)
        object.__setattr__(self, "T_object_face", T_object_face)

    @property
    def face_from_edge(self) -> NDArray[np.float64]:
        """3×3 matrix from edge coordinates of the image to metres on the face (x right, y up)."""
        rows, columns = self.image.shape[:2]
        return np.array(
            [
                [self.width / columns, 0.0, -self.width / 2],
                [0.0, -self.height / rows, self.height / 2],
                [0.0, 0.0, 1.0],
            ]
        )

    @property
    def edge_from_face(self) -> NDArray[np.float64]:
        """3×3 matrix from metres on the face to edge coordinates, the inverse of the above."""
        rows, columns = self.image.shape[:2]
        return np.array(
            [
                [columns / self.width, 0.0, columns / 2],
                [0.0, -rows / self.height, rows / 2],
                [0.0, 0.0, 1.0],
            ]
        )

    @property
    def edge_corners(self) -> NDArray[np.float64]:
        """4×2 corners in edge coordinates: top-left, top-right, bottom-right, bottom-left."""
        rows, columns = self.image.shape[:2]
        return np.array([[0.0, 0.0], [columns, 0.0], [columns, rows], [0.0, rows]])

    @property
    def object_corners(self) -> NDArray[np.float64]:
        """4×3 corners in the object's frame [m], in the order of `edge_corners`."""
        x, y = self.width / 2, self.height / 2
        corners = np.array([[-x, y, 0.0], [x, y, 0.0], [x, -y, 0.0], [-x, -y, 0.0]])
        return np.asarray(self.T_object_face.apply(corners), dtype=np.float64)

    @property
    def image_digest(self) -> str:
        """SHA-256 of the image's size and pixels, in hexadecimal: the same for the same image."""
        digest = hashlib.sha256(f"{self.image.shape}".encode())
        digest.update(self.image.data)
        return digest.hexdigest()


@dataclass(frozen=True, slots=True, eq=False)
class ObjectModel:
    """A named object: one to six planar faces, rigidly connected.

    Attributes:
        name: of the object, unique in its library and usable as a folder's name.
        faces: the faces; a one-face object usually has its face at the identity.
        priority: which object to prefer where several could be grasped, larger first.
        body: outer box of the object in its frame; None derives `outer_body` from the faces.
        outer_body: `body`, or the box around all faces and what lies up to 5 mm behind them.
        grasps: ways to grasp it, a list of its own to append to and remove from; the library saves
            it. Names must be unique when it is saved.

    Raises:
        InvalidInputError: for a name that cannot be a folder's name, no faces or more than six, or
            two faces of one name.
    """

    name: str
    faces: tuple[PlanarFace, ...]
    priority: int = 0
    body: BoxBody | None = None
    grasps: list[CanonicalGrasp] = field(default_factory=list)
    outer_body: BoxBody = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name)
        object.__setattr__(self, "grasps", list(self.grasps))
        object.__setattr__(self, "faces", tuple(self.faces))
        if not 1 <= len(self.faces) <= _MOST_FACES:
            raise InvalidInputError(
                f"object {self.name!r} has {len(self.faces)} faces: it needs 1 to {_MOST_FACES}"
            )
        names = [face.name.lower() for face in self.faces]
        for face in self.faces:
            if names.count(face.name.lower()) > 1:
                raise InvalidInputError(
                    f"object {self.name!r} has two faces named {face.name!r} "
                    f"(upper and lower case count as the same)"
                )
        object.__setattr__(self, "outer_body", self.body or body_behind(self.faces))

    def face(self, name: str) -> PlanarFace:
        """The face of that name.

        Raises:
            InvalidInputError: the object has no such face; the message lists those it has.
        """
        for face in self.faces:
            if face.name == name:
                return face
        known = ", ".join(face.name for face in self.faces)
        raise InvalidInputError(f"object {self.name!r} has no face {name!r}; it has: {known}")

    def grasp(self, name: str) -> CanonicalGrasp:
        """The grasp of that name.

        Raises:
            GraspError: the object has no such grasp; the message lists those it has.
        """
        for grasp in self.grasps:
            if grasp.name == name:
                return grasp
        known = ", ".join(grasp.name for grasp in self.grasps) or "none was taught"
        raise GraspError(f"object {self.name!r} has no grasp {name!r}; it has: {known}")

    def with_face(self, face: PlanarFace) -> ObjectModel:
        """A copy that has this face too, in the place of one of the same name."""
        kept = tuple(other for other in self.faces if other.name.lower() != face.name.lower())
        return replace(self, faces=(*kept, face))

    @classmethod
    def from_image(
        cls,
        name: str,
        image: Image,
        width: float,
        height: float | None = None,
        *,
        face: str = "front",
        priority: int = 0,
        thickness: float | None = None,
    ) -> ObjectModel:
        """Teach a flat object from a photo of it, cropped to its outline and seen straight on.

        Args:
            name: of the object.
            image: H×W×3 uint8 RGB, or the path of an image file.
            width: of the object along the image's rows [m].
            height: along the columns [m]; None takes it from the image's aspect ratio.
            face: what to call the face.
            priority: see `ObjectModel`.
            thickness: of the object behind its face [m]; None where it is not known.

        Raises:
            ImageError: the image is missing, damaged or not H×W×3 uint8.
            InvalidInputError: see `PlanarFace`.
        """
        taught = PlanarFace(face, _load(image), width, height)
        return cls(name, (taught,), priority, _slab(taught, thickness))

    @classmethod
    def from_corners(
        cls,
        name: str,
        image: Image,
        corners: ArrayLike,
        width: float,
        height: float | None = None,
        *,
        camera: PinholeCamera | None = None,
        face: str = "front",
        priority: int = 0,
        thickness: float | None = None,
    ) -> ObjectModel:
        """Teach a flat object from a photo in which it is seen from anywhere.

        Args:
            name: of the object.
            image: H×W×3 uint8 RGB, or the path of an image file.
            corners: 4×2, the object's outer corners in the photo: top-left, top-right,
                bottom-right, bottom-left as printed on it; pixels, centres at integers.
            width: of the object, from top-left to top-right [m].
            height: from top-left to bottom-left [m]. None estimates it: exactly, up to the
                corners' noise, where the camera is given; else from the mean side lengths in the
                photo, which is right only for a photo taken about straight on.
            camera: that took the photo; its lens distortion is removed.
            face: what to call the face.
            priority: see `ObjectModel`.
            thickness: of the object behind its face [m]; None where it is not known.

        Raises:
            TeachingError: the corners are not a convex, unmirrored quadrilateral of a plausible
                size inside of the image.
            ImageError: the image is missing, damaged or not H×W×3 uint8.
            CameraError: the camera is for images of another size.
            InvalidInputError: see `PlanarFace`.
        """
        from planegrasp.teaching.rectify import rectify

        rectified = rectify(_load(image), corners, width, height, camera)
        taught = PlanarFace(face, rectified.image, rectified.width, rectified.height)
        return cls(name, (taught,), priority, _slab(taught, thickness))

    @classmethod
    def from_frame(
        cls,
        name: str,
        frame: RGBDFrame,
        corners: ArrayLike,
        *,
        face: str = "front",
        priority: int = 0,
        thickness: float | None = None,
    ) -> ObjectModel:
        """Teach a flat object from an RGB-D frame: its width and height are measured.

        Args:
            name: of the object.
            frame: colour with depth.
            corners: 4×2 observed pixels, as in `from_corners`.
            face: what to call the face.
            priority: see `ObjectModel`.
            thickness: of the object behind its face [m]; None where it is not known.

        Raises:
            TeachingError: the corners are not those of a rectangle, or the depth inside of them is
                too sparse or not flat.
        """
        from planegrasp.teaching.measure import measure_size

        width, height = measure_size(frame, corners)
        return cls.from_corners(
            name,
            frame.color,
            corners,
            width,
            height,
            camera=frame.camera,
            face=face,
            priority=priority,
            thickness=thickness,
        )

    @classmethod
    def box(
        cls,
        name: str,
        size: tuple[float, float, float],
        faces: Mapping[str, Image],
        *,
        priority: int = 0,
    ) -> ObjectModel:
        """Teach a box from straight photos of one to six of its sides.

        The object's origin is the box's centre; x points to its right, y up and z out of its front
        face. Each photo is upright as the box unfolds from its front: left, right and back with y
        up; the bottom edge of "top" and the top edge of "bottom" touch the front.

        Args:
            name: of the object.
            size: (width, height, depth) along x, y and z [m].
            faces: images by side, of `planegrasp.boxes.SIDES`.
            priority: see `ObjectModel`.

        Raises:
            InvalidInputError: for an unknown side, or a photo whose aspect ratio
                contradicts `size`.
        """
        from planegrasp.boxes import box_face_pose, box_face_size

        taught = tuple(
            PlanarFace(side, _load(image), *box_face_size(size, side), box_face_pose(size, side))
            for side, image in faces.items()
        )
        return cls(name, taught, priority, BoxBody(size))


def _slab(face: PlanarFace, thickness: float | None) -> BoxBody | None:
    return None if thickness is None else body_behind([face], thickness)


def _load(image: Image) -> NDArray[np.uint8]:
    if isinstance(image, (str, Path)):
        from planegrasp.io.images import read_color

        return read_color(Path(image))
    return check_color(image)
