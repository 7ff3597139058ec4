"""The errors of planegrasp: each says what was wrong, with what value, and what would be right."""

from __future__ import annotations


class PlanegraspError(Exception):
    """Base of every error that planegrasp raises on purpose."""


class InvalidInputError(PlanegraspError, ValueError):
    """An argument has a shape, type or value that cannot be worked with."""


class CameraError(InvalidInputError):
    """Camera parameters are impossible, or do not fit the image they are used with."""


class ImageError(InvalidInputError):
    """A colour image is not H×W×3 uint8."""


class DepthError(InvalidInputError):
    """A depth image does not fit its colour image or is not in metres."""


class TeachingError(PlanegraspError):
    """An object cannot be taught from what was given."""


class GraspError(PlanegraspError):
    """A grasp cannot be what was meant: wrong units, swapped frames, or not at the object."""


class PoseError(PlanegraspError):
    """No pose can be computed from the evidence; the message says what is missing."""


class LibraryError(PlanegraspError):
    """The library on disk cannot be read or written."""


class SchemaVersionError(LibraryError):
    """A file was written by a newer planegrasp than this one."""


class DuplicateObjectError(LibraryError):
    """An object of that name exists already."""


class UnknownObjectError(LibraryError, KeyError):
    """No object of that name exists."""

    def __str__(self) -> str:
        return Exception.__str__(self)


class SourceError(PlanegraspError):
    """A file or folder with frames is missing, damaged or not in a known layout."""


class CameraLostError(PlanegraspError):
    """A live camera is not there, or has stopped giving frames; opening it again may help."""


class RecordingError(PlanegraspError):
    """A recording cannot be written, or not any further; the message says what can be read."""


class ViewerError(PlanegraspError):
    """A viewer cannot be started, or takes no data any more."""


class NetworkError(PlanegraspError):
    """A network interface is not there, or cannot be used."""


class RobotError(PlanegraspError):
    """A robot cannot be loaded, or lacks what is asked of it; the message lists what it has."""


class MissingExtraError(PlanegraspError, ImportError):
    """A feature needs an optional dependency that is not installed."""

    def __init__(self, feature: str, extra: str, detail: str = "") -> None:
        super().__init__(
            f"an optional dependency is missing for {feature}: install it with "
            f"`pip install 'planegrasp[{extra}]'`" + (f" ({detail})" if detail else "")
        )
