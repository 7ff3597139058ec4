"""One scene of a data set in the BOP format (Benchmark for 6D Object Pose Estimation).

`scene_camera.json` has per image number `cam_K` (the nine values of K, row by row) and
`depth_scale` (millimetres per unit); images are `rgb/NNNNNN.png` (or .jpg) and `depth/NNNNNN.png`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from planegrasp.errors import SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.images import MILLIMETRES
from planegrasp.io.sources.folder import paired_images
from planegrasp.io.sources.sequence import FrameFiles, ImageSequence, fixed_camera

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.io.sources.sequence import CameraForSize

CAMERA_LIST = "scene_camera.json"


class _ImageCamera(BaseModel):
    """What `scene_camera.json` says of one image; the world pose that it may add is not used."""

    K: Annotated[list[float], Field(alias="cam_K", min_length=9, max_length=9)]
    depth_scale: float = Field(default=1.0, gt=0)


_CAMERAS = TypeAdapter(dict[int, _ImageCamera])


def bop_scene(
    path: Path, camera: PinholeCamera | None = None, depth_scale: float | None = None
) -> ImageSequence:
    """Open a scene folder.

    Args:
        path: folder with `scene_camera.json`.
        camera: instead of each image's own, or None.
        depth_scale: metres per unit instead of each image's own, or None.

    Raises:
        SourceError: the camera list is damaged, or an image has no camera or no depth.
    """
    cameras = _read_cameras(path / CAMERA_LIST)
    if not (path / "rgb").is_dir():
        raise SourceError(f"{path} has {CAMERA_LIST} but no folder rgb/")
    depth = path / "depth"
    files = []
    for name, color_file, depth_file in paired_images(
        path / "rgb", depth if depth.is_dir() else None
    ):
        own = cameras.get(int(name)) if name.isdecimal() else None
        if own is None:
            raise SourceError(f"{path / CAMERA_LIST} has no camera for {color_file}")
        files.append(
            FrameFiles(
                name=name,
                color=color_file,
                depth=depth_file,
                camera=fixed_camera(camera) if camera else _camera_of(own.K),
                depth_scale=depth_scale or own.depth_scale * MILLIMETRES,
            )
        )
    return ImageSequence(path.name, files, camera)


def _camera_of(K: list[float]) -> CameraForSize:
    fx, _, cx, _, fy, cy = K[:6]
    return lambda width, height: PinholeCamera(width, height, fx, fy, cx, cy)


def _read_cameras(path: Path) -> dict[int, _ImageCamera]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SourceError(f"{path} cannot be read as JSON: {error}") from error
    try:
        return _CAMERAS.validate_python(content)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in fault["loc"])
        raise SourceError(
            f"{path}: {where}: {fault['msg'].lower()}, got {fault['input']!r}"
        ) from error
