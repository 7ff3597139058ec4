"""One plan carried out by an ideal arm, with what is to be known of it afterwards."""

import numpy as np
from ideal_arm import IdealArm, ScriptedEyes, constant_velocity

from planegrasp.grasping.executor import ExecutorConfig, GraspExecutor

CONFIG = ExecutorConfig(lead=0.02, patience=4.0)  # an ideal arm is there after one period


class Run:
    """One execution, with what is to be known of it afterwards."""

    def __init__(self, robot, plan, motion=None, *, start=None, **changes):
        self.robot, self.plan = robot, plan
        still = constant_velocity(plan.T_base_object, (0.0, 0.0, 0.0))
        self.motion = motion or still
        self.arm = IdealArm(robot, start or robot.home, self.motion, plan.grasp)
        for name, value in changes.items():
            setattr(self.arm, name, value)
        self.stages, self.at = [], {}

    def __call__(self, body, *, blind_from=None, config=CONFIG, **arguments):
        if blind_from is not None:
            eyes = ScriptedEyes(self.arm, self.motion, blind_from)
            arguments = {"eyes": eyes, "sighting": eyes.sighting(0.0), **arguments}
        self.execution = GraspExecutor(self.robot, config).run(
            self.plan, self.arm, body, notify=self.note, **arguments
        )
        return self.execution

    def note(self, stage):
        self.stages.append(stage)
        self.at[stage] = (len(self.arm.commands), self.arm.time, self.arm.T_base_gripper)

    def points(self, first=0, last=None):
        """m×3 positions of the gripper."""
        states = (self.robot.with_arm(self.arm.state, q) for q in self.arm.commands[first:last])
        return np.array([self.robot.T_base_gripper(state).translation for state in states])

    def times(self):
        """When each command was given."""
        return np.array(self.arm.given)

    def check_speeds(self, config=CONFIG):
        steps = np.abs(np.diff(self.arm.commands, axis=0))
        limits = self.robot.velocity_limits * config.speed * config.period
        # The path's velocity is limited at its points, a cubic between them is that much faster.
        assert (steps / limits).max() < 1.001

    def check_retreat(self):
        """At home again, open, by the way that the arm came."""
        np.testing.assert_allclose(self.arm.commands[-1], self.arm.commands[0], atol=1e-9)
        assert self.arm.grips[-1] == (self.plan.opening, self.plan.force)
        # The last command that was new when it turned back.
        commands = np.array(self.arm.commands)
        turn = self.turning_point()
        coming, going = commands[: turn + 1], commands[turn + 1 :]
        for q in going:
            # Between two points 0.02 rad apart, or at a corner that a spline rounds.
            assert np.abs(coming - q).max(axis=1).min() < 0.03
        self.check_speeds()

    def turning_point(self):
        same = np.abs(np.diff(self.arm.commands, axis=0)).max(axis=1) == 0.0
        return int(np.flatnonzero(same)[-1]) if same.any() else len(self.arm.commands) - 1
