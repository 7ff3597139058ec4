"""A robot's recording can be read back, and says where everything was."""

import numpy as np
import pytest
from rrd import rows

from planegrasp.detector import Detector
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.objects import ObjectModel
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import KINECT
from planegrasp.simulation.objects import cracker_box
from planegrasp.simulation.world import Hand, World

pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")

PLACE = RigidTransform.from_components(
    [0.65, -0.2, 0.9], Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A world after 0, 0.1 and 0.2 s, while its hand and its torso move."""
    from planegrasp.viz.rerun_robot import RobotRecording

    path = tmp_path_factory.mktemp("robot") / "robot.rrd"
    box = cracker_box().model
    model = ObjectModel(box.name, (box.face("front"),), body=box.body)
    robot = Robot.pr2()
    world = World(robot, model, PLACE, Hand("left"))
    truth = []
    with RobotRecording(path, world) as recording:
        for i in range(3):
            truth.append((world.time, world.T_base_object, world.data.xpos.copy()))
            recording.state()
            world.move_support(RigidTransform.from_translation([0.0, 0.0, 0.01 * i]) * PLACE)
            world.control({"torso_lift": 0.25})
            world.step(0.1)
        world.reset(robot.look_at(PLACE.translation))
        camera = world.camera(KINECT)
        rendering = camera.render(world.data, np.random.default_rng(0), timestamp=0.5)
        (found,) = Detector([model]).detect(rendering.frame)
        recording.frame(rendering.frame, rendering.T_world_camera, found)
        path_points = np.array([[0.0, 0, 0], [0.1, 0, 0]])
        recording.plan(0.6, PLACE, PLACE, 0.08, path_points)
        recording.note("planned")
        empty = camera.render(world.data, np.random.default_rng(0), timestamp=0.7)
        recording.frame(empty.frame, empty.T_world_camera, None)
    return path, world, truth, found, rendering


def test_bodies_move_as_in_the_simulation(recorded):
    path, world, truth, *_ = recorded
    for name in ("torso_lift_link", "object", "r_gripper_l_finger_link"):
        poses = rows(path, f"/world/bodies/{name}", "Transform3D:translation")
        assert [t for t, _ in poses] == pytest.approx([t for t, *_ in truth])
        for (_, position), (_, _, xpos) in zip(poses, truth, strict=True):
            expected = xpos[world.model.body(name).id]
            np.testing.assert_allclose(position[0], expected, atol=1e-6)


def test_a_capsule_lies_where_it_is_in_the_model(recorded):
    """Rerun's begins at one end, MuJoCo's is given by its middle."""
    path, world, *_ = recorded
    geom = world.model.geom("r_forearm")
    entity = "/world/bodies/r_forearm_roll_link/r_forearm"
    ((_, start),) = rows(path, entity, "Capsules3D:translations")
    ((_, length),) = rows(path, entity, "Capsules3D:lengths")
    ((_, quaternion),) = rows(path, entity, "Capsules3D:quaternions")
    axis = Rotation.from_quat(quaternion[0]).apply([0, 0, 1])
    np.testing.assert_allclose(start[0] + axis * length[0] / 2, geom.pos, atol=1e-6)
    # From 0.06 to 0.26 m along the forearm, as the model says.
    ends = sorted([start[0][0], (start[0] + axis * length[0])[0]])
    np.testing.assert_allclose(ends, [0.06, 0.26], atol=1e-6)


def test_every_shape_is_there(recorded):
    path, world, *_ = recorded
    from rerun.chunk import RrdReader

    entities = {chunk.entity_path for chunk in RrdReader(path).stream()}
    for geom in range(world.model.ngeom):
        body = world.model.body(world.model.geom_bodyid[geom]).name
        name = world.model.geom(geom).name.replace(":", "-") or str(geom)
        assert f"/world/bodies/{body}/{name}" in entities
    assert {"/world/plan/path", "/log", "/gripper/force", "/world/camera/color"} <= entities


def test_what_was_seen_and_planned(recorded):
    path, _, _, found, rendering = recorded
    ((time, position),) = rows(path, "/world/seen/object", "Transform3D:translation")
    assert time == pytest.approx(0.5)
    T = rendering.T_world_camera * found.T_camera_object
    np.testing.assert_allclose(position[0], T.translation, atol=1e-6)
    ((time, cleared),) = rows(path, "/world/seen/object", "Clear:is_recursive")
    assert (time, cleared) == (pytest.approx(0.7), [True])
    ((time, place),) = rows(path, "/world/plan/grasp", "Transform3D:translation")
    assert time == pytest.approx(0.6)
    np.testing.assert_allclose(place[0], PLACE.translation, atol=1e-6)


def test_the_gripper_and_the_height_are_numbers_over_time(recorded):
    path, _, truth, *_ = recorded
    openings = rows(path, "/gripper/opening", "Scalars:scalars")
    assert openings[0][1][0] == pytest.approx(0.09, abs=1e-3)
    heights = [value[0] for _, value in rows(path, "/object/height", "Scalars:scalars")]
    np.testing.assert_allclose(heights, [T.translation[2] for _, T, _ in truth], atol=1e-9)
