"""The PR2's model against the robot's published figures, and against gravity."""

import mujoco
import numpy as np
import pytest
from scipy.linalg import expm

from planegrasp.errors import RobotError
from planegrasp.geometry import PinholeCamera

# Origin in the parent, axis, lower, upper, velocity, effort.
ARM = {
    "r_shoulder_pan": ((0, -0.188, 0), (0, 0, 1), -2.2854, 0.7146, 2.09, 30),
    "r_shoulder_lift": ((0.1, 0, 0), (0, 1, 0), -0.5236, 1.3963, 2.08, 30),
    "r_upper_arm_roll": ((0, 0, 0), (1, 0, 0), -3.90, 0.80, 3.27, 30),
    "r_elbow_flex": ((0.4, 0, 0), (0, 1, 0), -2.3213, 0.0, 3.30, 30),
    "r_forearm_roll": ((0, 0, 0), (1, 0, 0), -np.inf, np.inf, 3.6, 30),
    "r_wrist_flex": ((0.321, 0, 0), (0, 1, 0), -2.18, 0.0, 3.08, 10),
    "r_wrist_roll": ((0, 0, 0), (1, 0, 0), -np.inf, np.inf, 3.6, 10),
}
TORSO = np.array([-0.05, 0, 0.739675])
KINECT = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)


def product_of_exponentials(q, lift):
    """T_base_tool from the joints' screws at q = 0 (Brockett, 1984)."""
    T = np.eye(4)
    point = TORSO + np.array([0, 0, lift])
    for angle, (origin, axis, *_) in zip(q, ARM.values(), strict=True):
        point = point + origin
        w = np.array(axis, dtype=float)
        screw = np.zeros((4, 4))
        screw[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
        screw[:3, 3] = np.cross(point, w)
        T = T @ expm(screw * angle)
    at_zero = np.eye(4)
    at_zero[:3, 3] = point + np.array([0.18, 0, 0])
    return T @ at_zero


def test_forward_kinematics_is_the_product_of_exponentials(pr2):
    rng = np.random.default_rng(0)
    for _ in range(50):
        q, lift = rng.uniform(-2, 2, 7), rng.uniform(0, 0.33)
        state = pr2.with_joints(pr2.with_arm(pr2.home, q), {"torso_lift": lift})
        np.testing.assert_allclose(
            pr2.T_base_gripper(state).as_matrix(), product_of_exponentials(q, lift), atol=1e-9
        )


def test_limits_velocities_and_efforts(pr2):
    assert pr2.arm_joints == tuple(ARM)
    rows = np.array([row[2:] for row in ARM.values()])
    np.testing.assert_allclose(pr2.lower, rows[:, 0])
    np.testing.assert_allclose(pr2.upper, rows[:, 1])
    np.testing.assert_allclose(pr2.velocity_limits, rows[:, 2])
    efforts = [pr2.model.actuator(name).forcerange.tolist() for name in pr2.arm_joints]
    np.testing.assert_allclose(efforts, np.column_stack([-rows[:, 3], rows[:, 3]]))


def test_the_fingertips_are_as_far_apart_as_the_opening_says(pr2):
    for opening in (0.0, 0.03, 0.09):
        state = pr2.with_opening(pr2.home, opening)
        data = mujoco.MjData(pr2.model)
        data.qpos[:] = state.qpos
        mujoco.mj_kinematics(pr2.model, data)
        left, right = (data.geom(f"r_{side}_fingertip") for side in "lr")
        thickness = 2 * pr2.model.geom("r_l_fingertip").size[1]
        apart = np.linalg.norm(left.xpos - right.xpos) - thickness
        assert apart == pytest.approx(opening, abs=1e-9)
        middle = (left.xpos + right.xpos) / 2
        T = pr2.T_base_gripper(state)
        x, y, z = T.inv().apply(middle)
        assert abs(x) < 0.01
        assert abs(y) < 1e-9
        assert abs(z) < 1e-9
        # Fingers close along the gripper's y.
        assert abs(T.inv().apply(left.xpos)[1]) == pytest.approx((opening + thickness) / 2)


def test_the_camera_looks_forward_and_is_where_the_figures_put_it(pr2):
    ahead = pr2.with_joints(pr2.home, {"torso_lift": 0.0, "head_pan": 0.0, "head_tilt": 0.0})
    T = pr2.T_base_camera(ahead)
    origins = [(-0.01707, 0, 0.38145), (0.068, 0, 0), (0.0232, 0, 0.0645), (-0.137, 0, 0.092)]
    expected = TORSO + np.sum(origins, axis=0)
    np.testing.assert_allclose(T.translation, expected, atol=1e-9)
    right_down_forward = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    np.testing.assert_allclose(T.rotation.as_matrix(), right_down_forward, atol=1e-9)
    camera = pr2.T_base("kinect", ahead)
    np.testing.assert_allclose(camera.as_matrix(), T.as_matrix(), atol=1e-9)
    assert pr2.model.cam("kinect").fovy[0] == pytest.approx(
        np.degrees(2 * np.arctan(240 / 525)), abs=1e-3
    )


@pytest.mark.parametrize("point", [(0.7, -0.2, 0.75), (1.5, 1.0, 1.3), (0.4, -0.6, 0.5)])
def test_look_at_centres_a_point(pr2, point):
    state = pr2.look_at(point)
    pixel = KINECT.project(pr2.T_base_camera(state).inv().apply([point]))[0]
    np.testing.assert_allclose(pixel, (319.5, 239.5), atol=0.2)
    np.testing.assert_allclose(pr2.arm(state), pr2.arm(pr2.home))
    for name, low, high in (("head_pan", -3.007, 3.007), ("head_tilt", -0.471, 1.396)):
        assert low <= pr2.joint(state, name) <= high


def test_look_at_says_how_far_off_it_stays(pr2):
    with pytest.raises(RobotError, match=r"cannot look at \(0.30, .* m: it stays 5.° off"):
        pr2.look_at((0.3, 0, 5.0))


def test_nothing_of_the_robot_is_in_view_at_home(pr2):
    data = mujoco.MjData(pr2.model)
    data.qpos[:] = pr2.home.qpos
    mujoco.mj_forward(pr2.model, data)
    T = pr2.T_base_camera(pr2.home)
    columns, rows = np.meshgrid(np.linspace(0, 639, 40), np.linspace(0, 479, 30))
    rays = T.rotation.apply(KINECT.rays(np.column_stack([columns.ravel(), rows.ravel()])))
    geom = np.zeros(1, np.int32)
    hits = [mujoco.mj_ray(pr2.model, data, T.translation, ray, None, 1, -1, geom) for ray in rays]
    assert max(hits) == -1


def test_it_stands_still_under_gravity(pr2):
    data = mujoco.MjData(pr2.model)
    mujoco.mj_resetDataKeyframe(pr2.model, data, 0)
    for _ in range(500):
        mujoco.mj_step(pr2.model, data)
    np.testing.assert_allclose(data.qpos, pr2.home.qpos, atol=1e-4)


def test_the_gripper_holds_a_cracker_box(pr2):
    """0.4 kg between the pads at 40 N: friction carries it, and both fingers stay symmetric."""
    spec = pr2.spec()
    # The right hand before the robot, fingers closing along y, the box's thickness.
    q = np.array([0.0, 0.0, 0.0, -1.0, 0.0, -0.5, 0.0])
    state = pr2.with_opening(pr2.with_arm(pr2.home, q), 0.09)
    T = pr2.T_base_gripper(state)
    # Not in the middle: one finger touches first.
    position = T.apply([0.0, 0.008, 0.0])
    box = spec.worldbody.add_body(
        name="box", pos=position, quat=T.rotation.as_quat(scalar_first=True), gravcomp=1
    )
    box.add_freejoint()
    box.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.079, 0.030, 0.105], mass=0.4)
    for key in spec.keys:
        spec.delete(key)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[: pr2.model.nq] = state.qpos
    for joint in range(pr2.model.njnt):
        name = pr2.model.joint(joint).name
        if "finger" not in name:
            data.ctrl[model.actuator(name).id] = pr2.joint(state, name)
    gripper = model.actuator("r_gripper").id
    model.actuator_forcerange[gripper] = (-40, 40)
    data.ctrl[gripper] = 0.0
    for step in range(1500):
        if step == 500:
            model.body_gravcomp[model.body("box").id] = 0.0
            held = relative_box(model, data)
        mujoco.mj_step(model, data)
    left, right = (data.qpos[pr2.model.joint(f"r_gripper_{s}_finger").qposadr[0]] for s in "lr")
    assert left == pytest.approx(right, abs=1e-3)
    assert left + right == pytest.approx(0.06, abs=2e-3)
    assert np.linalg.norm(relative_box(model, data) - held) < 0.003


def relative_box(model, data):
    tool = data.site("r_gripper_tool_frame")
    return tool.xmat.reshape(3, 3).T @ (data.body("box").xpos - tool.xpos)
