"""`planegrasp grasp teach`: by poses that were recorded, or in simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import (
    JsonOption,
    LibraryOption,
    console,
    grasp_row,
    parse_numbers,
    print_json,
)
from planegrasp.cli.grasp_options import (
    BaseFrameOption,
    CameraFrameOption,
    ExcludeJointsOption,
    FingerJointsOption,
    GripperFrameOption,
    HomeOption,
    NameArgument,
    ObjectArgument,
    RobotOption,
    read_robot,
    remove_from,
)
from planegrasp.cli.grasp_tables import numbers
from planegrasp.errors import GraspError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.io.pose_file import Poses
    from planegrasp.library import ObjectLibrary
    from planegrasp.objects import ObjectModel
    from planegrasp.robot.model import Robot

_MASS = 0.4  # of the simulated object; nothing falls while a grasp is shown [kg]


def teach(
    object_name: ObjectArgument,
    name: NameArgument,
    *,
    poses: Annotated[
        Path | None,
        typer.Option(
            help="TOML or JSON with T_base_object and T_base_gripper at one time, and opening.",
            show_default=False,
        ),
    ] = None,
    opening: Annotated[
        float | None,
        typer.Option(
            help="Between the fingertips while the gripper moves over the object, in metres.",
            show_default="of the file",
        ),
    ] = None,
    approach: Annotated[
        str | None,
        typer.Option(
            help="Unit vector in the gripper's frame along which it approaches.",
            metavar='"X,Y,Z"',
            show_default="1,0,0: out of the palm",
        ),
    ] = None,
    pregrasp_distance: Annotated[
        float | None,
        typer.Option(help="How far before the grasp it starts, in metres.", show_default="0.1"),
    ] = None,
    force: Annotated[
        float | None,
        typer.Option(help="With which the fingers close, in newtons.", show_default="40"),
    ] = None,
    symmetric: Annotated[
        str | None,
        typer.Option(
            help="What looks the same when turned by 180°: the **gripper** about the axis out of "
            "its palm, the object about its **x**, **y** or **z**. These variants are stored too.",
            metavar='"gripper,x,y,z"',
            show_default="nothing",
        ),
    ] = None,
    simulate: Annotated[
        bool,
        typer.Option(
            "--simulate",
            help="Show it in simulation: robot and object together, seen and recorded.",
        ),
    ] = False,
    side: Annotated[
        str,
        typer.Option(
            help="With --simulate: where the gripper takes the object.",
            metavar="side|top|left|bottom",
        ),
    ] = "side",
    robot: RobotOption = "pr2",
    gripper_frame: GripperFrameOption = None,
    base_frame: BaseFrameOption = None,
    camera_frame: CameraFrameOption = None,
    finger_joints: FingerJointsOption = None,
    exclude_joints: ExcludeJointsOption = None,
    home: HomeOption = None,
    unchecked: Annotated[
        bool,
        typer.Option("--unchecked", help="Accept a gripper that is inside of or off the object."),
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace a grasp taught before, and its variants.")
    ] = False,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """Teach a grasp by where object and gripper are at one time.

    The gripper's origin lies between its fingertips, x points out of its palm, and its fingers
    close along y. A grasp that has nothing between the fingers, or the object where a finger or the
    palm is, is refused.

        planegrasp grasp teach book side --poses shown.toml

        planegrasp grasp teach book side --poses shown.json --opening 0.03 --symmetric gripper,z

    Without a robot at hand one can be simulated (needs the extra `robot`): the object stands before
    its camera, the gripper holds it at its right **side**, from the **top**, at its **left** or
    from the **bottom**. The object is where the camera sees it, the gripper where the joints say.

        planegrasp grasp teach book from-above --simulate --side top
    """
    from planegrasp.grasping import check_against_body, symmetric_variants
    from planegrasp.io.pose_file import read_poses
    from planegrasp.library import ObjectLibrary

    if simulate == (poses is not None):
        raise InvalidInputError(
            "where are object and gripper? Give --poses FILE with T_base_object and "
            "T_base_gripper, or --simulate"
        )
    objects = ObjectLibrary(library)
    model = objects[object_name]
    asked = {
        "opening": opening,
        "approach": parse_numbers(approach, 3, "--approach") if approach else None,
        "pregrasp_distance": pregrasp_distance,
        "force": force,
    }
    if poses is not None:
        shown = _taught(name, read_poses(poses), poses, asked)
    else:
        machine = read_robot(
            robot,
            gripper_frame=gripper_frame,
            base_frame=base_frame,
            camera_frame=camera_frame,
            finger_joints=finger_joints,
            exclude_joints=exclude_joints,
            home=home,
        )
        shown = _simulated(
            name, library=objects, model=model, robot=machine, side=side, asked=asked
        )
    body = model.outer_body
    axes, flip = _symmetries(symmetric)
    taught = symmetric_variants(shown, flip=flip, axes=axes, centre=body.centre)
    for grasp in () if unchecked else taught:
        check_against_body(grasp, body)
    _store(model, taught, replace=replace)
    objects.save()
    if as_json:
        rows = [grasp_row(grasp) for grasp in taught]
        print_json({"library": str(library), "object": model.name, "grasps": rows})
        return
    for grasp in taught:
        place = numbers(1000 * grasp.T_object_gripper.translation, 1)
        console().print(
            f"[bold]{model.name}[/] {grasp.name}: gripper at {place} mm in the object, fingers "
            f"{1000 * grasp.opening:.1f} mm apart",
            soft_wrap=True,
        )
    console().print(f"saved in {library / model.name}", soft_wrap=True)


def _taught(name: str, poses: Poses, path: Path, asked: Mapping[str, object]) -> CanonicalGrasp:
    """The grasp of a pose file; what was asked for goes before what the file says."""
    from planegrasp.grasping import CanonicalGrasp

    if poses.T_base_object is None or poses.T_base_gripper is None:
        raise InvalidInputError(
            f"{path} must say where both are: T_base_object (or T_base_camera and "
            f"T_camera_object) and T_base_gripper"
        )
    how = {**poses.how} | {key: value for key, value in asked.items() if value is not None}
    if "opening" not in how:
        raise InvalidInputError(
            f"how far are the fingertips apart? Give --opening in metres, or opening in {path}"
        )
    return CanonicalGrasp.teach(
        name,
        poses.T_base_object,
        poses.T_base_gripper,
        **how,  # type: ignore[arg-type]  # each of its own type
    )


def _symmetries(text: str | None) -> tuple[list[str], bool]:
    """Axes of the object, and whether the gripper is symmetric."""
    words = [word.strip() for word in (text or "").split(",") if word.strip()]
    unknown = [word for word in words if word not in ("gripper", "x", "y", "z")]
    if unknown:
        raise InvalidInputError(f"--symmetric takes gripper, x, y and z, got {unknown[0]!r}")
    return [word for word in words if word != "gripper"], "gripper" in words


def _store(model: ObjectModel, taught: Sequence[CanonicalGrasp], *, replace: bool) -> None:
    name = taught[0].name
    present = {grasp.name.lower() for grasp in model.grasps}
    if replace:
        remove_from(model, name)
    elif present & {grasp.name.lower() for grasp in taught}:
        raise GraspError(
            f"object {model.name!r} has a grasp {name!r} already: --replace it, or choose another "
            f"NAME"
        )
    model.grasps.extend(taught)


def _simulated(
    name: str,
    *,
    library: ObjectLibrary,
    model: ObjectModel,
    robot: Robot,
    side: str,
    asked: Mapping[str, object],
) -> CanonicalGrasp:
    """A grasp that is shown in simulation, of an object that the whole library can be told from."""
    from planegrasp.cli.common import messages
    from planegrasp.detector import Detector
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.simulation.objects import Thing
    from planegrasp.simulation.showing import show_grasp

    with messages().status("learning the objects, then showing …"):
        shown = show_grasp(
            robot,
            Thing(model, _MASS),
            Detector(library),
            side,
            opening=asked["opening"],  # type: ignore[arg-type]  # a number or None
        )
    given = {key: value for key, value in asked.items() if value is not None}
    how = {"opening": shown.opening, **given}
    return CanonicalGrasp.teach(
        name,
        shown.T_base_object,
        shown.T_base_gripper,
        **how,  # type: ignore[arg-type]  # each of its own type
    )
