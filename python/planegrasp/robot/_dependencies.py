"""Import this before anything that needs the extra `robot`: the error then says what to install."""

from __future__ import annotations

from planegrasp.errors import MissingExtraError

try:
    import daqp  # noqa: F401
    import mink  # noqa: F401
    import mujoco  # noqa: F401
    import ompl  # noqa: F401
except ImportError as error:
    raise MissingExtraError("robots", "robot") from error
