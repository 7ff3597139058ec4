"""Work beside the frames that must never hold them up: showing, recording."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Generic, TypeVar

from planegrasp.closing import ClosesAtEnd

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Beside"]

Item = TypeVar("Item")


class Beside(ClosesAtEnd, Generic[Item]):
    """Hands items to a function in a thread of its own; a context manager.

    Where the function is slower than the items come, the oldest that wait are left out. After an
    error of the function it is not called any more, and items are ignored.

    Attributes:
        waiting: so many items wait at most; whoever calls `put` may change it.
        left_out: how many items were left out.
        error: of the function, None where there was none.
    """

    def __init__(
        self,
        work: Callable[[Item], None],
        close: Callable[[], None],
        *,
        waiting: int = 1,
        wait: bool = False,
        close_timeout: float = 10.0,
        name: str = "planegrasp-beside",
    ) -> None:
        """Start the thread.

        Args:
            work: is called with one item after the other.
            close: is called at the end, also after an error; in the same thread.
            waiting: see the attribute.
            wait: whether `put` waits for room instead of leaving items out.
            close_timeout: how long `close` waits for the thread [s].
            name: of the thread.
        """
        self.left_out = 0
        self.error: Exception | None = None
        self._work, self._end = work, close
        self.waiting, self._wait, self._close_timeout = waiting, wait, close_timeout
        self._items: deque[Item] = deque()
        self._changed = threading.Condition()
        self._is_closed = False
        self._told = False
        # A daemon, so that what hangs cannot keep the program from ending.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def hangs(self) -> bool:
        """Whether the thread did not end although it should have; only after `close`."""
        return self._is_closed and self._thread.is_alive()

    def put(self, item: Item) -> None:
        """Hand over an item; it must not change afterwards."""
        with self._changed:
            if self.error is not None or self._is_closed:
                return
            while self._wait and len(self._items) >= self.waiting and self.error is None:
                self._changed.wait()
            self._items.append(item)
            while len(self._items) > self.waiting:
                self._items.popleft()
                self.left_out += 1
            self._changed.notify_all()

    def take_error(self) -> Exception | None:
        """The error, once."""
        with self._changed:
            if self._told or self.error is None:
                return None
            self._told = True
            return self.error

    def close(self) -> None:
        """Finish what waits, and end; waits for at most `close_timeout`, when first called."""
        with self._changed:
            if self._is_closed:
                return
            self._is_closed = True
            self._changed.notify_all()
        self._thread.join(self._close_timeout)

    def _run(self) -> None:
        try:
            while (item := self._next()) is not None:
                self._work(item[0])
        except Exception as error:
            self._fail(error)
        try:
            self._end()
        except Exception as error:
            self._fail(error)

    def _next(self) -> tuple[Item] | None:
        with self._changed:
            while not self._items and not self._is_closed:
                self._changed.wait()
            item = (self._items.popleft(),) if self._items else None
            self._changed.notify_all()
            return item

    def _fail(self, error: Exception) -> None:
        with self._changed:
            self.error = self.error or error
            self._items.clear()
            self._changed.notify_all()
