"""An arm that is where it is told to be, an object that moves as written, eyes that see it late."""

from collections import deque

import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.interfaces import Sighting

NOISE = np.diag([0.001**2] * 3 + [0.003**2] * 3)


class IdealArm:
    """Fingers press on the object where they have closed around it; `grasp` says where that is.

    Attributes:
        commands: what the arm was told in each period, n each.
        given: when.
        grips: what the gripper was told, (opening, force) each.
        stuck_from: time from which the arm does not move any more.
        slippery_from: time from which the fingers press on nothing.
        flicker: the fingers press on nothing for a period out of every so long [s]; never where 0.
        leap: the clock goes on by so much more in each period [s].
        lag: the arm is where it was told to be so long before [s].
    """

    def __init__(self, robot, state, pose_of_object, grasp):
        self.robot, self.state, self.time = robot, state, 0.0
        self.commands, self.given, self.grips = [robot.arm(state)], [0.0], []
        self.stuck_from = self.slippery_from = np.inf
        self.leap = self.flicker = self.lag = 0.0
        self._pose_of_object, self._grasp = pose_of_object, grasp
        self._holding = False

    @property
    def T_base_gripper(self):
        return self.robot.T_base_gripper(self.state)

    @property
    def is_gripping(self):
        if self.grips[-1][0] > 0 or self.time >= self.slippery_from:
            return False
        if self.flicker and self.time % self.flicker < 0.019:
            return False
        # From when it has closed around the object on, the object goes with the gripper.
        wanted = self._grasp.adapt(self._pose_of_object(self.time))
        off = self.T_base_gripper.translation - wanted.translation
        self._holding = self._holding or np.linalg.norm(off) < 0.015
        return self._holding

    def move(self, q):
        self.commands.append(np.array(q))
        self.given.append(self.time)
        self._follow()

    def grip(self, opening, force):
        self.grips.append((opening, force))

    def advance(self, seconds):
        self.time += seconds + self.leap
        self._follow()

    def _follow(self):
        if self.time < self.stuck_from:
            told = np.searchsorted(self.given, self.time - self.lag, side="right")
            self.state = self.robot.with_arm(self.state, self.commands[max(told, 1) - 1])


class ScriptedEyes:
    """Sees the object at 10 Hz until it goes blind, and says so 0.1 s later."""

    def __init__(self, arm, pose_of_object, blind_from=np.inf):
        self._arm, self._pose_of_object, self._blind_from = arm, pose_of_object, blind_from
        self._coming = deque()
        self._frame = 1

    def sighting(self, time):
        return Sighting(time, self._pose_of_object(time), NOISE)

    def look(self):
        while self._frame * 0.1 <= self._arm.time:
            time = self._frame * 0.1
            if time < self._blind_from:
                self._coming.append(self.sighting(time))
            self._frame += 1
        newest = None
        while self._coming and self._coming[0].time + 0.1 <= self._arm.time:
            newest = self._coming.popleft()
        return newest


def constant_velocity(start, velocity, since=0.0):
    def pose(time):
        return RigidTransform.from_translation(np.array(velocity) * max(time - since, 0.0)) * start

    return pose
