"""Features of a face, kept so that a detector starts fast: arrays in one `.npz` file a key.

The cache is a convenience. A file that is missing, truncated or damaged in any way is absent and
is replaced; a folder that cannot be written means no cache. Neither is ever an error.
"""

from __future__ import annotations

import hashlib
import io
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.io.atomic import write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.objects import PlanarFace

    Array = NDArray[np.generic]

__all__ = ["feature_key", "load", "store"]

_DIGEST = "_digest"


def feature_key(face: PlanarFace, settings: str) -> str:
    """The key of what is computed from a face's image with these settings: 64 hexadecimal digits.

    `settings` must name everything that the result depends on, a version of the code included.
    """
    return hashlib.sha256(f"{face.image_digest}\n{settings}".encode()).hexdigest()


def load(path: Path | None, key: str) -> dict[str, Array] | None:
    """Read the arrays of a key.

    Args:
        path: the cache folder, as `ObjectLibrary.cache_dir` gives it; None is an empty cache.
        key: from `feature_key`.

    Returns:
        The arrays exactly as they were stored, or None.
    """
    if path is None:
        return None
    try:
        # Opened here, because np.load leaves a damaged file open.
        with _file(path, key).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception:  # whatever a damaged archive makes NumPy and zipfile raise
        return None
    stored = arrays.pop(_DIGEST, None)
    if stored is None or not np.array_equal(stored, _digest(arrays)):
        return None
    return arrays


def store(path: Path | None, key: str, arrays: Mapping[str, Array]) -> None:
    """Keep arrays under a key, atomically; does nothing where the folder cannot be written."""
    if path is None or not path.parent.is_dir():
        return
    stream = io.BytesIO()
    content = {**arrays, _DIGEST: _digest(arrays)}
    np.savez(stream, **content)  # type: ignore[arg-type]  # the stubs read names as options
    try:
        write_atomically(_file(path, key), stream.getvalue())
    except OSError:
        return


def _file(path: Path, key: str) -> Path:
    return path / f"{key}.npz"


def _digest(arrays: Mapping[str, Array]) -> NDArray[np.uint8]:
    """SHA-256 over names, types, shapes and values."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return np.frombuffer(digest.digest(), np.uint8)
