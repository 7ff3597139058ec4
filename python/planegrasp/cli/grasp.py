"""`planegrasp grasp`: teach grasps, list and remove them, and adapt them to another pose."""

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
    pose_row,
    print_json,
)
from planegrasp.cli.grasp_tables import adapted_table, grasp_lines, grasps_table, numbers
from planegrasp.errors import GraspError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.io.pose_file import Poses
    from planegrasp.objects import ObjectModel

app = typer.Typer(
    help="Teach grasps of an object once, and adapt them to where it is.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)

ObjectArgument = Annotated[str, typer.Argument(metavar="OBJECT", help="In the library.")]
NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="Of the grasp.")]


@app.command()
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
    """
    from planegrasp.grasping import check_against_body, symmetric_variants
    from planegrasp.io.pose_file import read_poses
    from planegrasp.library import ObjectLibrary

    if poses is None:
        raise InvalidInputError(
            "where are object and gripper? Give --poses FILE with T_base_object and T_base_gripper"
        )
    objects = ObjectLibrary(library)
    model = objects[object_name]
    asked = {
        "opening": opening,
        "approach": parse_numbers(approach, 3, "--approach") if approach else None,
        "pregrasp_distance": pregrasp_distance,
        "force": force,
    }
    shown = _taught(name, read_poses(poses), poses, asked)
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


@app.command("list")
def list_(
    object_name: Annotated[
        str | None,
        typer.Argument(metavar="OBJECT", help="In the library.", show_default="all objects"),
    ] = None,
    *,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """List the grasps of one object or of all.

    planegrasp grasp list

    planegrasp grasp list book --json
    """
    from planegrasp.library import ObjectLibrary

    objects = ObjectLibrary(library)
    models = list(objects) if object_name is None else [objects[object_name]]
    if as_json:
        rows = [{"name": m.name, "grasps": [grasp_row(g) for g in m.grasps]} for m in models]
        print_json({"library": str(library), "objects": rows})
    elif any(model.grasps for model in models):
        console().print(grasps_table(models))
    else:
        console().print("no grasps; teach one with `planegrasp grasp teach`")


@app.command()
def show(
    object_name: ObjectArgument,
    name: NameArgument,
    *,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """Show one grasp with its pose in the object.

    planegrasp grasp show book side
    """
    from planegrasp.library import ObjectLibrary

    model = ObjectLibrary(library)[object_name]
    grasp = model.grasp(name)
    if as_json:
        print_json({"library": str(library), "object": model.name, **grasp_row(grasp)})
        return
    for line in grasp_lines(model, grasp):
        console().print(line, soft_wrap=True)


@app.command()
def remove(
    object_name: ObjectArgument,
    name: NameArgument,
    *,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """Remove a grasp, and the symmetric variants of it.

    planegrasp grasp remove book side
    """
    from planegrasp.library import ObjectLibrary

    objects = ObjectLibrary(library)
    model = objects[object_name]
    model.grasp(name)
    removed = _remove(model, name)
    objects.save()
    if as_json:
        print_json({"library": str(library), "object": model.name, "removed": removed})
    else:
        console().print(f"removed [bold]{', '.join(removed)}[/] of {model.name}", soft_wrap=True)


@app.command()
def adapt(
    object_name: ObjectArgument,
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="Of the grasp.", show_default="all of the object"),
    ] = None,
    *,
    pose: Annotated[
        Path,
        typer.Option(
            help="TOML or JSON with T_base_object, or with T_base_camera and T_camera_object.",
            show_default=False,
        ),
    ],
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """Print where the gripper goes when the object is at another pose.

    With --json also as matrices, and where the gripper starts before it approaches.

    planegrasp grasp adapt book --pose now.toml

    planegrasp grasp adapt book side --pose now.json --json
    """
    from planegrasp.io.pose_file import read_poses
    from planegrasp.library import ObjectLibrary

    model = ObjectLibrary(library)[object_name]
    grasps = model.grasps if name is None else [model.grasp(name)]
    if not grasps:
        raise GraspError(
            f"object {model.name!r} has no grasp: teach one with `planegrasp grasp teach`"
        )
    T_base_object = read_poses(pose).T_base_object
    if T_base_object is None:
        raise InvalidInputError(
            f"{pose} does not say where the object is: give T_base_object, or T_base_camera and "
            f"T_camera_object"
        )
    if not as_json:
        console().print(adapted_table(grasps, T_base_object))
        return
    rows = []
    for grasp in grasps:
        T_base_gripper = grasp.adapt(T_base_object)
        rows.append(
            {
                "name": grasp.name,
                "T_base_gripper": T_base_gripper.as_matrix().tolist(),
                **pose_row(T_base_gripper),
                "euler": grasp.euler(T_base_object),
                "T_base_pregrasp": grasp.pregrasp(T_base_object).as_matrix().tolist(),
                "opening": grasp.opening,
                "force": grasp.force,
            }
        )
    print_json({"object": model.name, "grasps": rows})


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
        _remove(model, name)
    elif present & {grasp.name.lower() for grasp in taught}:
        raise GraspError(
            f"object {model.name!r} has a grasp {name!r} already: --replace it, or choose another "
            f"NAME"
        )
    model.grasps.extend(taught)


def _remove(model: ObjectModel, name: str) -> list[str]:
    """Take a grasp and its variants off; their names."""
    gone = [g for g in model.grasps if g.name == name or g.name.startswith(f"{name}/")]
    model.grasps[:] = [g for g in model.grasps if g not in gone]
    return [grasp.name for grasp in gone]
