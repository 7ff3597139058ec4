"""The layout of the TUM RGB-D benchmark (Sturm, Engelhard, Endres, Burgard, Cremers, IROS 2012).

`rgb.txt` and `depth.txt` list `timestamp file` a line, `#` starts a comment. Colour and depth are
taken at different instants; each colour frame goes with the depth image nearest in time. Depth is
16 bits, 5000 units a metre.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.sources.sequence import FrameFiles, ImageSequence, fixed_camera

if TYPE_CHECKING:
    from pathlib import Path

COLOR_LIST, DEPTH_LIST = "rgb.txt", "depth.txt"
DEPTH_SCALE = 1 / 5000
"""Metres per unit of a depth image of this benchmark."""

LARGEST_GAP = 0.02
"""Colour and depth may be this far apart in time [s]."""

# The calibrations that the benchmark publishes for its three Kinects; sequences of the third are
# undistorted already. The first entry, OpenNI's default, is for sequences of another name.
_DEFAULT_CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
_CAMERAS = {
    "freiburg1": PinholeCamera(
        640, 480, 517.3, 516.5, 318.6, 255.3, (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)
    ),
    "freiburg2": PinholeCamera(
        640, 480, 520.9, 521.0, 325.1, 249.7, (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)
    ),
    "freiburg3": PinholeCamera(640, 480, 535.4, 539.2, 320.1, 247.6),
}


def tum_camera(name: str) -> tuple[PinholeCamera, str]:
    """The published camera for a sequence of this name, and what to tell the user about it."""
    for part, camera in _CAMERAS.items():
        if part in name.lower():
            return camera, f"no camera given: taking the benchmark's calibration of {part}"
    return _DEFAULT_CAMERA, (
        f"no camera given, and {name!r} names none of {', '.join(_CAMERAS)}: "
        f"taking OpenNI's default, f = 525 px"
    )


def tum_sequence(
    path: Path, camera: PinholeCamera | None = None, depth_scale: float = DEPTH_SCALE
) -> ImageSequence:
    """Open a sequence; colour frames without depth within `LARGEST_GAP` are left out, and noted.

    Raises:
        SourceError: a list is missing, a line of it is wrong, or no two frames go together.
    """
    colors = _read_list(path / COLOR_LIST)
    depths = _read_list(path / DEPTH_LIST)
    notes = []
    if camera is None:
        camera, note = tum_camera(path.resolve().name)
        notes.append(note)
    pairs = associate(
        np.array([stamp for stamp, _ in colors]), np.array([stamp for stamp, _ in depths])
    )
    if not pairs:
        raise SourceError(
            f"{path}: no colour frame has a depth image within {1000 * LARGEST_GAP:.0f} ms "
            f"({len(colors)} colour, {len(depths)} depth): are the timestamps of one clock?"
        )
    if len(pairs) < len(colors):
        notes.append(
            f"{len(colors) - len(pairs)} of {len(colors)} colour frames have no depth image "
            f"within {1000 * LARGEST_GAP:.0f} ms and are left out"
        )
    for_size = fixed_camera(camera)
    files = [
        FrameFiles(
            name=colors[i][1].stem,
            color=colors[i][1],
            depth=depths[j][1],
            camera=for_size,
            depth_scale=depth_scale,
            timestamp=colors[i][0],
        )
        for i, j in pairs
    ]
    return ImageSequence(path.name, files, camera, tuple(notes))


def associate(
    colors: np.ndarray[tuple[int], np.dtype[np.float64]],
    depths: np.ndarray[tuple[int], np.dtype[np.float64]],
    largest_gap: float = LARGEST_GAP,
) -> list[tuple[int, int]]:
    """Pair two lists of timestamps [s], closest pairs first, each stamp in at most one pair.

    Returns:
        Indices (colour, depth) in the order of the colour stamps.
    """
    order = np.argsort(depths, kind="stable")
    first = np.searchsorted(depths[order], colors - largest_gap, side="left")
    last = np.searchsorted(depths[order], colors + largest_gap, side="right")
    candidates = sorted(
        (abs(float(colors[i] - depths[j])), i, int(j))
        for i in range(len(colors))
        for j in order[first[i] : last[i]]
    )
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for _, i, j in candidates:
        if i not in partner and j not in taken:
            partner[i] = j
            taken.add(j)
    return [(i, partner[i]) for i in sorted(partner, key=lambda i: float(colors[i]))]


def _read_list(path: Path) -> list[tuple[float, Path]]:
    """The (timestamp [s], file) pairs of one list."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        raise SourceError(
            f"a TUM RGB-D sequence has a file {path.name}, {path} is missing"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"{path} cannot be read: {error}") from error
    entries = []
    for number, line in enumerate(lines, start=1):
        content = line.split("#", 1)[0].split()
        if not content:
            continue
        try:
            stamp, name = content
            entries.append((float(stamp), path.parent / name))
        except ValueError:
            raise SourceError(
                f"{path}, line {number}: expected `timestamp file`, got {line.strip()!r}"
            ) from None
    if not entries:
        raise SourceError(f"{path} lists no images")
    return entries
