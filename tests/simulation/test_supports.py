"""What a tripod and a hand hold, hide and touch."""

import mujoco
import numpy as np
import pytest
from worlds import BEFORE_PR2, CAMERA, IN_GRIPPER, moved

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.simulation.hand_motion import HandMotion
from planegrasp.simulation.objects import cracker_box, picture_book
from planegrasp.simulation.supports import Hand, Tripod
from planegrasp.simulation.world import World


@pytest.mark.parametrize("support", [Tripod(), Hand(), Hand("left", front="fingers")])
def test_what_is_held_stays_in_place(gripper, box, support):
    T = IN_GRIPPER * RigidTransform.from_components(
        [-0.3, 0.1, 0.4], Rotation.from_euler("xyz", [0.3, -0.5, 0.2])
    )
    world = World(gripper, box, T, support)
    world.step(2.0)
    assert world.time == pytest.approx(2.0)
    distance, angle = moved(world, T)
    assert distance < 1e-5
    assert angle < 1e-4


def test_the_object_follows_the_hand(gripper, box):
    start = RigidTransform.from_translation([-0.3, 0.0, 0.2]) * IN_GRIPPER
    world = World(gripper, box, start, Hand("bottom"))
    motion = HandMotion(start, np.random.default_rng(5))
    lags = []
    while world.time < 2.0:
        world.move_support(motion.pose(world.time))
        world.step()
        lags.append(moved(world, motion.pose(world.time)))
    distance, angle = np.max(lags, axis=0)
    # A time step at the bound of the drift's and the tremor's speed is 0.3 mm.
    assert distance < 1e-3
    assert angle < np.radians(0.2)
    assert moved(world, start)[0] > 0.01


def test_after_the_release_it_stays_with_the_gripper_when_the_hand_goes(gripper, box):
    world = World(gripper, box, IN_GRIPPER, Hand("top"))
    world.control({"left": -40.0, "right": -40.0})
    world.step(0.5)
    world.release()
    for share in np.linspace(0, 1, 100):
        world.move_support(RigidTransform.from_translation([0.0, 0.0, 0.3 * share]) * IN_GRIPPER)
        world.step(0.01)
    assert moved(world, IN_GRIPPER)[0] < 1e-3


HANDS = [
    (hold, front)
    for hold in ("left", "right", "top", "bottom", "top-left", "bottom-right")
    for front in ("thumb", "fingers")
]


@pytest.mark.parametrize(("hold", "front"), HANDS)
@pytest.mark.parametrize("thing", [cracker_box, picture_book])
def test_a_hand_hides_a_part_of_the_face_and_is_not_inside_of_the_object(pr2, thing, hold, front):
    world = World(pr2, thing().model, BEFORE_PR2, Hand(hold, front))
    world.reset(pr2.look_at(BEFORE_PR2.translation))
    seen = world.camera(CAMERA).render(world.data, np.random.default_rng(0))
    assert 0.01 < 1.0 - seen.visible[0] < 0.25
    object_geom = world.model.geom("object").id
    for geom in range(world.model.ngeom):
        if world.model.geom(geom).name.startswith("support:"):
            apart = mujoco.mj_geomDistance(
                world.model, world.data, geom, object_geom, 0.1, np.zeros(6)
            )
            assert apart > 0, world.model.geom(geom).name
    skin = [g for g in range(world.model.ngeom) if world.model.geom(g).name.startswith("support:")]
    assert np.count_nonzero(np.isin(seen.geoms, skin)) > 500


def test_front_fingers_hide_more_than_a_thumb(pr2, box):
    hidden = {}
    for front in ("thumb", "fingers"):
        world = World(pr2, box, BEFORE_PR2, Hand("right", front))
        world.reset(pr2.look_at(BEFORE_PR2.translation))
        seen = world.camera(CAMERA).render(world.data, np.random.default_rng(0))
        hidden[front] = 1.0 - seen.visible[0]
    assert 0.04 < hidden["thumb"] < 0.10 < hidden["fingers"] < 0.20


def test_a_tripod_does_not_move(gripper, box):
    with pytest.raises(InvalidInputError, match="only a hand moves"):
        World(gripper, box, IN_GRIPPER).move_support(IN_GRIPPER)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"hold": "middle"}, "cannot hold 'middle'; it can hold: left"),
        ({"front": "palm"}, "'thumb' or 'fingers', got 'palm'"),
        ({"reach": 0.2}, "reaches over 0 … 0.10 m, got 0.2"),
        ({"along": 1.5}, "along an edge is -1 … 1, got 1.5"),
    ],
)
def test_impossible_hands_are_refused(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        Hand(**settings)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (-1.2, 0.4, 0.7), (-0.4, -0.3, 2.0)])
def test_a_tripod_lies_within_its_boxes_and_they_are_tight(gripper, box, angles):
    T = RigidTransform.from_components(
        [0.3, -0.4, 0.9],
        BEFORE_PR2.rotation * Rotation.from_euler("xyz", angles),
    )
    tripod = Tripod()
    world = World(gripper, box, T, tripod)
    model, data = world.model, world.data
    boxes = tripod.obstacles(T, box.outer_body, world.config.floor_height)
    names = [name for i in range(model.ngeom) if "support" in (name := model.geom(i).name)]
    assert {b.name for b in boxes} == {name.replace("support:", "tripod-") for name in names}
    for obstacle in boxes:
        geom = model.geom(obstacle.name.replace("tripod-", "support:")).id
        # MuJoCo's own box around the geom: 8 corners, in the world, which is this robot's base.
        centre, half = np.split(model.geom_aabb[geom], 2)
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (centre + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T
        local = obstacle.T_base_box.inv().apply(corners + data.geom_xpos[geom])
        # Rods are round: their boxes may be turned about them.
        along = np.abs(local[:, 2]) - obstacle.size[2] / 2
        across = np.linalg.norm(local[:, :2], axis=1) - np.linalg.norm(obstacle.size[:2]) / 2
        assert along == pytest.approx(0.0, abs=1e-6)
        assert across == pytest.approx(0.0, abs=1e-6)
