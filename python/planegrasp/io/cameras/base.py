"""What a live camera is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from planegrasp.rgbd import RGBDFrame


class Camera(Protocol):
    """A device that gives frames as time goes on; `NewestFrame` reads one in a thread.

    A camera that is made holds no device yet. `open`, `read` and `close` are called by one thread
    at a time; after `close` it can be opened again.

    Timestamps of the frames are seconds since 1970 by this computer's clock (`time.time`): that of
    the driver where it knows when a frame was taken, else the instant at which it arrived.
    """

    @property
    def name(self) -> str:
        """What `open_camera` was asked for, for example ``realsense:0123456789``."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know, one sentence each, for example of an assumed focal length."""
        ...

    def open(self) -> None:
        """Start the device; nothing happens where it runs already.

        Raises:
            CameraLostError: it is not there, is in use, or does not start.
        """
        ...

    def read(self) -> RGBDFrame:
        """Wait for the next frame, a few seconds at most.

        Raises:
            CameraLostError: none came: the device vanished, or was not opened.
            CameraError: the intrinsics that were given are not for these images.
        """
        ...

    def close(self) -> None:
        """Release the device; nothing happens where it is closed already."""
        ...


@runtime_checkable
class Reporting(Protocol):
    """A camera that has something to say while it runs."""

    def take_reports(self) -> list[str]:
        """What there is to say since this was last called, one sentence each, nothing twice."""
        ...
