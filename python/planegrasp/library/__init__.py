"""The library: a folder with one sub-folder an object, safe to edit by hand and to be killed in."""

from __future__ import annotations

from planegrasp.library.library import ObjectLibrary
from planegrasp.library.storage import scan

__all__ = ["ObjectLibrary", "scan"]
