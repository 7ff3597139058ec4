"""A library's files, as an editor and as a file system see them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


def edit(path: Path, old: str, new: str) -> None:
    """Replace text in a file by hand."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def snapshot(folder: Path) -> dict[Path, tuple[int, int]]:
    """Of everything below a folder when it was written, and as which file."""
    return {p: (p.stat().st_mtime_ns, p.stat().st_ino) for p in folder.rglob("*")}
