"""Recognising what a path holds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.errors import SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.camera_file import read_camera
from planegrasp.io.images import IMAGE_SUFFIXES, MILLIMETRES
from planegrasp.io.sources import bop, folder, ros, tum
from planegrasp.io.sources.video import VIDEO_SUFFIXES, VideoSource

if TYPE_CHECKING:
    from planegrasp.io.sources.base import FrameSource
    from planegrasp.io.sources.ros_topics import RecordingTopics

_LAYOUTS = (
    f"an RGB-D folder ({folder.COLOR_FOLDER}/, {folder.DEPTH_FOLDER}/, {folder.CAMERA_FILE}; or "
    f"NAME{folder.COLOR_ENDING}.png, NAME{folder.DEPTH_ENDING}.png, {folder.CAMERA_FILE}), "
    f"a TUM RGB-D sequence ({tum.COLOR_LIST}, {tum.DEPTH_LIST}), "
    f"a BOP scene ({bop.CAMERA_LIST}, rgb/, depth/), a ROS 2 recording ({ros.METADATA}) "
    f"or a folder of images"
)


def open_source(
    path: str | Path,
    *,
    camera: PinholeCamera | str | Path | None = None,
    depth: str | Path | None = None,
    depth_scale: float | None = None,
    field_of_view: float | None = None,
    topics: RecordingTopics | None = None,
) -> FrameSource:
    """Open an image, a folder of images, a video, an RGB-D, TUM or BOP folder, or a ROS recording.

    Args:
        path: file or folder; its layout is recognised by what it holds.
        camera: a camera, or the path of a camera file, instead of what the layout brings.
        depth: for an image its depth image, for a folder of images the folder of depth images.
        depth_scale: metres per unit of the depth images. By default what the layout prescribes
            (TUM, BOP), else the camera file's, else 0.001.
        field_of_view: horizontal [rad], for images and videos without a camera.
        topics: of a ROS recording, where they cannot be chosen by their names.

    Raises:
        SourceError: the path is missing or of no known layout, or an option does not apply to it.
        MissingExtraError: it is a ROS recording, and the extra `bags` is not installed.
        CameraError: the camera file is that of no camera.
    """
    path = Path(path)
    if not path.exists():
        raise SourceError(f"there is no file or folder {path}")
    given = _Given(camera, None if depth is None else Path(depth), depth_scale, field_of_view)
    if ros.is_recording(path):
        given.refuse("a ROS recording", depth=given.depth, field_of_view=given.field_of_view)
        return ros.ros_recording(path, given.camera, given.explicit_scale, topics)
    if topics is not None:
        raise SourceError(f"topics are for ROS recordings, but {path} is none")
    return _open_folder(path, given) if path.is_dir() else _open_file(path, given)


class _Given:
    """What the caller said about camera and depth."""

    def __init__(
        self,
        camera: PinholeCamera | str | Path | None,
        depth: Path | None,
        depth_scale: float | None,
        field_of_view: float | None,
    ) -> None:
        self.camera: PinholeCamera | None
        if camera is None or isinstance(camera, PinholeCamera):
            self.camera, file_scale = camera, None
        else:
            self.camera, file_scale = read_camera(camera)
        if self.camera is not None and field_of_view is not None:
            raise SourceError("give a camera or a field of view, not both")
        if depth_scale is not None and not 0.0 < depth_scale < math.inf:
            raise SourceError(f"depth_scale must be > 0 metres per unit, got {depth_scale}")
        self.depth = depth
        self.explicit_scale = depth_scale
        self.depth_scale = depth_scale or file_scale
        self.field_of_view = field_of_view

    def refuse(self, layout: str, **options: object) -> None:
        """Refuse options that a layout would ignore."""
        for name, value in options.items():
            if value is not None:
                raise SourceError(f"{layout} takes no {name.replace('_', ' ')}, got {value}")

    def with_camera_file(self, path: Path) -> tuple[PinholeCamera | None, float]:
        """The given camera and scale, or else those of the folder's own camera file."""
        if self.camera is not None or not path.is_file():
            return self.camera, self.depth_scale or MILLIMETRES
        camera, scale = read_camera(path)
        return camera, self.depth_scale or scale


def _open_file(path: Path, given: _Given) -> FrameSource:
    suffix = path.suffix.lower()
    if suffix in VIDEO_SUFFIXES:
        given.refuse("a video", depth=given.depth)
        return VideoSource(path, given.camera, given.field_of_view)
    if suffix in IMAGE_SUFFIXES:
        scale = given.depth_scale or MILLIMETRES
        return folder.single_image(path, given.camera, given.depth, scale, given.field_of_view)
    raise SourceError(
        f"{path} is neither an image ({', '.join(sorted(IMAGE_SUFFIXES))}) nor a video "
        f"({', '.join(sorted(VIDEO_SUFFIXES))}) nor a ROS recording ({', '.join(ros.SUFFIXES)})"
    )


def _open_folder(path: Path, given: _Given) -> FrameSource:
    if (path / bop.CAMERA_LIST).is_file():
        given.refuse("a BOP scene", depth=given.depth, field_of_view=given.field_of_view)
        return bop.bop_scene(path, given.camera, given.explicit_scale)
    if (path / tum.COLOR_LIST).is_file():
        given.refuse("a TUM sequence", depth=given.depth, field_of_view=given.field_of_view)
        return tum.tum_sequence(path, given.camera, given.explicit_scale or tum.DEPTH_SCALE)
    camera, scale = given.with_camera_file(path / folder.CAMERA_FILE)
    if (path / folder.COLOR_FOLDER).is_dir() or folder.flat_color_files(path):
        given.refuse("an RGB-D folder", depth=given.depth, field_of_view=given.field_of_view)
        if camera is None:
            raise SourceError(f"{path / folder.CAMERA_FILE} is missing: give a camera file")
        return folder.rgbd_folder(path, camera, scale)
    if any(file.suffix.lower() in IMAGE_SUFFIXES for file in path.iterdir()):
        return folder.image_folder(path, camera, given.depth, scale, given.field_of_view)
    raise SourceError(f"{path} is {_nothing_known(path)}: expected {_LAYOUTS}")


def _nothing_known(path: Path) -> str:
    entries = sorted(entry.name + "/" * entry.is_dir() for entry in path.iterdir())
    if not entries:
        return "an empty folder"
    scenes = sorted(scene.parent.name for scene in path.glob(f"*/{bop.CAMERA_LIST}"))
    if scenes:
        return f"a folder of BOP scenes, give one of them ({', '.join(scenes[:5])})"
    listed = ", ".join(entries[:5]) + (", …" if len(entries) > 5 else "")
    return f"a folder in no known layout (it holds {listed})"
