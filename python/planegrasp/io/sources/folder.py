"""Plain layouts: one image, a folder of images, and RGB-D folders with a camera file.

RGB-D folders come in two forms, both with `camera.json` (see `planegrasp.io.camera_file`):

    color/000000.png  depth/000000.png        two folders, the same file names but for the suffix
    000000-color.png  000000-depth.png        one folder, two files a frame

The first form may have a `frames.txt` (see `planegrasp.io.sources.frame_list`), as `planegrasp
record` writes it: then its frames are read, with their timestamps, and may lack depth.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from planegrasp.errors import SourceError
from planegrasp.io.images import IMAGE_SUFFIXES, MILLIMETRES
from planegrasp.io.sources.base import ASSUMED_FIELD_OF_VIEW, assumed_camera, assumption_note
from planegrasp.io.sources.frame_list import FRAME_LIST, read_frame_list
from planegrasp.io.sources.sequence import FrameFiles, ImageSequence, fixed_camera, natural_key

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.sources.sequence import CameraForSize

    NamedPair = tuple[str, Path, Path | None]  # name of the frame, colour image, depth image

CAMERA_FILE = "camera.json"
COLOR_FOLDER, DEPTH_FOLDER = "color", "depth"
COLOR_ENDING, DEPTH_ENDING = "-color", "-depth"
_DEPTH_SUFFIXES = frozenset({".png", ".npy", ".tif", ".tiff"})


def single_image(
    path: Path,
    camera: PinholeCamera | None = None,
    depth: Path | None = None,
    depth_scale: float = MILLIMETRES,
    field_of_view: float | None = None,
) -> ImageSequence:
    """One colour image, with or without a depth image.

    Raises:
        SourceError: there is no such file, or depth without a camera.
    """
    for file in (path, depth):
        if file is not None and not file.is_file():
            raise SourceError(f"there is no image file {file}")
    return _sequence(path, [(path.stem, path, depth)], camera, depth_scale, field_of_view)


def image_folder(
    path: Path,
    camera: PinholeCamera | None = None,
    depth: Path | None = None,
    depth_scale: float = MILLIMETRES,
    field_of_view: float | None = None,
) -> ImageSequence:
    """All images of a folder in natural order, each with its namesake in the depth folder if given.

    Raises:
        SourceError: the folder has no images, depth images are missing, or depth without a camera.
    """
    return _sequence(path, paired_images(path, depth), camera, depth_scale, field_of_view)


def rgbd_folder(path: Path, camera: PinholeCamera, depth_scale: float) -> ImageSequence:
    """An RGB-D folder in one of the two forms that this module's docstring shows.

    Raises:
        SourceError: there are no colour images, or a colour image has no depth image.
    """
    if (path / FRAME_LIST).is_file():
        return _recorded_folder(path, camera, depth_scale)
    if (path / COLOR_FOLDER).is_dir():
        depth = path / DEPTH_FOLDER
        if not depth.is_dir():
            raise SourceError(f"{path} has a folder {COLOR_FOLDER}/ but no folder {DEPTH_FOLDER}/")
        sequence = image_folder(path / COLOR_FOLDER, camera, depth, depth_scale)
        return ImageSequence(path.name, sequence.files, camera)
    triples: list[NamedPair] = []
    for color in flat_color_files(path):
        name = color.stem.removesuffix(COLOR_ENDING)
        depth_file = _one_of(path, name + DEPTH_ENDING)
        if depth_file is None:
            raise SourceError(f"{color} has no depth image: expected {name}{DEPTH_ENDING}.png")
        triples.append((name, color, depth_file))
    return _sequence(path, triples, camera, depth_scale, None)


def _recorded_folder(path: Path, camera: PinholeCamera, depth_scale: float) -> ImageSequence:
    listed = read_frame_list(path / FRAME_LIST)
    for_size = fixed_camera(camera)
    files = []
    for name, stamp in listed.stamps.items():
        color, depth = path / COLOR_FOLDER / f"{name}.png", path / DEPTH_FOLDER / f"{name}.png"
        if not color.is_file():
            raise SourceError(f"{color} is missing, which {path / FRAME_LIST} lists")
        files.append(
            FrameFiles(
                name, color, depth if depth.is_file() else None, for_size, depth_scale, stamp
            )
        )
    notes: tuple[str, ...] = ()
    if not listed.finished:
        last = f"after {files[-1].name}" if files else "before the first frame"
        notes = (f"{path.name} was cut off when it was recorded: it ends {last}",)
    return ImageSequence(path.name, files, camera, notes)


def paired_images(colors: Path, depths: Path | None) -> list[NamedPair]:
    """The images of a folder in natural order, each with its namesake in the depth folder if given.

    Returns:
        Name of the frame (the file name, without its suffix where that is unique), colour image,
        depth image.

    Raises:
        SourceError: the folder has no images, or depth images are missing.
    """
    files = _files(colors, IMAGE_SUFFIXES)
    if not files:
        raise SourceError(f"{colors} has no images")
    unique = len({file.stem for file in files}) == len(files)
    names = [file.stem if unique else file.name for file in files]
    depth_files = _namesakes(files, depths) if depths is not None else [None] * len(files)
    return list(zip(names, files, depth_files, strict=True))


def flat_color_files(path: Path) -> list[Path]:
    """The colour images of a folder with two files a frame; empty in every other folder."""
    return [file for file in _files(path, IMAGE_SUFFIXES) if file.stem.endswith(COLOR_ENDING)]


def _sequence(
    path: Path,
    triples: list[NamedPair],
    camera: PinholeCamera | None,
    depth_scale: float,
    field_of_view: float | None,
) -> ImageSequence:
    if camera is None and any(depth is not None for _, _, depth in triples):
        raise SourceError(
            f"{path} comes with depth but without a camera: depth says where a point lies only "
            f"together with the camera's focal length; give a camera file"
        )
    if camera is None:
        angle = ASSUMED_FIELD_OF_VIEW if field_of_view is None else field_of_view
        for_size: CameraForSize = partial(assumed_camera, field_of_view=angle)
        notes: tuple[str, ...] = (assumption_note(field_of_view),)
    else:
        for_size, notes = fixed_camera(camera), ()
    files = [FrameFiles(name, color, d, for_size, depth_scale) for name, color, d in triples]
    return ImageSequence(path.name, files, camera, notes)


def _files(folder: Path, suffixes: frozenset[str]) -> list[Path]:
    found = [
        file
        for file in folder.iterdir()
        if file.suffix.lower() in suffixes and not file.name.startswith(".") and file.is_file()
    ]
    return sorted(found, key=natural_key)


def _namesakes(colors: list[Path], depth: Path) -> list[Path | None]:
    if not depth.is_dir():
        raise SourceError(f"depth of an image folder is a folder too, but {depth} is none")
    by_stem = {file.stem: file for file in _files(depth, _DEPTH_SUFFIXES)}
    missing = [color for color in colors if color.stem not in by_stem]
    if missing:
        raise SourceError(
            f"{len(missing)} of {len(colors)} colour images have no depth image; the first is "
            f"{missing[0]}: expected {depth / missing[0].stem}.png"
        )
    return [by_stem[color.stem] for color in colors]


def _one_of(folder: Path, stem: str) -> Path | None:
    candidates = (folder / (stem + suffix) for suffix in sorted(_DEPTH_SUFFIXES))
    return next((file for file in candidates if file.is_file()), None)
