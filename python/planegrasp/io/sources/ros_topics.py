"""Which topics of a recording are colour, depth and camera."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.errors import SourceError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

IMAGE, COMPRESSED, CAMERA_INFO = "Image", "CompressedImage", "CameraInfo"
_FOXGLOVE = {
    "foxglove.RawImage": IMAGE,
    "foxglove.CompressedImage": COMPRESSED,
    "foxglove.CameraCalibration": CAMERA_INFO,
}
_TRANSPORTS = re.compile(r"/(compressed|compressedDepth|theora|zstd)$")


@dataclass(frozen=True, slots=True)
class RecordingTopics:
    """Names of topics; None lets them be chosen by their names and types.

    Attributes:
        color: Image or CompressedImage.
        depth: the same, aligned to colour; "" for a recording that is to be read without depth.
        info: CameraInfo of the colour image.
    """

    color: str | None = None
    depth: str | None = None
    info: str | None = None


def message_kind(message_type: str) -> str | None:
    """Image, CompressedImage or CameraInfo, as ROS 1, ROS 2 or Foxglove have it; else None."""
    if message_type in _FOXGLOVE:
        return _FOXGLOVE[message_type]
    parts = message_type.split("/")
    known = parts[0] == "sensor_msgs" and parts[-1] in (IMAGE, COMPRESSED, CAMERA_INFO)
    return parts[-1] if known else None


def choose_topics(
    types: Mapping[str, str],
    asked: RecordingTopics,
    *,
    needs_info: bool = True,
    where: str = "the recording",
) -> RecordingTopics:
    """The topics to read.

    Colour is the topic named color or rgb, else the only one that is not depth; depth the one that
    is named depth, and of several the one that is aligned or registered; the camera is the
    camera_info beside the colour image. Images that are not compressed go before others.

    Args:
        types: message type by topic.
        asked: what the user named.
        needs_info: whether a recording without the camera's info is an error.
        where: what has these topics, for messages.

    Returns:
        With a name for color; depth is "" and info None where the recording has none.

    Raises:
        SourceError: a topic that was asked for is not there or of another type, or there is no
            colour image, no camera or no one choice; the message lists the topics.
    """
    kinds = {topic: kind for topic, kind in types.items() if kind is not None}
    images = [topic for topic, kind in kinds.items() if message_kind(kind) in (IMAGE, COMPRESSED)]
    infos = [topic for topic, kind in kinds.items() if message_kind(kind) == CAMERA_INFO]
    listing = _listing(types, where)
    for what, name, among in (
        ("color", asked.color, images),
        ("depth", asked.depth, images),
        ("info", asked.info, infos),
    ):
        if name and name not in among:
            raise SourceError(f"there is no topic {name!r} for {what}{listing}")
    depths = [topic for topic in images if "depth" in topic.lower()]
    color = asked.color or _one(
        [topic for topic in images if topic not in depths and topic != asked.depth],
        [_has("color", "rgb"), _has("rect"), _is_plain(types)],
        "colour",
        listing,
    )
    if color is None:
        raise SourceError(
            f"there is no colour image (sensor_msgs Image, foxglove RawImage){listing}"
        )
    depth = asked.depth
    if depth is None:
        depth = _one(depths, [_has("aligned", "registered"), _is_plain(types)], "depth", listing)
    info = asked.info or _info_beside(color, infos)
    if info is None and needs_info:
        raise SourceError(
            f"there is no camera_info for {color}: give a camera file, or the topic{listing}"
        )
    return RecordingTopics(color, depth or "", info)


def _one(
    topics: list[str], preferences: list[Callable[[str], bool]], what: str, listing: str
) -> str | None:
    """The only topic, if need be of those that a preference holds for."""
    for preferred in preferences:
        if len(topics) > 1:
            topics = [topic for topic in topics if preferred(topic)] or topics
    if len(topics) > 1:
        raise SourceError(f"{what} may be any of {', '.join(topics)}: name one{listing}")
    return topics[0] if topics else None


def _has(*parts: str) -> Callable[[str], bool]:
    return lambda topic: any(part in topic.lower() for part in parts)


def _is_plain(types: Mapping[str, str]) -> Callable[[str], bool]:
    return lambda topic: message_kind(types[topic]) == IMAGE


def _info_beside(color: str, infos: list[str]) -> str | None:
    namespace = _TRANSPORTS.sub("", color).rsplit("/", 1)[0]
    beside = f"{namespace}/camera_info"
    if beside in infos:
        return beside
    others = [topic for topic in infos if "depth" not in topic.lower()]
    return others[0] if len(others) == 1 else None


def _listing(types: Mapping[str, str], where: str) -> str:
    if not types:
        return f"; {where} has no topics"
    topics = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(types.items()))
    return f"; {where} has {topics}"
