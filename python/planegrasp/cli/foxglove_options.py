"""Options of the commands that log for Foxglove."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planegrasp.cli.common import messages

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.io.foxglove import FoxgloveConfig, FoxgloveStream
    from planegrasp.objects import ObjectModel

__all__ = ["LogColorOption", "foxglove_config", "foxglove_stream", "log_option"]

LogColorOption = Annotated[
    str,
    typer.Option(
        help="Colour images for Foxglove: png and raw are exact, jpeg is small.",
        metavar="png|jpeg|raw",
    ),
]


def log_option(panel: str | None = None) -> Any:
    """The option of a new log, in a panel of the help."""
    return typer.Option(
        help="New MCAP log for Foxglove: frames and all that is seen; it is read back like a "
        "recording.",
        metavar="FILE.mcap",
        rich_help_panel=panel,
    )


def foxglove_config(color: str, image_rate: float | None = None) -> FoxgloveConfig:
    """What the options ask for.

    Args:
        color: of `--log-color`.
        image_rate: images a second at most [Hz]; None for those of every frame.

    Raises:
        InvalidInputError: there is no such format.
        MissingExtraError: foxglove-sdk is not installed.
    """
    from planegrasp.io.foxglove import ColorFormat, FoxgloveConfig

    return FoxgloveConfig(color=ColorFormat.named(color), image_rate=image_rate)


def foxglove_stream(
    models: Iterable[ObjectModel], address: str | None, config: FoxgloveConfig
) -> FoxgloveStream:
    """A stream, and where it is served the user is told where.

    Args:
        models: all objects that may be seen.
        address: where to serve it, see `ServerAddress.parsed`; None for not at all.
        config: what is logged.

    Raises:
        InvalidInputError: the address is none.
        ViewerError: the port is taken, or the host is no address of this computer.
    """
    from planegrasp.io.foxglove import FoxgloveStream, ServerAddress

    # The library tells of clients that come and go; that is nothing to print between events.
    logging.getLogger("foxglove").addHandler(logging.NullHandler())
    stream = FoxgloveStream(models, config)
    if address is not None:
        server = stream.serve(ServerAddress.parsed(address))
        note = ", for everybody who can reach this computer" if server.address.is_on_network else ""
        messages().print(f"Foxglove may connect to {server.url}{note}", soft_wrap=True)
    return stream
