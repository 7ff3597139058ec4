"""`planegrasp grasp plan`: which grasp the robot can do where the object is now, and why not."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import (
    JsonOption,
    LibraryOption,
    console,
    messages,
    pose_row,
    print_json,
)
from planegrasp.cli.grasp_options import (
    BaseFrameOption,
    CameraFrameOption,
    ExcludeJointsOption,
    FingerJointsOption,
    GripperFrameOption,
    HomeOption,
    ObjectArgument,
    RobotOption,
    base_object,
    read_robot,
)
from planegrasp.cli.grasp_tables import numbers
from planegrasp.errors import InvalidInputError, PoseError

if TYPE_CHECKING:
    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.plan import GraspPlan, GraspRefusal
    from planegrasp.library import ObjectLibrary
    from planegrasp.robot.model import Robot


def plan(
    object_name: ObjectArgument,
    *,
    pose: Annotated[
        Path | None,
        typer.Option(
            help="TOML or JSON with T_base_object; with --image T_base_camera.", show_default=False
        ),
    ] = None,
    image: Annotated[
        Path | None, typer.Option(help="Image in which the object is looked for.")
    ] = None,
    depth: Annotated[Path | None, typer.Option(help="Depth image of the image.")] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera file of the image (JSON).")] = None,
    robot: RobotOption = "pr2",
    gripper_frame: GripperFrameOption = None,
    base_frame: BaseFrameOption = None,
    camera_frame: CameraFrameOption = None,
    finger_joints: FingerJointsOption = None,
    exclude_joints: ExcludeJointsOption = None,
    home: HomeOption = None,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """Plan to grasp an object: the best grasp that the arm can do, or why it can do none.

    The arm starts at home, nothing is in its way but itself and the object. Exit code 1 where every
    grasp is refused. Needs the extra `robot`.

        planegrasp grasp plan book --pose now.toml

        planegrasp grasp plan book --image color.png --depth depth.png --camera camera.json --json

    Where the camera was is in --pose; without, it is the robot's own camera at home.
    """
    from planegrasp.grasping.planner import GraspPlanner
    from planegrasp.library import ObjectLibrary

    machine = read_robot(
        robot,
        gripper_frame=gripper_frame,
        base_frame=base_frame,
        camera_frame=camera_frame,
        finger_joints=finger_joints,
        exclude_joints=exclude_joints,
        home=home,
    )
    objects = ObjectLibrary(library)
    model = objects[object_name]
    planner = GraspPlanner(machine)
    if image is not None:
        detection = _seen(objects, object_name, image, depth, camera)
        result = planner.plan(detection, _camera_pose(pose, machine))
    elif pose is None:
        raise InvalidInputError("where is the object? Give --pose FILE, or --image FILE")
    elif depth is not None or camera is not None:
        raise InvalidInputError("--depth and --camera go with --image")
    else:
        result = planner.plan_at(model, base_object(pose))
    if as_json:
        print_json(_row(result, machine))
    else:
        _print(result)
    if result.refused:
        raise typer.Exit(1)


def _seen(
    objects: ObjectLibrary, name: str, image: Path, depth: Path | None, camera: Path | None
) -> Detection:
    """The object in an image."""
    from planegrasp.detector import Detector
    from planegrasp.io.sources import open_source

    frame = next(iter(open_source(image, camera=camera, depth=depth)))
    with messages().status("learning the objects …"):
        detector = Detector(objects)
    report = detector.explain(frame)
    for detection in report.detections:
        if detection.name == name:
            return detection
    reasons = "; ".join(f"{f.face}: {f.reason}" for f in report.faces if f.object == name)
    raise PoseError(f"{name!r} was not found in {image}: {reasons}")


def _camera_pose(path: Path | None, robot: Robot) -> RigidTransform:
    """T_base_camera of a pose file, or the robot's own at home."""
    from planegrasp.io.pose_file import read_poses

    if path is None:
        return robot.T_base_camera(robot.home)
    T_base_camera = read_poses(path).T_base_camera
    if T_base_camera is None:
        raise InvalidInputError(f"{path} does not say where the camera was: give T_base_camera")
    return T_base_camera


def _print(result: GraspPlan | GraspRefusal) -> None:
    out = console()
    if result.refused:
        out.print(f"[bold]{result.name}[/] cannot be grasped: {result.reason}", soft_wrap=True)
    else:
        figures = result.assessments[0].figures
        out.print(f"[bold]{result.name}[/] by grasp {result.grasp.name!r}", soft_wrap=True)
        for what, T in (("pre-grasp", result.T_base_pregrasp), ("grasp", result.T_base_gripper)):
            out.print(f"  {what:<10} gripper at {_place(T)}", soft_wrap=True)
        out.print(
            f"  {'arm':<10} limits {figures['limit_margin']:.2f} of the range away, "
            f"manipulability {figures['manipulability']:.3f}",
            soft_wrap=True,
        )
        out.print(
            f"  {'fingers':<10} {1000 * result.opening:.1f} mm apart, close with {result.force:g} N"
        )
    for name, reason in result.reasons.items():
        out.print(f"  {'not':<10} {name!r}: {reason}", soft_wrap=True)


def _place(T: RigidTransform) -> str:
    from planegrasp.geometry import euler_from_rotation

    angles = numbers(map(math.degrees, euler_from_rotation(T.rotation)), 1)
    return f"{numbers(T.translation, 3)} m, roll, pitch, yaw {angles}°"


def _row(result: GraspPlan | GraspRefusal, robot: Robot) -> dict[str, object]:
    row: dict[str, object] = {
        "object": result.name,
        "refused": result.refused,
        "assessments": [
            {
                "grasp": a.grasp,
                "accepted": a.accepted,
                "reason": a.reason,
                "score": a.score,
                "figures": dict(a.figures),
            }
            for a in result.assessments
        ],
    }
    if result.refused:
        return {**row, "reason": result.reason}
    return {
        **row,
        "grasp": result.grasp.name,
        "T_base_object": pose_row(result.T_base_object),
        "T_base_gripper": pose_row(result.T_base_gripper),
        "T_base_pregrasp": pose_row(result.T_base_pregrasp),
        "euler": result.euler,
        "opening": result.opening,
        "force": result.force,
        "joints": robot.arm_joints,
        "move": result.move.q.tolist(),
        "reach": result.reach.q.tolist(),
        "lift": result.lift.q.tolist(),
    }
