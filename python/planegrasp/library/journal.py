"""Several files of a folder changed at one instant, by a journal that is carried out after a kill.

Each file can be replaced atomically, but two cannot. Where more than one changes, their new texts
are first written into a journal: its rename is the instant of the change. Then the files are
replaced, and the journal is deleted. Who finds a journal reads the files' texts from it, and the
next one who may write carries it out.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from planegrasp.errors import LibraryError
from planegrasp.io.atomic import sync_folder, write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["JOURNAL", "change", "finish", "read"]

JOURNAL = ".planegrasp-save.json"


def read(path: Path) -> str | None:
    """The text of a file, as a journal beside it says, or as it is on disk; None without a file.

    Raises:
        LibraryError: the file or the journal cannot be read.
    """
    pending = _pending(path.parent)
    if path.name in pending:
        return pending[path.name]
    return _text(path)


def change(folder: Path, texts: Mapping[str, str]) -> None:
    """Replace files of a folder, by their names, all at one instant; equal ones stay untouched.

    Raises:
        LibraryError: a file that is there cannot be read.
        OSError: a file cannot be written.
    """
    finish(folder)
    changed = {name: text for name, text in texts.items() if _text(folder / name) != text}
    if len(changed) > 1:
        write_atomically(folder / JOURNAL, json.dumps(changed).encode())
    _carry_out(folder, changed)


def finish(folder: Path) -> None:
    """Carry out what a killed `change` has left.

    Raises:
        LibraryError: the journal cannot be read.
        OSError: a file cannot be written.
    """
    _carry_out(folder, _pending(folder))


def _carry_out(folder: Path, texts: Mapping[str, str]) -> None:
    for name, text in texts.items():
        write_atomically(folder / name, text.encode())
    journal = folder / JOURNAL
    if journal.exists():
        journal.unlink()
        sync_folder(folder)


def _pending(folder: Path) -> dict[str, str]:
    journal = folder / JOURNAL
    text = _text(journal)
    if text is None:
        return {}
    try:
        content = json.loads(text)
    except ValueError:
        content = None
    if not isinstance(content, dict) or not all(
        isinstance(part, str) and "/" not in name for name, part in content.items()
    ):
        raise LibraryError(f"{journal} is damaged: delete it to have the files beside it instead")
    return content


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise LibraryError(f"{path} cannot be read: {error}") from error
