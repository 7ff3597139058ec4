"""Tasks that are set over a topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.messages.task import task_from_json

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.io.ros2.transport import Transport
    from planegrasp.live import Task

__all__ = ["TaskTopic"]


class TaskTopic:
    """Reads tasks (std_msgs/String with JSON, see `task_from_json`) from a topic.

    Args:
        node: to read with.
        topic: its name.
        known: names of the objects that may be wanted.
        default_budget: of a frame, where a task says nothing of it [s].
    """

    def __init__(
        self, node: Transport, topic: str, known: Iterable[str], default_budget: float
    ) -> None:
        self._reader = node.reader(topic, "std_msgs/msg/String")
        self._known = tuple(known)
        self._default_budget = default_budget

    def changed(self) -> Task | None:
        """The newest task since this was last called, None where there is none.

        Raises:
            InvalidInputError, UnknownObjectError: it is no task, or wants what was not taught;
                raised once.
        """
        messages = self._reader.take()
        if not messages:
            return None
        message, _ = messages[-1]
        return task_from_json(message.data, self._known, self._default_budget)
