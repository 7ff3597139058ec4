"""What the commands of `planegrasp grasp` share: arguments, robots, pose files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.geometry import RigidTransform
    from planegrasp.objects import ObjectModel
    from planegrasp.robot.model import Robot

ObjectArgument = Annotated[str, typer.Argument(metavar="OBJECT", help="In the library.")]
NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Of the grasp.")]
RobotOption = Annotated[
    str, typer.Option("--robot", help="pr2, or an MJCF or URDF file.", metavar="pr2|FILE")
]
GripperFrameOption = Annotated[
    str | None,
    typer.Option(help="Of a FILE: body or site that grasps, x out of the palm.", metavar="NAME"),
]
BaseFrameOption = Annotated[
    str | None, typer.Option(help="Of a FILE: body or site that poses refer to.", metavar="NAME")
]
CameraFrameOption = Annotated[
    str | None, typer.Option(help="Of a FILE: the camera's optical frame.", metavar="NAME")
]
FingerJointsOption = Annotated[
    str | None,
    typer.Option(
        help="Of a FILE: closed at their lower limit, open at the upper one.", metavar='"NAME,…"'
    ),
]
ExcludeJointsOption = Annotated[
    str | None,
    typer.Option(help="Of a FILE: between base and gripper, not to be moved.", metavar='"NAME,…"'),
]
HomeOption = Annotated[
    str | None, typer.Option(help="Of a FILE: keyframe from which it starts.", metavar="NAME")
]


def read_robot(
    robot: str,
    *,
    gripper_frame: str | None,
    base_frame: str | None,
    camera_frame: str | None,
    finger_joints: str | None,
    exclude_joints: str | None,
    home: str | None,
) -> Robot:
    """The robot of the options.

    Raises:
        MissingExtraError: the extra `robot` is not installed.
        InvalidInputError: the options of a file are given for the PR2, or the gripper's frame and
            fingers are not given for a file.
        RobotError: the file cannot be read, or lacks what is named.
    """
    from planegrasp.robot import Robot

    given = {
        "--gripper-frame": gripper_frame,
        "--base-frame": base_frame,
        "--camera-frame": camera_frame,
        "--finger-joints": finger_joints,
        "--exclude-joints": exclude_joints,
        "--home": home,
    }
    if robot == "pr2":
        extra = [option for option, value in given.items() if value is not None]
        if extra:
            raise InvalidInputError(f"{extra[0]} is for a robot from a file, and --robot is pr2")
        return Robot.pr2()
    if gripper_frame is None or finger_joints is None:
        missing = "--gripper-frame" if gripper_frame is None else "--finger-joints"
        raise InvalidInputError(f"what grasps? A robot from a file needs {missing}")
    return Robot.from_file(
        robot,
        gripper_frame=gripper_frame,
        base_frame=base_frame or "world",
        camera_frame=camera_frame,
        finger_joints=_names(finger_joints),
        exclude_joints=_names(exclude_joints),
        home=home,
    )


def base_object(path: Path) -> RigidTransform:
    """T_base_object of a pose file.

    Raises:
        SourceError: see `read_poses`.
        InvalidInputError: the file does not say where the object is.
    """
    from planegrasp.io.pose_file import read_poses

    T_base_object = read_poses(path).T_base_object
    if T_base_object is None:
        raise InvalidInputError(
            f"{path} does not say where the object is: give T_base_object, or T_base_camera and "
            f"T_camera_object"
        )
    return T_base_object


def remove_from(model: ObjectModel, name: str) -> list[str]:
    """Take a grasp and its variants off; their names."""
    gone = [g for g in model.grasps if g.name == name or g.name.startswith(f"{name}/")]
    model.grasps[:] = [g for g in model.grasps if g not in gone]
    return [grasp.name for grasp in gone]


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())
