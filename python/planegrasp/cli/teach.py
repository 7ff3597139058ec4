"""`planegrasp teach`: put an object, or one more face of it, into a library."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import (
    JsonOption,
    LibraryOption,
    console,
    parse_numbers,
    print_json,
    quality_row,
)
from planegrasp.errors import DuplicateObjectError, InvalidInputError

if TYPE_CHECKING:
    from planegrasp.geometry import RigidTransform
    from planegrasp.library import ObjectLibrary
    from planegrasp.objects import ObjectModel, PlanarFace
    from planegrasp.teaching.quality import TeachingQuality

# Nothing that a robot grasps is as wide; but 210 (mm) and 21 (cm) are.
_WIDEST = 5.0


def teach(
    name: Annotated[str, typer.Argument(help="Of the object.")],
    image: Annotated[Path, typer.Argument(help="Photo of the face.")],
    *,
    width: Annotated[
        float | None, typer.Option(help="Of the face, in metres.", show_default=False)
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(help="Of the face, in metres.", show_default="from the aspect ratio"),
    ] = None,
    corners: Annotated[
        str | None,
        typer.Option(
            help="Where the face is in the photo: its corners top-left, top-right, bottom-right, "
            "bottom-left as printed on it, in pixels.",
            metavar='"X,Y X,Y X,Y X,Y"',
            show_default="the whole photo",
        ),
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(
            help="Camera file (JSON): removes lens distortion, and makes the height exact."
        ),
    ] = None,
    depth: Annotated[
        Path | None,
        typer.Option(help="Depth image aligned to the photo: width and height are measured."),
    ] = None,
    depth_scale: Annotated[
        float | None,
        typer.Option(help="Metres per unit of the depth image.", show_default="camera file"),
    ] = None,
    face: Annotated[str, typer.Option(help="What to call the face.")] = "front",
    pose: Annotated[
        str | None,
        typer.Option(
            help="Of the face in the object: translation in metres and quaternion.",
            metavar='"X,Y,Z,QX,QY,QZ,QW"',
            show_default="the object's origin",
        ),
    ] = None,
    box: Annotated[
        str | None,
        typer.Option(
            help="Width, height and depth of a box in metres, of which --face is the front, back, "
            "left, right, top or bottom: gives the face's size and pose.",
            metavar='"W,H,D"',
        ),
    ] = None,
    thickness: Annotated[
        float | None,
        typer.Option(
            help="Of the object behind its face, in metres: where fingers and obstacles collide.",
            show_default="5 mm",
        ),
    ] = None,
    priority: Annotated[
        int | None, typer.Option(help="Larger is preferred.", show_default="0")
    ] = None,
    library: LibraryOption = Path("objects"),
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace a face taught before.")
    ] = False,
    preview: Annotated[
        Path | None, typer.Option(help="Write a picture of the face with its features.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Teach an object with a photo of its face and the face's width.

    Prints how well it can be recognised, from 0 to 100, with reasons, and refuses what cannot be.

    A photo cropped to the object:

        planegrasp teach book book.jpg --width 0.21

    The object somewhere in a photo:

        planegrasp teach book desk.jpg --width 0.21 --corners "412,180 905,212 880,860 371,800"

    Measured from an RGB-D frame:

        planegrasp teach book color.png --depth depth.png --camera camera.json --corners "..."

    A book that will be grasped:

        planegrasp teach book book.jpg --width 0.21 --thickness 0.02

    Another side of a box:

        planegrasp teach tea top.jpg --box 0.08,0.13,0.06 --face top
    """
    from planegrasp.library import ObjectLibrary
    from planegrasp.teaching.teach import teach as teach_into

    request = _Request(image, width, height, corners, camera, depth, depth_scale, face, pose, box)
    objects = ObjectLibrary(library)
    taught = _face(name, request)
    model = _model(objects, name, taught, priority, has_pose=bool(pose or box), replace=replace)
    model = _with_body(model, objects, box, thickness)
    if preview:
        from planegrasp.io.images import write_color
        from planegrasp.teaching.preview import draw_preview

        write_color(preview, draw_preview(taught.image))
    quality = teach_into(objects, model, replace=True)[taught.name]
    _report(model, taught, quality, library, as_json=as_json)


@dataclass(frozen=True, slots=True)
class _Request:
    """How the face is to be made, as asked for on the command line."""

    image: Path
    width: float | None
    height: float | None
    corners: str | None
    camera: Path | None
    depth: Path | None
    depth_scale: float | None
    face: str
    pose: str | None
    box: str | None


def _face(name: str, request: _Request) -> PlanarFace:
    from planegrasp.io.images import read_color
    from planegrasp.objects import ObjectModel, PlanarFace

    width, height, T_object_face = _size_and_pose(request)
    photo = read_color(request.image)
    if request.depth:
        model = _from_depth(name, request)
    elif width is None:
        raise InvalidInputError(
            "how wide is the face? Give --width in metres (0.21 for A4 paper), or --depth and "
            "--camera to measure it"
        )
    elif request.corners:
        from planegrasp.io.camera_file import read_camera

        camera = read_camera(request.camera)[0] if request.camera else None
        model = ObjectModel.from_corners(
            name, photo, _corners(request.corners), width, height, camera=camera
        )
    else:
        model = ObjectModel.from_image(name, photo, width, height)
    made = model.faces[0]
    return PlanarFace(request.face, made.image, made.width, made.height, T_object_face)


def _size_and_pose(
    request: _Request,
) -> tuple[float | None, float | None, RigidTransform | None]:
    if not request.box:
        for value, option in ((request.width, "--width"), (request.height, "--height")):
            _check_metres(value, option)
        return request.width, request.height, _pose(request.pose)
    if request.pose or request.width or request.height or request.depth:
        raise InvalidInputError(
            "--box gives the size and the pose: leave out --width, --height, --pose and --depth"
        )
    from planegrasp.boxes import box_face_pose, box_face_size

    width, height, depth = parse_numbers(request.box, 3, "--box")
    for value in (width, height, depth):
        _check_metres(value, "--box")
    size = (width, height, depth)
    return *box_face_size(size, request.face), box_face_pose(size, request.face)


def _from_depth(name: str, request: _Request) -> ObjectModel:
    from planegrasp.io.camera_file import read_camera
    from planegrasp.io.images import read_color, read_depth
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

    if not (request.depth and request.camera and request.corners):
        raise InvalidInputError(
            "--depth measures the face between --corners and needs the --camera file too"
        )
    if request.width or request.height:
        raise InvalidInputError("--depth measures the size: leave out --width and --height")
    camera, scale = read_camera(request.camera)
    depth = read_depth(request.depth, request.depth_scale or scale)
    frame = RGBDFrame(read_color(request.image), depth, camera, name=str(request.image))
    return ObjectModel.from_frame(name, frame, _corners(request.corners))


def _corners(text: str) -> list[tuple[float, float]]:
    numbers = parse_numbers(text, 8, "--corners")
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def _pose(text: str | None) -> RigidTransform | None:
    if text is None:
        return None
    from planegrasp.geometry import transform_from_quaternion

    numbers = parse_numbers(text, 7, "--pose")
    try:
        return transform_from_quaternion(numbers[:3], numbers[3:])
    except InvalidInputError as error:
        raise InvalidInputError(f"--pose: {error}") from error


def _check_metres(value: float | None, option: str) -> None:
    if value is not None and value > _WIDEST:
        raise InvalidInputError(
            f"{option} {value:g} is in metres: did you mean {value / 1000:g} ({value:g} mm) or "
            f"{value / 100:g} ({value:g} cm)?"
        )


def _model(
    objects: ObjectLibrary,
    name: str,
    face: PlanarFace,
    priority: int | None,
    *,
    has_pose: bool,
    replace: bool,
) -> ObjectModel:
    """The object with its new face: made anew, or the library's one with one more face."""
    from dataclasses import replace as changed

    from planegrasp.objects import ObjectModel

    if name not in objects:
        return ObjectModel(name, (face,), priority or 0)
    known = objects[name]
    names = [other.name for other in known.faces]
    if face.name in names and not replace:
        raise DuplicateObjectError(
            f"object {name!r} has a face {face.name!r} already: --replace it, or choose another "
            f"NAME, or teach a further face with --face and --pose"
        )
    if set(names) - {face.name} and not has_pose:
        raise InvalidInputError(
            f"object {name!r} has other faces ({', '.join(names)}): say with --pose or --box where "
            f"face {face.name!r} is"
        )
    model = known.with_face(face)
    return model if priority is None else changed(model, priority=priority)


def _with_body(
    model: ObjectModel, objects: ObjectLibrary, box: str | None, thickness: float | None
) -> ObjectModel:
    """The object with its body: as asked for, or as before around a changed face."""
    from dataclasses import replace as changed

    from planegrasp.body import BoxBody, body_behind

    if box and thickness is not None:
        raise InvalidInputError("--box gives the body: leave out --thickness")
    _check_metres(thickness, "--thickness")
    if box:
        width, height, depth = parse_numbers(box, 3, "--box")
        return changed(model, body=BoxBody((width, height, depth)))
    if thickness is None and model.body and model.name in objects:
        depth = model.body.size[2]
        if model.body == body_behind(objects[model.name].faces, depth):
            thickness = depth
    if thickness is None:
        return model
    return changed(model, body=body_behind(model.faces, thickness))


def _report(
    model: ObjectModel,
    face: PlanarFace,
    quality: TeachingQuality,
    library: Path,
    *,
    as_json: bool,
) -> None:
    rows, columns = face.image.shape[:2]
    if as_json:
        print_json(
            {
                "name": model.name,
                "face": face.name,
                "width": face.width,
                "height": face.height,
                "image_size": [columns, rows],
                "priority": model.priority,
                "body": {"size": model.outer_body.size, "centre": model.outer_body.centre},
                "library": str(library),
                "quality": quality_row(quality),
            }
        )
        return
    out = console()
    size = f"{1000 * face.width:.1f} × {1000 * face.height:.1f} mm"
    features = f"{quality.figures['features']:.0f} features"
    out.print(f"[bold]{model.name}[/] {face.name}: {size}, {columns}×{rows} pixels, {features}")
    out.print(f"quality [bold]{quality.score}[/] of 100")
    for reason in quality.reasons:
        out.print(f"  - {reason}", soft_wrap=True)
    out.print(f"saved in {library / model.name}", soft_wrap=True)
