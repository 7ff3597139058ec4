"""The pose file: where object, gripper and camera are, as small TOML or JSON.

    T_base_object = {translation = [0.6, 0.1, 0.8], quaternion = [0.0, 0.0, 0.0, 1.0]}
    T_base_gripper = [[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.1], [0.0, 0.0, 1.0, 0.8],
                      [0.0, 0.0, 0.0, 1.0]]
    opening = 0.062

A pose is a translation [m] with a quaternion (x, y, z, w), or a 4×4 matrix. Instead of
`T_base_object` there may be `T_base_camera` and `T_camera_object`. Everything may be absent that
the reader does not need.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from planegrasp.errors import InvalidInputError, SourceError
from planegrasp.geometry import rigid_transform, transform_from_quaternion

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.geometry import RigidTransform

__all__ = ["Poses", "read_poses"]

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Triple = tuple[_Number, _Number, _Number]
_Quadruple = tuple[_Number, _Number, _Number, _Number]


class _Components(BaseModel):
    model_config = ConfigDict(extra="forbid")

    translation: _Triple
    quaternion: _Quadruple


_Pose = _Components | tuple[_Quadruple, _Quadruple, _Quadruple, _Quadruple]


class _PoseFile(BaseModel):
    """What the file holds; unknown keys are refused, so that a misspelt one is noticed."""

    model_config = ConfigDict(extra="forbid")

    T_base_object: _Pose | None = None
    T_base_camera: _Pose | None = None
    T_camera_object: _Pose | None = None
    T_base_gripper: _Pose | None = None
    opening: _Number | None = None
    approach: _Triple | None = None
    pregrasp_distance: _Number | None = None
    force: _Number | None = None


@dataclass(frozen=True, slots=True)
class Poses:
    """What a pose file says; None for what it does not.

    Attributes:
        T_base_object: pose of the object in the robot's base, also from the camera's.
        T_base_camera: pose of the camera's optical frame in the robot's base.
        T_base_gripper: pose of the gripper in the robot's base.
        how: what it says of opening, approach, pregrasp_distance and force, by name; see
            `CanonicalGrasp`.
    """

    T_base_object: RigidTransform | None
    T_base_camera: RigidTransform | None
    T_base_gripper: RigidTransform | None
    how: Mapping[str, object]


def read_poses(path: str | Path) -> Poses:
    """Read a pose file.

    Raises:
        SourceError: the file is missing, or neither TOML nor JSON; a key is unknown or has another
            type; a pose is not rigid; the object's pose is given twice, or by half.
    """
    path = Path(path)
    parsed = _parse(path)
    if parsed.T_camera_object is not None and parsed.T_base_camera is None:
        raise SourceError(f"pose file {path}: T_camera_object needs T_base_camera, too")
    if parsed.T_base_object is not None and parsed.T_base_camera is not None:
        raise SourceError(
            f"pose file {path}: give T_base_object, or T_base_camera and T_camera_object, not both"
        )
    T_base_object = _pose(path, parsed, "T_base_object")
    T_base_camera = _pose(path, parsed, "T_base_camera")
    T_camera_object = _pose(path, parsed, "T_camera_object")
    if T_base_camera is not None and T_camera_object is not None:
        T_base_object = T_base_camera * T_camera_object
    how = parsed.model_dump(
        include={"opening", "approach", "pregrasp_distance", "force"}, exclude_none=True
    )
    return Poses(T_base_object, T_base_camera, _pose(path, parsed, "T_base_gripper"), how)


def _parse(path: Path) -> _PoseFile:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SourceError(f"there is no pose file {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"pose file {path} cannot be read: {error}") from error
    is_json = path.suffix.lower() == ".json"
    try:
        content = json.loads(text) if is_json else tomllib.loads(text)
    except ValueError as error:
        kind = "JSON" if is_json else "TOML (for JSON call it .json)"
        raise SourceError(f"pose file {path} is not {kind}: {error}") from error
    try:
        return _PoseFile.model_validate(content)
    except ValidationError as error:
        raise SourceError(f"pose file {path}: {_explain(error)}") from error


def _explain(error: ValidationError) -> str:
    """The keys that are wrong, each once: a pose of neither form fails in both."""
    unknown = [e for e in error.errors() if e["type"] == "extra_forbidden" and len(e["loc"]) == 1]
    if unknown:
        known = ", ".join(_PoseFile.model_fields)
        return f"unknown key {unknown[0]['loc'][0]}; there are {known}"
    key = str(error.errors()[0]["loc"][0]) if error.errors()[0]["loc"] else "the file"
    if key.startswith("T_"):
        return (
            f"{key} must be a 4×4 matrix, or {{translation = [x, y, z], quaternion = [x, y, z, w]}}"
        )
    return f"{key}: {error.errors()[0]['msg'].lower()}, got {error.errors()[0]['input']!r}"


def _pose(path: Path, parsed: _PoseFile, key: str) -> RigidTransform | None:
    value: _Pose | None = getattr(parsed, key)
    if value is None:
        return None
    try:
        if isinstance(value, _Components):
            return transform_from_quaternion(value.translation, value.quaternion)
        return rigid_transform(value)
    except InvalidInputError as error:
        raise SourceError(f"pose file {path}: {key}: {error}") from error
