"""Import this before all that needs the extra `foxglove`: the error then says what to install."""

from __future__ import annotations

from planegrasp.errors import MissingExtraError

try:
    import foxglove  # noqa: F401
except ImportError as error:
    raise MissingExtraError("Foxglove", "foxglove", str(error)) from error
