"""What the commands share: options, number lists, tables' console, JSON and errors."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.errors import InvalidInputError, LibraryError

if TYPE_CHECKING:
    from rich.console import Console

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.library import ObjectLibrary
    from planegrasp.objects import ObjectModel
    from planegrasp.teaching.quality import TeachingQuality

__all__ = [
    "JsonOption",
    "LibraryOption",
    "console",
    "grasp_row",
    "messages",
    "parse_numbers",
    "pose_row",
    "print_error",
    "print_json",
    "quality_row",
    "wanted_models",
]

LibraryOption = Annotated[
    Path, typer.Option("--library", "-l", help="Folder of the taught objects.", metavar="FOLDER")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def console() -> Console:
    """Where tables go: standard output."""
    from rich.console import Console

    return Console(highlight=False)


def messages() -> Console:
    """Where progress goes: standard error."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def print_error(message: str) -> None:
    """Print `error: …` to standard error."""
    from rich.console import Console
    from rich.text import Text

    line = Text.assemble(("error: ", "bold red"), message)
    Console(stderr=True, highlight=False).print(line, soft_wrap=True)


def print_json(content: object) -> None:
    """Print to standard output as indented JSON."""
    typer.echo(json.dumps(content, indent=1, ensure_ascii=False))


def parse_numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    """The numbers in a text, separated by commas, semicolons or spaces.

    Raises:
        InvalidInputError: there are not exactly `count` of them, or they are not numbers.
    """
    parts = [part for part in re.split(r"[,;\s]+", text.strip()) if part]
    try:
        numbers = tuple(float(part) for part in parts)
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise InvalidInputError(f"{what} takes {count} numbers, got {text!r}")
    return numbers


def quality_row(quality: TeachingQuality) -> dict[str, object]:
    """A verdict as it is printed in JSON."""
    return {
        "score": quality.score,
        "usable": quality.usable,
        "reasons": list(quality.reasons),
        "figures": dict(quality.figures),
    }


def pose_row(T: RigidTransform) -> dict[str, list[float]]:
    """A pose as it is printed in JSON: translation [m] and quaternion (x, y, z, w ≥ 0)."""
    return {
        "translation": T.translation.tolist(),
        "quaternion": T.rotation.as_quat(canonical=True).tolist(),
    }


def grasp_row(grasp: CanonicalGrasp) -> dict[str, object]:
    """A grasp as it is printed in JSON."""
    return {
        "name": grasp.name,
        "T_object_gripper": pose_row(grasp.T_object_gripper),
        "opening": grasp.opening,
        "approach": grasp.approach,
        "pregrasp_distance": grasp.pregrasp_distance,
        "force": grasp.force,
    }


def wanted_models(
    library: Path, only: list[str] | None = None
) -> ObjectLibrary | list[ObjectModel]:
    """The whole library, or the objects asked for.

    Raises:
        LibraryError: the library is empty, damaged or has no object of that name.
    """
    from planegrasp.library import ObjectLibrary

    objects = ObjectLibrary(library)
    if not len(objects):
        where = f"the library {library} is empty" if library.exists() else f"no library {library}"
        raise LibraryError(
            f"{where}: teach an object first, for example "
            f"`planegrasp teach book book.jpg --width 0.21 --library {library}`"
        )
    return [objects[name] for name in dict.fromkeys(only)] if only else objects
