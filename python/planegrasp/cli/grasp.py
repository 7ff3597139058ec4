"""`planegrasp grasp`: teach grasps, list and remove them, and adapt them to another pose."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planegrasp.cli.common import (
    JsonOption,
    LibraryOption,
    console,
    grasp_row,
    pose_row,
    print_json,
)
from planegrasp.cli.grasp_options import NameArgument, ObjectArgument, base_object, remove_from
from planegrasp.cli.grasp_plan import plan
from planegrasp.cli.grasp_tables import adapted_table, grasp_lines, grasps_table
from planegrasp.cli.grasp_teach import teach
from planegrasp.errors import GraspError

app = typer.Typer(
    help="Teach grasps of an object once, and adapt them to where it is.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(teach)


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
    removed = remove_from(model, name)
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
    from planegrasp.library import ObjectLibrary

    model = ObjectLibrary(library)[object_name]
    grasps = model.grasps if name is None else [model.grasp(name)]
    if not grasps:
        raise GraspError(
            f"object {model.name!r} has no grasp: teach one with `planegrasp grasp teach`"
        )
    T_base_object = base_object(pose)
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


app.command()(plan)
