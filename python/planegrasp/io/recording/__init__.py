"""Recording frames so that `open_source` reads them back: RGB-D folders and MCAP files."""

from planegrasp.io.recording.base import Recorder
from planegrasp.io.recording.folder import FolderRecorder
from planegrasp.io.recording.opening import open_recorder

__all__ = ["FolderRecorder", "Recorder", "open_recorder"]
