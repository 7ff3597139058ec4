"""How near an arm is to an object that moves, and to what moves along with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.collision_model import body_names

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.robot.collision import Contact
    from planegrasp.robot.model import Robot
    from planegrasp.robot.path import Path
    from planegrasp.robot.scene import ObjectBody, Scene
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["Nearby"]


class Nearby:
    """What an arm must not touch on its way to an object, which is somewhere else in every period.

    Args:
        robot: whose arm it is.
        state: of its other joints.
        scene: obstacles, where they were when the object was at `body.T_base_object`.
        body: of the object.
        carried: names of obstacles that move along with it.
        opening: of the gripper on the way [m].
        margin: nothing may be nearer than this [m].
        room: distances from what moves are measured up to this [m].

    Attributes:
        near: checks with the margin.
        roomy: checks with the room for a margin.
    """

    def __init__(
        self,
        robot: Robot,
        state: RobotState,
        scene: Scene,
        body: ObjectBody,
        *,
        carried: Iterable[str],
        opening: float,
        margin: float,
        room: float,
    ) -> None:
        self._body, self._carried, self._opening = body, frozenset(carried), opening
        scene = scene.with_object(body)
        self.near, self.roomy = (
            CollisionChecker(robot, scene, state=state, config=CollisionConfig(margin=kept))
            for kept in (margin, max(margin, room))
        )
        still = [box.name for box in scene.obstacles if box.name not in self._carried]
        links = body_names(robot.model)
        self._still = frozenset(frozenset((link, name)) for link in links for name in still)
        self._gripping = self.near.fingers_on_object

    def place(self, T_base_object: RigidTransform) -> None:
        """Put the object there, and what moves along with it."""
        assert self._body.T_base_object is not None
        moved = T_base_object * self._body.T_base_object.inv()
        for checker in (self.near, self.roomy):
            checker.set_object(self._body.lying(T_base_object))
            checker.move_obstacles(self._carried, moved)

    def contact(self, q: Float64Array, *, reaching: bool = False) -> Contact | None:
        """What is nearer than the margin, or None.

        Args:
            q: the arm's joints, n.
            reaching: whether the fingers may be at the object.
        """
        return self.near.check(q, self._opening, allowed=self._gripping if reaching else ())

    def closest(self, q: Float64Array, *, reaching: bool = False) -> Contact | None:
        """What of the things that move is nearest, where it is nearer than the room; see `contact`.

        Its depth is minus the distance, which is a little too small off a box's corners.
        """
        allowed = self._still | self._gripping if reaching else self._still
        return self.roomy.check(q, self._opening, allowed=allowed)

    def distance(self, q: Float64Array, *, reaching: bool = False) -> float:
        """From what moves to the robot, at most the room [m]; see `contact`."""
        contact = self.closest(q, reaching=reaching)
        return self.roomy.config.margin if contact is None else -contact.depth

    def kept(self, path: Path, *, reaching: bool = False) -> float:
        """What to keep from things that move along a path that was free when it was planned [m].

        Half of what the path keeps from them as they are placed, which is more than the margin
        where there is room; the other half is theirs to move in.
        """
        room = min(self.distance(q, reaching=reaching) for q in path.q)
        return max(self.near.config.margin, room / 2)
