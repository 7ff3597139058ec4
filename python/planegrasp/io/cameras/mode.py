"""What a camera is asked to give."""

from __future__ import annotations

from dataclasses import dataclass

from planegrasp.errors import InvalidInputError


@dataclass(frozen=True, slots=True)
class StreamMode:
    """Size and rate of the images; None leaves them to the driver.

    Attributes:
        width: [px].
        height: [px].
        frames_per_second: of colour and depth.

    Raises:
        InvalidInputError: one of width and height without the other, or a value that is not > 0.
    """

    width: int | None = None
    height: int | None = None
    frames_per_second: int | None = None

    def __post_init__(self) -> None:
        if (self.width is None) != (self.height is None):
            raise InvalidInputError(
                f"give width and height of the images together, got {self.width} and {self.height}"
            )
        for value in (self.width, self.height, self.frames_per_second):
            if value is not None and value < 1:
                raise InvalidInputError(f"size and rate of the images must be > 0, got {self}")
