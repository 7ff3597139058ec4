"""What is drawn over the image: outlines, axes and labels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from foxglove.messages import (
    ImageAnnotations,
    KeyValuePair,
    PointsAnnotation,
    PointsAnnotationType,
    TextAnnotation,
)

from planegrasp.io.foxglove.values import color_message, pixels, timestamp
from planegrasp.viz.geometry import axis_ends, face_outline, face_size
from planegrasp.viz.overlay import label_lines
from planegrasp.viz.palette import AXIS_COLORS, color_of, readable_on

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.detection import Detection
    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.messages.header import Header
    from planegrasp.viz.palette import RGB

__all__ = ["image_annotations"]

_LINE, _AXIS, _TEXT = 2.0, 3.0, 14.0  # [px]


def image_annotations(
    header: Header,
    detections: Sequence[Detection],
    camera: PinholeCamera,
    colors: Mapping[str, RGB] | None = None,
) -> ImageAnnotations:
    """Outlines of all faces, axes (x red, y green, z blue) and labels, in pixels as observed.

    Args:
        header: of the image.
        detections: in it.
        camera: that took it.
        colors: by object name, see `draw_detections`.
    """
    shapes, labels = [], []
    for detection in detections:
        shapes += _outlines(header, detection, camera, color_of(detection.name, colors))
    for detection in detections:
        shapes += _axes(header, detection, camera)
        labels.append(_label(header, detection, color_of(detection.name, colors)))
    return ImageAnnotations(timestamp=timestamp(header.stamp), points=shapes, texts=labels)


def _outlines(
    header: Header, detection: Detection, camera: PinholeCamera, color: RGB
) -> list[PointsAnnotation]:
    return [
        PointsAnnotation(
            timestamp=timestamp(header.stamp),
            type=PointsAnnotationType.LineLoop,
            points=pixels(face_outline(face, camera)),
            outline_color=color_message(color),
            thickness=_LINE,
            metadata=[*_which(detection), KeyValuePair(key="face", value=face.name)],
        )
        for face in detection.faces
    ]


def _axes(header: Header, detection: Detection, camera: PinholeCamera) -> list[PointsAnnotation]:
    if detection.pose is None:
        return []
    ends = axis_ends(detection, camera, min(face_size(detection, camera)) / 2)
    if ends is None:
        return []
    lines = [point for tip in ends[1:] for point in (ends[0], tip)]
    return [
        PointsAnnotation(
            timestamp=timestamp(header.stamp),
            type=PointsAnnotationType.LineList,
            points=pixels(lines),
            outline_colors=[color_message(color) for color in AXIS_COLORS],
            thickness=_AXIS,
            metadata=_which(detection),
        )
    ]


def _label(header: Header, detection: Detection, color: RGB) -> TextAnnotation:
    corners = np.asarray(detection.corners, dtype=np.float64)
    top = corners[np.argmin(corners[:, 1])]
    return TextAnnotation(
        timestamp=timestamp(header.stamp),
        position=pixels([top])[0],
        text=" · ".join(label_lines(detection)),
        font_size=_TEXT,
        text_color=color_message(readable_on(color)),
        background_color=color_message(color),
        metadata=_which(detection),
    )


def _which(detection: Detection) -> list[KeyValuePair]:
    return [
        KeyValuePair(key="name", value=detection.name),
        KeyValuePair(key="instance", value=str(detection.instance)),
    ]
