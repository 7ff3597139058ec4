"""Showing fewer images than there are frames."""

from __future__ import annotations

__all__ = ["PictureRate"]


class PictureRate:
    """Chooses the frames whose images are shown, by the frames' time.

    Args:
        rate: images a second at most [Hz]; 0 for none, None for those of every frame.
    """

    def __init__(self, rate: float | None) -> None:
        self._rate = rate
        self._last: float | None = None

    def is_due(self, seconds: float | None) -> bool:
        """Whether the image of a frame is to be shown; it counts as shown then.

        Args:
            seconds: timestamp of the frame; without one every image is shown.
        """
        if self._rate is None:
            return True
        if not self._rate:
            return False
        if self._last is not None and seconds is not None:
            since = seconds - self._last
            # A little early is on time: frames come at times of their own.
            if since >= 0 and since * self._rate <= 0.99:
                return False
        self._last = seconds
        return True

    def restart(self) -> None:
        """The next image is due, for example because the camera is another one."""
        self._last = None
