"""The camera file: intrinsics and depth scale as one small JSON object.

    {"width": 640, "height": 480, "fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5,
     "depth_scale": 0.001, "distortion": [0.1, -0.2, 0.0, 0.0, 0.05]}

`depth_scale` is metres per unit of the 16-bit depth images (0.001, millimetres, where it is
absent); `distortion` is OpenCV's (k1, k2, p1, p2, k3) and may be absent or shorter.
"""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from planegrasp.errors import CameraError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.atomic import write_atomically
from planegrasp.io.images import MILLIMETRES


class _CameraFile(BaseModel):
    """What the file holds; unknown keys are refused, so that a misspelt one is noticed."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    width: int = Field(strict=True)
    height: int = Field(strict=True)
    fx: float = Field(strict=True)
    fy: float = Field(strict=True)
    cx: float = Field(strict=True)
    cy: float = Field(strict=True)
    depth_scale: float = Field(default=MILLIMETRES, gt=0, strict=True)
    distortion: list[float] = Field(default_factory=list)


def read_camera(path: str | Path) -> tuple[PinholeCamera, float]:
    """Read a camera file.

    Returns:
        The camera, and the depth scale [metres per unit of a depth image].

    Raises:
        SourceError: the file is missing or not JSON, a key is missing, unknown or of a wrong type.
        CameraError: the values are those of no camera.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SourceError(f"there is no camera file {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"camera file {path} cannot be read: {error}") from error
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise SourceError(f"camera file {path} is not JSON: {error}") from error
    try:
        parsed = _CameraFile.model_validate(content)
    except ValidationError as error:
        raise SourceError(f"camera file {path}: {_explain(error)}") from error
    values = parsed.model_dump(exclude={"depth_scale"})
    try:
        return PinholeCamera(**values), parsed.depth_scale
    except CameraError as error:
        raise CameraError(f"camera file {path}: {error}") from error


def write_camera(path: str | Path, camera: PinholeCamera, depth_scale: float = MILLIMETRES) -> None:
    """Write a camera file atomically; `read_camera` gives back exactly the same values.

    Raises:
        CameraError: depth_scale is not positive.
        OSError: the file cannot be written.
    """
    try:
        content = _CameraFile(
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
            depth_scale=depth_scale,
            distortion=list(camera.distortion),
        )
    except ValidationError as error:
        raise CameraError(_explain(error)) from error
    write_atomically(path, (content.model_dump_json(indent=1) + "\n").encode())


def _explain(error: ValidationError) -> str:
    """The faults on one line: each with its key, what is wrong, and what was received."""
    faults = []
    for fault in error.errors():
        key = ".".join(str(part) for part in fault["loc"]) or "the file"
        if fault["type"] == "missing":
            faults.append(f"{key} is missing")
        elif fault["type"] == "extra_forbidden":
            known = ", ".join(_CameraFile.model_fields)
            faults.append(f"{key} is not a known key (known: {known})")
        else:
            faults.append(f"{key}: {fault['msg'].lower()}, got {fault['input']!r}")
    return "; ".join(faults)
