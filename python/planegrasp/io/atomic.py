"""Replacing files so that a kill at any instant leaves the old or the new one, never half."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def write_atomically(path: str | Path, data: bytes) -> None:
    """Write a file through a temporary one in the same folder: write, fsync, rename.

    The folder is created where it is missing. What a killed write leaves behind is a file named
    ``.NAME.<hex>.tmp``, which nothing reads.

    Raises:
        OSError: the folder or the file cannot be written; an existing file is left as it was.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(6)}.tmp")
    try:
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def sync_folder(folder: str | Path) -> None:
    """Make renames in a folder durable.

    Raises:
        OSError: the folder is missing or its file system cannot be synchronised.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
