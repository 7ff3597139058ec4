"""Judge an object and put it into a library, or refuse it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.errors import TeachingError
from planegrasp.teaching.quality import TeachingQuality, assess

if TYPE_CHECKING:
    from planegrasp.features.base import Extractor
    from planegrasp.library import ObjectLibrary
    from planegrasp.objects import ObjectModel

__all__ = ["judge", "teach"]


def teach(
    library: ObjectLibrary,
    model: ObjectModel,
    *,
    replace: bool = False,
    extractor: Extractor | None = None,
) -> dict[str, TeachingQuality]:
    """Add an object to a library and save it, if every one of its faces can be recognised.

    Args:
        library: is saved if it has a folder.
        model: the object.
        replace: take the place of an object of the same name.
        extractor: with which it will be looked for; None is SIFT.

    Returns:
        The verdict on each face, by its name.

    Raises:
        TeachingError: a face cannot be recognised; the message gives the reasons. Nothing changed.
        DuplicateObjectError: there is an object of that name and replace is False.
        LibraryError: the library cannot be written.
    """
    verdicts = judge(model, extractor)
    library.add(model, replace=replace)
    if library.path is not None:
        library.save()
    return verdicts


def judge(model: ObjectModel, extractor: Extractor | None = None) -> dict[str, TeachingQuality]:
    """The verdict on each face of an object, by its name.

    Raises:
        TeachingError: a face cannot be recognised.
    """
    verdicts = {face.name: assess(face.image, extractor) for face in model.faces}
    for name, quality in verdicts.items():
        if not quality.usable:
            reasons = "".join(f"\n  - {reason}" for reason in quality.reasons)
            raise TeachingError(
                f"face {name!r} of {model.name!r} cannot be recognised "
                f"(quality {quality.score} of 100):{reasons}"
            )
    return verdicts
