"""Where objects and cameras are in the tests of the simulated world."""

import numpy as np

from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation

CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
# The box upright, its front to the left: its depth between the fingers, the middle near their tips.
IN_GRIPPER = RigidTransform.from_components(
    [0.625, 0.0, 0.6], Rotation.from_matrix([[-1, 0, 0], [0, 0, 1], [0, 1, 0]])
)
# Front to the robot, turned a little.
BEFORE_PR2 = RigidTransform.from_components(
    [0.75, -0.1, 0.95],
    Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
    * Rotation.from_euler("yx", [0.3, -0.2]),
)


def moved(world, T_before):
    T = T_before.inv() * world.T_base_object
    return np.linalg.norm(T.translation), T.rotation.magnitude()
