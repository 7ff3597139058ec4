"""Detections drawn on the frame: outline, axes and a label for each object."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.viz.drawing import (
    FARTHEST_PX,
    SUBPIXEL_BITS,
    arrow,
    blended,
    fill,
    fixed_point,
    polygon,
    rounded,
)
from planegrasp.viz.geometry import axis_ends, face_outline, face_size
from planegrasp.viz.palette import AXIS_COLORS, INK, color_of, readable_on
from planegrasp.viz.text import SEMIBOLD, draw_text, text_width

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB

    Image = NDArray[np.uint8]
    Float64Array = NDArray[np.float64]
    Box = tuple[int, int, int, int]  # left, top, width, height [px]

_TINT, _SHADE, _LABEL = 0.10, 0.45, 0.92  # opacities of the face's tint, of shadows, of labels


def draw_detections(
    frame: RGBDFrame,
    detections: Sequence[Detection],
    colors: Mapping[str, RGB] | None = None,
) -> Image:
    """Draw on a copy of the frame's image.

    Each found face gets its outline, each object with a pose its axes (x red, y green, z blue,
    half as long as the face's shorter side) and a label inside of the image with name, instance,
    distance and number of inliers. Line widths and text grow with the image.

    Args:
        frame: in which the detections were made.
        detections: of `Detector.detect`.
        colors: colour (RGB) by object name, for example of `object_colors(library)`; other
            objects get one by their name.

    Returns:
        H×W×3 uint8 RGB.
    """
    image = frame.color.copy()
    height, width = image.shape[:2]
    unit = max(1.0, math.hypot(width, height) / 800)
    for detection in detections:
        _draw_outlines(image, frame, detection, color_of(detection.name, colors), unit)
    for detection in detections:
        _draw_axes(image, frame, detection, unit)
    labels: list[Box] = []
    for detection in detections:
        others = [_bounds(other) for other in detections if other is not detection]
        color = color_of(detection.name, colors)
        labels.append(_draw_label(image, detection, color, unit, avoid=[*labels, *others]))
    return image


def _draw_outlines(
    image: Image, frame: RGBDFrame, detection: Detection, color: RGB, unit: float
) -> None:
    for face in detection.faces:
        outline = fixed_point(face_outline(face, frame.camera))
        with blended(image, _TINT) as layer:
            fill(layer, outline, color)
        with blended(image, _SHADE) as layer:
            polygon(layer, outline, INK, 4.5 * unit)
        polygon(image, outline, color, 2 * unit)


def _draw_axes(image: Image, frame: RGBDFrame, detection: Detection, unit: float) -> None:
    if detection.pose is None:
        return
    length = min(face_size(detection, frame.camera)) / 2
    ends = axis_ends(detection, frame.camera, length)
    if ends is None:
        return
    origin, tips = ends[0], ends[1:]
    # The axis whose end is farthest away first, so that nearer ones cover it.
    depths = detection.pose.T_camera_object.rotation.as_matrix()[2]
    order = np.argsort(-depths)
    with blended(image, _SHADE) as layer:
        for axis in order:
            arrow(layer, origin, tips[axis], INK, 5 * unit)
    for axis in order:
        arrow(image, origin, tips[axis], AXIS_COLORS[axis], 3 * unit)
    center = fixed_point(origin[None])[0]
    radius = round(2.5 * unit * 2**SUBPIXEL_BITS)
    cv2.circle(image, center.tolist(), radius, (255, 255, 255), -1, cv2.LINE_AA, SUBPIXEL_BITS)


def _draw_label(
    image: Image, detection: Detection, color: RGB, unit: float, *, avoid: Sequence[Box]
) -> Box:
    title, details = label_lines(detection)
    size, small, pad = round(15 * unit), round(12 * unit), round(6 * unit)
    width = max(text_width(title, size, SEMIBOLD), text_width(details, small)) + 2 * pad
    height = round(1.15 * size + 1.25 * small) + 2 * pad
    corners = np.vstack([face.corners for face in detection.faces])
    left, top, *_ = box = place_label(corners, (width, height), image, round(8 * unit), avoid)
    with blended(image, _LABEL) as layer:
        rounded(layer, box, color, round(4 * unit))
    ink = readable_on(color)
    baseline = top + pad + round(0.85 * size)
    draw_text(image, title, (left + pad, baseline), ink, size=size, weight=SEMIBOLD)
    below = baseline + round(0.3 * size + 0.95 * small)
    draw_text(image, details, (left + pad, below), ink, size=small)
    return box


def label_lines(detection: Detection) -> tuple[str, str]:
    """The two lines of a label: which object, and how far and how certain."""
    title = detection.name + (f" #{detection.instance + 1}" if detection.instance else "")
    if detection.pose is None:
        return title, f"no pose · {detection.inliers} inliers"
    distance = float(np.linalg.norm(detection.pose.T_camera_object.translation))
    doubt = " · ambiguous" if detection.ambiguous else ""
    return title, f"{distance:.3f} m · {detection.inliers} inliers{doubt}"


def place_label(
    corners: Float64Array,
    size: tuple[int, int],
    image: Image,
    gap: int,
    avoid: Sequence[Box],
) -> Box:
    """A box for a label: above the object, else below or beside it, always inside of the image.

    Args:
        corners: N×2 pixels of the object.
        size: width and height of the label [px].
        image: that it is drawn on.
        gap: between object and label [px].
        avoid: boxes of other labels and objects, left free where there is room.

    Returns:
        Left, top, width and height [px].
    """
    width, height = size
    rows, columns = image.shape[:2]
    (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
    middle = (left + right) / 2 - width / 2
    candidates = [
        (middle, top - gap - height),
        (middle, bottom + gap),
        (right + gap, (top + bottom - height) / 2),
        (left - gap - width, (top + bottom - height) / 2),
        (middle, top + gap),
    ]
    best: tuple[float, Box] | None = None
    for x, y in candidates:
        inside_x = float(np.clip(x, 0, max(columns - width, 0)))
        inside_y = float(np.clip(y, 0, max(rows - height, 0)))
        box = (int(inside_x), int(inside_y), width, height)
        moved = abs(inside_x - x) + abs(inside_y - y)
        cost = moved + sum(_overlap(box, other) for other in avoid)
        if best is None or cost < best[0]:
            best = cost, box
    assert best is not None
    return best[1]


def _bounds(detection: Detection) -> Box:
    """The box around an object's faces."""
    corners = np.vstack([face.corners for face in detection.faces])
    near = np.clip(corners, -FARTHEST_PX, FARTHEST_PX)
    left, top = near.min(axis=0)
    width, height = near.max(axis=0) - (left, top)
    return int(left), int(top), int(width), int(height)


def _overlap(a: Box, b: Box) -> int:
    """Area [px²] that two boxes share."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(width, 0) * max(height, 0)
