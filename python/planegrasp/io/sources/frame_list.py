"""frames.txt of a recorded RGB-D folder: which frames are complete, and their timestamps.

    000000 1700000000.033333        name of the images, timestamp [s]
    000001 1700000000.066667
    end                             written when the recording was finished

A line is written after its images. What follows the last complete line, and images without a line,
are of a frame that was not finished.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

FRAME_LIST = "frames.txt"
END = "end\n"


@dataclass(frozen=True, slots=True)
class FrameList:
    """What a frames.txt says.

    Attributes:
        stamps: timestamp [s] by name, in order.
        finished: whether the recording was.
    """

    stamps: dict[str, float]
    finished: bool


def line_of(name: str, stamp: float) -> str:
    """The line of a frame."""
    return f"{name} {stamp:.6f}\n"


def read_frame_list(path: Path) -> FrameList:
    """Read a frames.txt.

    Raises:
        SourceError: it cannot be read, or a complete line of it is wrong.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"{path} cannot be read: {error}") from error
    lines = text.split("\n")[:-1]  # without what has no end of line yet
    finished = bool(lines) and lines[-1] == END.strip()
    stamps: dict[str, float] = {}
    for number, line in enumerate(lines[: len(lines) - finished], start=1):
        try:
            name, stamp = line.split()
            stamps[name] = float(stamp)
        except ValueError:
            raise SourceError(
                f"{path}, line {number}: expected `name timestamp`, got {line!r}"
            ) from None
    return FrameList(stamps, finished)
