"""Recognising and opening ROS recordings.

NAME.bag                ROS 1
NAME.mcap               messages of ROS 1 or 2
NAME/metadata.yaml      ROS 2, with storage in NAME/*.db3 (SQLite) or NAME/*.mcap
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.sources.sequence import natural_key

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.sources.ros_recording import RosRecording
    from planegrasp.io.sources.ros_topics import RecordingTopics

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"

_MAGICS = (b"#ROSBAG V2.0", b"\x89MCAP0\r\n")


def is_recording(path: Path) -> bool:
    """Whether a file or folder is a ROS recording, by what it holds or by its suffix."""
    if path.is_dir():
        return (path / METADATA).is_file() or bool(_mcap_files(path))
    if path.suffix.lower() in SUFFIXES:
        return True
    with path.open("rb") as stream:
        return stream.read(16).startswith(_MAGICS)


def ros_recording(
    path: Path,
    camera: PinholeCamera | None = None,
    depth_scale: float | None = None,
    topics: RecordingTopics | None = None,
) -> RosRecording:
    """Open a recording, see `RosRecording`.

    Raises:
        MissingExtraError: the extra `bags` is not installed.
        SourceError: it is damaged, or what to read of it cannot be chosen.
        CameraError: its camera is not calibrated.
    """
    from planegrasp.io.sources.mcap_messages import McapFiles
    from planegrasp.io.sources.ros_messages import RosBag
    from planegrasp.io.sources.ros_recording import RosRecording

    files = _mcap_files(path) if path.is_dir() else [path] * _is_mcap(path)
    # MCAP files are read past metadata.yaml, which a recorder that was killed did not write.
    messages = McapFiles(files) if files else RosBag(path)
    return RosRecording(path.name, messages, camera, depth_scale, topics)


def _mcap_files(folder: Path) -> list[Path]:
    return sorted((file for file in folder.glob("*.mcap") if file.is_file()), key=natural_key)


def _is_mcap(path: Path) -> bool:
    if path.suffix.lower() == ".mcap":
        return True
    with path.open("rb") as stream:
        return stream.read(16).startswith(_MAGICS[1])
