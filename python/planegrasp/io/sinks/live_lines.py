"""What a live system sees as JSON Lines: one frame a line, whole lines also on a full disk.

Keys of each line, beside those of `as_dict`:

    tracks       what is followed, seen in this frame or not:
        number, name, instance    as in `Track`
        seen                      whether it is in this frame
        reason                    why not, or ""
        moves                     probability that it moves, 0 … 1
        translation, quaternion   of the filtered pose in the fixed frame [m], x, y, z, w
        linear_velocity           [m/s], along the axes of the fixed frame
        angular_velocity          [rad/s]
    new, lost    numbers of the tracks that began and ended with this frame
    skipped      what there was no time for: name, instance (null: not looked for), reason
    seconds      that each stage took

The fixed frame is the camera's where the camera stands still.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError
from planegrasp.io.sinks.as_dict import frame_to_dict

if TYPE_CHECKING:
    from planegrasp.live import LiveFrame
    from planegrasp.tracking import Track

__all__ = ["LiveLinesWriter", "live_frame_to_dict"]


def live_frame_to_dict(seen: LiveFrame) -> dict[str, Any]:
    """What is known after a frame, ready for `json.dumps`; keys as in this module's docstring."""
    return {
        **frame_to_dict(seen.frame, seen.detections),
        "tracks": [_track(track) for track in seen.tracks],
        "new": [track.number for track in seen.new],
        "lost": [track.number for track in seen.lost],
        "skipped": [
            {"name": one.name, "instance": one.instance, "reason": one.reason}
            for one in seen.skipped
        ],
        "seconds": dict(seen.seconds),
    }


class LiveLinesWriter(ClosesAtEnd):
    """Writes one JSON object a frame; each line is on its way to the disk before the next begins.

    Attributes:
        frames: how many were written.
    """

    def __init__(self, path: str | Path) -> None:
        """Begin a file, which must not exist.

        Raises:
            RecordingError: it exists, or cannot be made.
        """
        self.path = Path(path)
        self.frames = 0
        self._size = 0
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("xb", buffering=0)
        except OSError as error:
            if self.path.exists():
                raise RecordingError(f"{path} exists already: give a new name") from error
            raise RecordingError(f"{path} cannot be written: {error.strerror}") from error

    def write(self, seen: LiveFrame) -> None:
        """Write the line of one frame.

        Raises:
            RecordingError: it cannot be written, for example because the disk is full; the lines
                before are whole.
        """
        row = json.dumps(live_frame_to_dict(seen), ensure_ascii=False, allow_nan=False)
        line = memoryview((row + "\n").encode())
        written = 0
        try:
            while written < len(line):
                written += self._file.write(line[written:])
        except OSError as error:
            self._file.truncate(self._size)
            raise RecordingError(
                f"{self.path} cannot be written any further: {error.strerror}; the {self.frames} "
                f"lines before can be read"
            ) from error
        self._size += written
        self.frames += 1

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _track(track: Track) -> dict[str, Any]:
    pose = track.filtered
    return {
        "number": track.number,
        "name": track.name,
        "instance": track.instance,
        "seen": track.detection is not None,
        "reason": track.reason,
        "moves": track.moves,
        "translation": pose.T_base_object.translation.tolist(),
        "quaternion": pose.T_base_object.rotation.as_quat(canonical=True).tolist(),
        "linear_velocity": pose.linear_velocity.tolist(),
        "angular_velocity": pose.angular_velocity.tolist(),
    }
