"""Choosing a recorder by the name of what is to be written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.errors import RecordingError

if TYPE_CHECKING:
    from planegrasp.io.recording.base import Recorder


def open_recorder(path: str | Path) -> Recorder:
    """Begin a recording: an MCAP file where the name ends in .mcap, else an RGB-D folder.

    Raises:
        RecordingError: there is something of that name already, the suffix names another kind of
            file, or it cannot be written.
        MissingExtraError: MCAP needs the extra `bags`.
    """
    path = Path(path)
    if path.exists() and not (path.is_dir() and not any(path.iterdir())):
        raise RecordingError(f"{path} exists already: give a new name")
    if path.suffix.lower() == ".mcap":
        from planegrasp.io.recording.mcap_file import McapRecorder

        return McapRecorder(path)
    if path.suffix:
        raise RecordingError(
            f"{path.name} names no kind of recording: give NAME.mcap, or NAME for an RGB-D folder"
        )
    from planegrasp.io.recording.folder import FolderRecorder

    return FolderRecorder(path)
