"""The camera against the renderer of rectangles, and against MuJoCo's single rays."""

import mujoco
import numpy as np
import pytest

from planegrasp import Detector, DetectorConfig
from planegrasp.boxes import SIDES
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation, rotation_angle
from planegrasp.objects import ObjectModel, PlanarFace
from planegrasp.simulation import KinectV1, Rectangle, render
from planegrasp.simulation.raycast_camera import Printed, RaycastCamera, RaycastConfig

PLAIN = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
LENS = PinholeCamera(320, 240, 262.0, 262.0, 159.5, 119.5, (0.12, -0.25, 0.001, -0.002, 0.08))
SIZE = (0.24, 0.16, 0.05)
EYE = (0.3, -0.2, 0.9)
UNLIT = RaycastConfig(color_noise=0.0, ambient=1.0, background_depth=1.5)
EXACT = RaycastConfig(color_noise=0.0, ambient=1.0, background_depth=1.5, edge_samples=64)


def pose(position=(0.02, -0.01, 0.7), tilt=0.0, axis=0.0, roll=0.0):
    out_of_plane = Rotation.from_rotvec(
        np.radians(tilt) * np.array([np.cos(axis), np.sin(axis), 0])
    )
    rotation = out_of_plane * Rotation.from_euler("z", roll, degrees=True)
    frontal = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    return RigidTransform.from_components(position, rotation * frontal)


def scene(T_camera_object, more="", size=SIZE):
    """A box before a camera that is turned and moved in the world."""
    T_world_camera = RigidTransform.from_components(
        EYE, Rotation.from_euler("xyz", [1.9, -0.2, 0.5])
    )
    T = T_world_camera * T_camera_object
    half = " ".join(str(s / 2) for s in size)

    def at(T):
        x, y, z, w = T.rotation.as_quat()
        return f'pos="{" ".join(map(repr, map(float, T.translation)))}" quat="{w} {x} {y} {z}"'

    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody>
        <body name="mount" {at(T_world_camera)}><site name="eye"/></body>
        <body name="box" {at(T)}><geom name="box" type="box" size="{half}" rgba=".3 .5 .7 1"/>
        </body>{more}</worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def front(image, size=SIZE):
    T_object_face = RigidTransform.from_translation([0, 0, size[2] / 2])
    return PlanarFace("front", image, size[0], size[1], T_object_face)


def shoot(T, face, camera=PLAIN, config=UNLIT, *, more="", background=None):
    model, data = scene(T, more)
    eye = RaycastCamera(model, camera, "eye", [Printed("box", face)], config)
    return eye.render(data, np.random.default_rng(0), background=background)


def rendered(T, face, camera=PLAIN, background=None):
    rectangle = Rectangle(face.image, face.width, face.height, T * face.T_object_face)
    return render(
        [rectangle], camera, np.random.default_rng(0), color_noise=0.0, background=background
    )


POSES = {
    "frontal": pose(),
    "rolled": pose(roll=33),
    "tilted": pose(tilt=40, axis=0.4, roll=10),
    "oblique": pose((-0.1, 0.05, 0.6), tilt=60, axis=1.5),
}


@pytest.fixture(scope="module")
def face(photo):
    return front(photo("coffee"))


@pytest.mark.parametrize("camera", [PLAIN, LENS], ids=["plain", "lens"])
@pytest.mark.parametrize("T", POSES.values(), ids=POSES)
def test_a_printed_side_looks_as_the_renderer_shows_it(T, face, photo, camera):
    background = photo("chelsea")
    ours = shoot(T, face, camera, EXACT, background=background)
    theirs = rendered(T, face, camera, background)
    face_only = (ours.owners == 0) | (ours.geoms < 0)
    difference = np.abs(ours.frame.color.astype(int) - theirs.frame.color)[face_only]
    # Rounding, and at the edges the coverage of 64 rays against that of the renderer's own
    # samples (16 at least).
    assert np.mean(difference) < 0.1
    inside = ours.owners == 0
    inside[1:-1, 1:-1] &= (
        inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    )
    exact = np.abs(ours.frame.color.astype(int) - theirs.frame.color)[inside]
    assert np.percentile(exact, 99) <= 1
    assert np.percentile(difference, 99.9) < 16
    assert np.count_nonzero(inside) > 1000


@pytest.mark.parametrize("camera", [PLAIN, LENS], ids=["plain", "lens"])
@pytest.mark.parametrize("T", POSES.values(), ids=POSES)
def test_depth_corners_and_pose_are_exact(T, face, camera):
    ours, theirs = shoot(T, face, camera), rendered(T, face, camera)
    on_face = ours.owners == 0
    np.testing.assert_allclose(
        ours.true_depth[on_face], theirs.true_depth[on_face], rtol=0, atol=1e-6
    )
    np.testing.assert_array_equal(on_face, theirs.true_depth < 1.5)
    np.testing.assert_allclose(ours.corners[0], theirs.corners[0], atol=1e-6)
    (T_camera_box,) = ours.T_camera_body
    np.testing.assert_allclose(T_camera_box.as_matrix(), T.as_matrix(), atol=1e-9)
    assert ours.visible[0] == pytest.approx(1.0, abs=0.01)


def test_edges_are_shared_out_so_that_areas_are_exact():
    # A thin box, so that hardly anything but the face is seen.
    thin = (0.24, 0.16, 1e-4)
    white = front(np.full((160, 240, 3), 200, np.uint8), thin)
    model, data = scene(pose(tilt=20, axis=0.7, roll=17), size=thin)
    eye = RaycastCamera(model, PLAIN, "eye", [Printed("box", white)], UNLIT)
    seen = eye.render(data, np.random.default_rng(0), background=np.zeros((480, 640, 3), np.uint8))
    (corners,) = seen.corners
    x, y = corners.T
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    share = seen.frame.color[..., 1] / 200.0
    assert share.sum() == pytest.approx(area, rel=1e-3)
    assert np.count_nonzero((share > 0.1) & (share < 0.9)) > 200  # not a hard edge


def obstacles(rng, count=150):
    kinds = ("box", "capsule", "sphere", "cylinder", "ellipsoid")
    bodies = ""
    for i in range(count):
        position = rng.uniform([-1.0, -1.0, 0.0], [1.5, 1.5, 1.8])
        if np.linalg.norm(position - EYE) < 0.6:
            continue
        quat = rng.normal(size=4)
        size = rng.uniform(0.02, 0.15, 3)
        bodies += (
            f'<body pos="{position[0]} {position[1]} {position[2]}" '
            f'quat="{quat[0]} {quat[1]} {quat[2]} {quat[3]}">'
            f'<geom type="{kinds[i % 5]}" size="{size[0]} {size[1]} {size[2]}" pos=".1 0 .05"/>'
            f"</body>"
        )
    planes = '<geom type="plane" size="0 0 1"/><geom type="plane" size="1 .5 1" pos="0 0 .6"/>'
    return planes + bodies


@pytest.mark.parametrize("seed", range(4))
def test_every_pixel_sees_what_a_single_ray_of_mujoco_meets(seed):
    rng = np.random.default_rng(seed)
    camera = PinholeCamera(80, 60, 50.0, 50.0, 39.5, 29.5)
    model, data = scene(pose(), obstacles(rng))
    far = RaycastConfig(background_depth=1e6)
    eye = RaycastCamera(model, camera, "eye", config=far)
    seen = eye.render(data, rng)
    T = seen.T_world_camera
    v, u = np.mgrid[:60, :80]
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
    geom = np.zeros(1, np.int32)
    for pixel, ray in enumerate(T.rotation.apply(rays)):
        depth = mujoco.mj_ray(model, data, T.translation, ray, None, 1, -1, geom)
        assert seen.geoms.ravel()[pixel] == geom[0]
        if depth >= 0:
            assert seen.true_depth.ravel()[pixel] == pytest.approx(depth, abs=1e-9)
    assert len(np.unique(seen.geoms)) > 8
    assert np.any(seen.geoms == -1) or np.any(seen.geoms == 0)


def test_something_in_front_hides_its_share(face):
    T = pose()
    model, data = scene(T)
    T_world_bar = RaycastCamera(model, PLAIN, "eye").T_world_camera(data) * T
    x, y, z = (T_world_bar * RigidTransform.from_translation([0.06, 0.0, 0.0251])).translation
    qx, qy, qz, qw = T_world_bar.rotation.as_quat()
    bar = (
        f'<geom name="bar" type="box" size="0.012 0.3 0.00005" pos="{x} {y} {z}" '
        f'quat="{qw} {qx} {qy} {qz}" rgba="1 1 1 1"/>'
    )
    hidden = shoot(T, face, more=bar)
    assert hidden.visible[0] == pytest.approx(0.9, abs=0.01)  # a tenth of the width is covered
    assert hidden.frame.color[240, int(319.5 + 525 * 0.08 / 0.675)].tolist() == [255, 255, 255]


def test_a_side_that_faces_away_is_not_seen(face):
    away = pose() * RigidTransform.from_rotation(Rotation.from_euler("y", 180, degrees=True))
    seen = shoot(away, face)
    assert seen.visible == (0.0,)
    assert seen.corners == (None,)
    assert not np.any(seen.owners == 0)
    assert np.any(seen.geoms >= 0)


def test_a_box_shows_three_of_its_sides(photo):
    box = ObjectModel.box("cube", (0.2, 0.2, 0.2), {s: photo("astronaut") for s in SIDES})
    turn = RigidTransform.from_rotation(Rotation.from_euler("xy", [35, 45], degrees=True))
    T = pose((0, 0, 0.9)) * turn
    model, data = scene(T, size=(0.2, 0.2, 0.2))
    eye = RaycastCamera(model, PLAIN, "eye", [Printed("box", f) for f in box.faces], UNLIT)
    seen = eye.render(data, np.random.default_rng(0))
    shown = {f.name for f, v in zip(box.faces, seen.visible, strict=True) if v > 0}
    assert len(shown) == 3
    for share in seen.visible:
        assert share == 0.0 or share == pytest.approx(1.0, abs=0.01)
    assert np.all((seen.owners >= 0) == (seen.geoms == 0))


def test_light_falls_by_lamberts_law():
    lamp = RaycastConfig(color_noise=0.0, ambient=0.25, light=(0.0, 0.0, 5.0))
    floor = '<geom type="plane" size="0 0 1" rgba="0.8 0.4 0.2 1"/>'
    model, data = scene(pose(), floor)
    seen = RaycastCamera(model, PLAIN, "eye", config=lamp).render(data, np.random.default_rng(0))
    colors = np.unique(seen.frame.color[seen.geoms == 0], axis=0)
    assert [204, 102, 51] in colors.tolist()  # lit straight from above: the full colour
    side = data.geom_xmat[1].reshape(3, 3)[:, 2]
    expected = np.rint(255 * np.array([0.3, 0.5, 0.7]) * (0.25 + 0.75 * max(side[2], 0.0)))
    middle = seen.frame.color[245, 334]
    np.testing.assert_allclose(middle, expected, atol=1)


def test_geoms_of_hidden_groups_and_transparent_ones_are_not_seen():
    more = '<geom type="sphere" size="2" group="3"/><geom type="sphere" size="2" rgba="1 1 1 0"/>'
    model, data = scene(pose(), more)
    seen = RaycastCamera(model, PLAIN, "eye").render(data, np.random.default_rng(0))
    assert set(np.unique(seen.geoms)) == {-1, 2}
    everything = RaycastConfig(groups=(0, 1, 2, 3))
    eye = RaycastCamera(model, PLAIN, "eye", config=everything)
    assert set(np.unique(eye.render(data, np.random.default_rng(0)).geoms)) == {0, 2}


def test_the_wall_hides_what_lies_behind_it(face):
    near_wall = RaycastConfig(color_noise=0.0, background_depth=0.5)
    seen = shoot(pose(), face, config=near_wall)
    assert np.all(seen.true_depth == 0.5)
    assert np.all(seen.geoms == -1)
    assert seen.visible == (0.0,)
    assert np.all(seen.frame.color == 128)


def test_noise_is_that_of_the_sensors_and_comes_from_the_generator(face):
    noisy = RaycastConfig(ambient=1.0, background_depth=1.5)
    model, data = scene(pose())
    eye = RaycastCamera(model, PLAIN, "eye", [Printed("box", face)], noisy)
    a, b, c = (eye.render(data, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.frame.color, b.frame.color)
    np.testing.assert_array_equal(a.frame.depth, b.frame.depth)
    assert np.any(a.frame.color != c.frame.color)
    wall = a.frame.color[:100].astype(float)
    assert wall.std() == pytest.approx(np.hypot(3.0, np.sqrt(1 / 12)), rel=0.02)
    flat = a.frame.depth[:100, :100].astype(float)
    steps = KinectV1().focal_length * KinectV1().baseline / flat * 8
    np.testing.assert_allclose(steps, np.rint(steps), atol=2e-3)


def test_the_detector_finds_the_pose(photo):
    model = ObjectModel("coffee", (front(photo("coffee")),))
    detector = Detector([model], DetectorConfig())
    for seed, T in enumerate([pose(tilt=8, axis=1.0, roll=5), pose(tilt=15, axis=4.0, roll=-20)]):
        frame = shoot(T, model.faces[0], config=RaycastConfig(), background=photo("chelsea")).frame
        (found,) = detector.detect(frame)
        assert np.degrees(rotation_angle(found.T_camera_object.rotation, T.rotation)) < 0.1, seed
        assert np.linalg.norm(found.T_camera_object.translation - T.translation) < 0.5e-3


def test_the_optical_frame_may_be_a_body(face):
    model, data = scene(pose())
    T_world_site = RaycastCamera(model, PLAIN, "eye").T_world_camera(data)
    T_world_body = RaycastCamera(model, PLAIN, "mount").T_world_camera(data)
    np.testing.assert_allclose(T_world_site.as_matrix(), T_world_body.as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    ("frame", "geom", "message"),
    [("nose", "box", "has no body 'nose'"), ("eye", "carton", "has no geom 'carton'")],
)
def test_unknown_names_are_refused(face, frame, geom, message):
    model, _ = scene(pose())
    with pytest.raises(InvalidInputError, match=message):
        RaycastCamera(model, PLAIN, frame, [Printed(geom, face)])


@pytest.mark.parametrize("height", [0.02, 0.03])
def test_a_photograph_off_the_surface_is_refused(photo, height):
    image = photo("coffee")
    T_object_face = RigidTransform.from_translation([0, 0, height])
    floating = PlanarFace("front", image, SIZE[0], SIZE[1], T_object_face)
    model, _ = scene(pose())
    with pytest.raises(InvalidInputError, match=r"face 'front' lies 0\.005 m off the surface"):
        RaycastCamera(model, PLAIN, "eye", [Printed("box", floating)])
