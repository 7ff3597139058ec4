"""Objects as they are seen in one frame, and as they are followed over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.io.messages.pose import (
    Box,
    Pose,
    PoseWithCovariance,
    TwistWithCovariance,
    flat_covariance,
    parent_covariance,
    triple,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.io.messages.header import Header
    from planegrasp.tracking import Track

__all__ = [
    "DetectedObject",
    "DetectionsMessage",
    "TrackedObject",
    "TracksMessage",
    "detections_message",
    "tracks_message",
]

Corner = tuple[float, float]


@dataclass(frozen=True, slots=True)
class DetectedObject:
    """One object seen in one frame.

    Attributes:
        name: of the object in the library.
        instance: 0 for the best supported one of this name, then 1, 2, …
        track: number of the track that it belongs to; None where it is not followed.
        tracked: whether it was followed from the frame before rather than found anew.
        score: confidence 0 … 1.
        inliers: matches, or parts of the faces, that agree.
        corners: of the best supported face [px]: its reference image's top-left, top-right,
            bottom-right and bottom-left corner.
        box: around the object, in its own frame.
        pose: of the object in the camera's optical frame; None where there is none.
        alternative: a second pose that explains the image about as well.
        pose_failure: why there is no pose, or "".
    """

    name: str
    instance: int
    track: int | None
    tracked: bool
    score: float
    inliers: int
    corners: tuple[Corner, ...]
    box: Box
    pose: PoseWithCovariance | None
    alternative: Pose | None
    pose_failure: str


@dataclass(frozen=True, slots=True)
class DetectionsMessage:
    """All objects that are seen in one frame, also none.

    Attributes:
        header: of the image; its frame is the camera's optical one.
        objects: in the detector's order.
    """

    header: Header
    objects: tuple[DetectedObject, ...]


@dataclass(frozen=True, slots=True)
class TrackedObject:
    """One object that is followed.

    Attributes:
        number: of the track; no other has it.
        name: of the object in the library.
        instance: its number among the tracks of this object.
        seen: whether it is in this very frame; else the pose is a prediction.
        reason: why it is not seen, or "".
        moves: probability that it moves, 0 … 1.
        box: around the object, in its own frame.
        pose: filtered over time. Where it is seen, the covariance has the part that all frames
            share, too (`PoseEstimate.noise_covariance`).
        twist: velocity along the axes of the header's frame.
    """

    number: int
    name: str
    instance: int
    seen: bool
    reason: str
    moves: float
    box: Box
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass(frozen=True, slots=True)
class TracksMessage:
    """All objects that are followed after one frame, and which are no more.

    Attributes:
        header: its frame is the one in which tracks live: that of the camera where it stands still.
        objects: in the order in which they were found.
        lost: numbers of the tracks that ended with this frame.
    """

    header: Header
    objects: tuple[TrackedObject, ...]
    lost: tuple[int, ...] = ()


def detections_message(
    detections: Iterable[Detection], header: Header, tracks: Iterable[Track] = ()
) -> DetectionsMessage:
    """The message of what was detected in a frame.

    Args:
        detections: of the frame.
        header: of the frame's image, in the camera's optical frame.
        tracks: as of the same frame, which give the detections their numbers.
    """
    numbers = {id(track.detection): track.number for track in tracks if track.detection is not None}
    return DetectionsMessage(header, tuple(_detected(d, numbers.get(id(d))) for d in detections))


def tracks_message(
    tracks: Iterable[Track],
    header: Header,
    lost: Iterable[Track] = (),
) -> TracksMessage:
    """The message of what is followed.

    Args:
        tracks: after the frame.
        header: with the stamp of the frame's image and the fixed frame of the tracks.
        lost: tracks that ended with the frame.
    """
    objects = tuple(_tracked(track) for track in tracks)
    return TracksMessage(header, objects, tuple(track.number for track in lost))


def _detected(detection: Detection, track: int | None) -> DetectedObject:
    pose = detection.pose
    shown = alternative = None
    if pose is not None:
        T, covariance = pose.T_camera_object, pose.covariance
        turned = None if covariance is None else flat_covariance(parent_covariance(T, covariance))
        shown = PoseWithCovariance(Pose.of(T), turned)
        if pose.ambiguous and pose.alternative is not None:
            alternative = Pose.of(pose.alternative)
    return DetectedObject(
        name=detection.name,
        instance=detection.instance,
        track=track,
        tracked=detection.tracked,
        score=float(detection.score),
        inliers=detection.inliers,
        corners=tuple((x, y) for x, y in np.asarray(detection.corners, np.float64).tolist()),
        box=Box.of(detection.model.outer_body),
        pose=shown,
        alternative=alternative,
        pose_failure=detection.pose_failure,
    )


def _tracked(track: Track) -> TrackedObject:
    filtered = track.filtered
    covariance = filtered.covariance[:6, :6] + _shared(track, filtered.T_base_object)
    return TrackedObject(
        number=track.number,
        name=track.name,
        instance=track.instance,
        seen=track.detection is not None,
        reason=track.reason,
        moves=float(track.moves),
        box=Box.of(track.model.outer_body),
        pose=PoseWithCovariance(Pose.of(filtered.T_base_object), flat_covariance(covariance)),
        twist=TwistWithCovariance(
            triple(filtered.linear_velocity),
            triple(filtered.angular_velocity),
            flat_covariance(filtered.covariance[6:, 6:]),
        ),
    )


def _shared(track: Track, T_fixed_object: RigidTransform) -> NDArray[np.float64]:
    """Covariance of what is the same in all frames, which no filter over time takes away."""
    pose = None if track.detection is None else track.detection.pose
    if pose is None or pose.covariance is None or pose.noise_covariance is None:
        return np.zeros((6, 6))
    return parent_covariance(T_fixed_object, pose.covariance - pose.noise_covariance)
