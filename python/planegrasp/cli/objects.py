"""`planegrasp objects`: what is in a library."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import (
    JsonOption,
    LibraryOption,
    console,
    grasp_row,
    pose_row,
    print_error,
    print_json,
    quality_row,
)
from planegrasp.errors import InvalidInputError, UnknownObjectError

if TYPE_CHECKING:
    from planegrasp.library.storage import Scan
    from planegrasp.objects import ObjectModel


class Action(StrEnum):
    """What to do with the library."""

    LIST = "list"
    SHOW = "show"
    QUALITY = "quality"
    REMOVE = "remove"


def objects(
    action: Annotated[
        Action,
        typer.Argument(
            help="**list** the objects, **show** one with its faces' poses, print the **quality** "
            "of one or all, or **remove** one."
        ),
    ] = Action.LIST,
    name: Annotated[str | None, typer.Argument(help="Of the object.", show_default=False)] = None,
    library: LibraryOption = Path("objects"),
    as_json: JsonOption = False,
) -> None:
    """List, show, judge and remove taught objects.

    A damaged object is listed with what is wrong with it, and the exit code is 1; it can be
    removed.

        planegrasp objects

        planegrasp objects show book --library objects

        planegrasp objects quality --json

        planegrasp objects remove book
    """
    from planegrasp.library import scan

    if action in (Action.SHOW, Action.REMOVE) and name is None:
        raise InvalidInputError(f"which object? planegrasp objects {action} NAME")
    found = scan(library)
    if action is Action.REMOVE:
        _remove(library, str(name), as_json=as_json)
        return
    if name is not None:
        found = _only(found, name, library)
    if action is Action.QUALITY:
        _quality(found, as_json=as_json)
    else:
        _show(found, library, details=action is Action.SHOW, as_json=as_json)
    if found.damaged:
        raise typer.Exit(1)


def _only(found: Scan, name: str, library: Path) -> Scan:
    from planegrasp.library.storage import Scan

    if name in found.damaged:
        raise found.damaged[name]
    if name not in found.objects:
        known = ", ".join(found.objects) or "it is empty"
        raise UnknownObjectError(f"there is no object {name!r} in {library}; it has: {known}")
    return Scan({name: found.objects[name]})


def _remove(library: Path, name: str, *, as_json: bool) -> None:
    from planegrasp.library import storage

    if not library.is_dir():
        raise UnknownObjectError(f"there is no object {name!r}: {library} does not exist")
    with storage.locked(library, exclusive=True):
        storage.clean(library)
        storage.delete(library, name)
    if as_json:
        print_json({"library": str(library), "removed": name})
    else:
        console().print(f"removed [bold]{name}[/] from {library}")


def _show(found: Scan, library: Path, *, details: bool, as_json: bool) -> None:
    from rich.table import Table

    if as_json:
        print_json(
            {
                "library": str(library),
                "objects": [_row(stored.model) for stored in found.objects.values()],
                "damaged": _damaged(found),
            }
        )
        return
    if not found.objects and not found.damaged:
        state = "is empty" if library.is_dir() else "does not exist yet"
        console().print(f"no objects: {library} {state}; teach one with `planegrasp teach`")
        return
    table = Table("object", "priority", "face", "size (mm)", "image (px)")
    if details:
        table.add_column("position in the object (m)")
        table.add_column("quaternion x, y, z, w")
    # With the poses there is no room for them; `planegrasp grasp list` shows more.
    has_grasps = not details and any(stored.model.grasps for stored in found.objects.values())
    if has_grasps:
        table.add_column("grasps")
    for stored in found.objects.values():
        model = stored.model
        for i, face in enumerate(model.faces):
            rows, columns = face.image.shape[:2]
            row = [
                model.name if i == 0 else "",
                str(model.priority) if i == 0 else "",
                face.name,
                f"{1000 * face.width:.1f} × {1000 * face.height:.1f}",
                f"{columns}×{rows}",
            ]
            if details:
                T = face.T_object_face
                row.append(", ".join(f"{value:.4f}" for value in T.translation))
                row.append(", ".join(f"{value:.4f}" for value in T.rotation.as_quat()))
            if has_grasps:
                row.append("\n".join(grasp.name for grasp in model.grasps) if i == 0 else "")
            table.add_row(*row)
    if found.objects:
        console().print(table)
    _print_damaged(found)


def _quality(found: Scan, *, as_json: bool) -> None:
    from rich.table import Table

    from planegrasp.teaching.quality import assess

    verdicts = [
        (stored.model.name, face.name, assess(face.image))
        for stored in found.objects.values()
        for face in stored.model.faces
    ]
    if as_json:
        rows = [{"name": n, "face": f, "quality": quality_row(q)} for n, f, q in verdicts]
        print_json({"faces": rows, "damaged": _damaged(found)})
        return
    table = Table("object", "face", "quality", "features", "reasons")
    for name, face, quality in verdicts:
        features = f"{quality.figures['features']:.0f}"
        table.add_row(name, face, str(quality.score), features, "\n".join(quality.reasons))
    console().print(table)
    _print_damaged(found)


def _row(model: ObjectModel) -> dict[str, object]:
    return {
        "name": model.name,
        "priority": model.priority,
        "faces": [
            {
                "name": face.name,
                "width": face.width,
                "height": face.height,
                "image_size": [face.image.shape[1], face.image.shape[0]],
                "T_object_face": pose_row(face.T_object_face),
            }
            for face in model.faces
        ],
        "body": {"size": model.outer_body.size, "centre": model.outer_body.centre},
        "grasps": [grasp_row(grasp) for grasp in model.grasps],
    }


def _damaged(found: Scan) -> list[dict[str, str]]:
    return [{"name": name, "error": str(error)} for name, error in found.damaged.items()]


def _print_damaged(found: Scan) -> None:
    for error in found.damaged.values():
        print_error(str(error))
