"""The rendered truth that the other tests and the benchmarks rest on."""

import numpy as np
import pytest

from planegrasp.boxes import SIDES, box_face_pose, box_face_size
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.simulation import Rectangle, render

PLAIN = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
LENS = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (0.12, -0.25, 0.001, -0.002, 0.08))
WIDTH, HEIGHT = 0.24, 0.18
BLACK = np.zeros((480, 640, 3), np.uint8)
FRONTAL = np.diag([1.0, -1.0, -1.0])
# Dots of the texture of `dots`: columns and rows of their centres in edge coordinates.
DOT_X, DOT_Y = np.meshgrid(np.linspace(60, 420, 4), np.linspace(60, 300, 3))
DOTS = np.column_stack([DOT_X.ravel(), DOT_Y.ravel()])


def pose(position=(0.02, -0.01, 0.7), tilt=0.0, axis=0.0, roll=0.0):
    out_of_plane = Rotation.from_rotvec(
        np.radians(tilt) * np.array([np.cos(axis), np.sin(axis), 0])
    )
    rotation = out_of_plane * Rotation.from_euler("z", roll, degrees=True)
    return RigidTransform.from_components(position, rotation * Rotation.from_matrix(FRONTAL))


def quiet(rectangles, camera=PLAIN, **settings):
    return render(rectangles, camera, np.random.default_rng(0), color_noise=0.0, **settings)


def plain(value, T, width=WIDTH, height=HEIGHT):
    return Rectangle(np.full((60, 80, 3), value, np.uint8), width, height, T)


def dots(T, radius=9.0):
    """480×360 px, smooth white dots on black at `DOTS`."""
    y, x = np.mgrid[:360, :480] + 0.5
    distance = np.hypot(x[..., None] - DOTS[:, 0], y[..., None] - DOTS[:, 1]).min(axis=2)
    gray = 250 * np.clip(radius + 0.5 - distance, 0, 1)
    return Rectangle(np.repeat(gray[..., None], 3, axis=2).astype(np.uint8), WIDTH, HEIGHT, T)


def on_rectangle(edge, T):
    """Points of the 480×360 texture (edge coordinates) in the camera frame."""
    x = edge[:, 0] * WIDTH / 480 - WIDTH / 2
    y = HEIGHT / 2 - edge[:, 1] * HEIGHT / 360
    return T.apply(np.column_stack([x, y, np.zeros(len(x))]))


def projected_disc(centre, camera, T, radius=9.0):
    """Centroid of the image of a disc: perspective moves it off the image of its centre."""
    r, a = np.meshgrid((np.arange(40) + 0.5) / 40 * radius, np.arange(72) * np.pi / 36)
    edge = centre + np.column_stack([(r * np.cos(a)).ravel(), (r * np.sin(a)).ravel()])
    step = 0.01
    p = camera.project(on_rectangle(edge, T))
    px = (camera.project(on_rectangle(edge + np.array([step, 0]), T)) - p) / step
    py = (camera.project(on_rectangle(edge + np.array([0, step]), T)) - p) / step
    weight = r.ravel() * np.abs(px[:, 0] * py[:, 1] - px[:, 1] * py[:, 0])
    return weight @ p / weight.sum()


def area_of(outline):
    x, y = outline.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def centroid(image, near, reach=12):
    """Centroid of the brightness around a point."""
    x0, y0 = np.rint(near).astype(int)
    y, x = np.mgrid[y0 - reach : y0 + reach + 1, x0 - reach : x0 + reach + 1]
    w = image[y, x].astype(float)
    return np.array([(w * x).sum(), (w * y).sum()]) / w.sum()


@pytest.mark.parametrize("camera", [PLAIN, LENS], ids=["plain", "lens"])
@pytest.mark.parametrize(
    "T",
    [
        pose(),
        pose(roll=33),
        pose(tilt=40, axis=0.4, roll=10),
        pose((-0.1, 0.05, 0.6), tilt=60, axis=1.5),
        pose((0.16, 0.12, 0.75), tilt=25, axis=3.0),
    ],
    ids=["frontal", "rolled", "tilted", "oblique", "corner"],
)
def test_texture_lies_where_the_camera_projects_it(camera, T):
    image = quiet([dots(T)], camera, background=BLACK).frame.color[..., 0]
    errors = []
    for dot in DOTS:
        expected = projected_disc(dot, camera, T)
        errors.append(centroid(image, expected) - expected)
    # Rounding to grey levels leaves thousandths; half a texture pixel would be 0.2 px or more.
    assert np.abs(np.mean(errors, axis=0)).max() < 0.01
    assert np.linalg.norm(errors, axis=1).max() < 0.03


def test_a_texture_much_larger_than_its_image_is_shrunk_without_a_shift():
    T = pose(roll=12)
    small = dots(T)
    large = Rectangle(small.texture.repeat(5, axis=0).repeat(5, axis=1), WIDTH, HEIGHT, T)
    image = quiet([large], background=BLACK).frame.color[..., 0]
    errors = [centroid(image, p) - p for p in (projected_disc(d, PLAIN, T) for d in DOTS)]
    assert np.linalg.norm(errors, axis=1).max() < 0.03


def test_the_lens_moves_the_dots_of_these_tests():
    T = pose((0.16, 0.12, 0.75))
    moved = LENS.project(on_rectangle(DOTS, T)) - PLAIN.project(on_rectangle(DOTS, T))
    assert np.linalg.norm(moved, axis=1).max() > 0.5


@pytest.mark.parametrize("camera", [PLAIN, LENS], ids=["plain", "lens"])
def test_edges_are_antialiased_at_the_true_corners(camera):
    T = pose((0.013, -0.007, 0.71), tilt=30, axis=0.7, roll=17)
    rendering = quiet([plain(200, T)], camera, background=BLACK)
    share = rendering.frame.color[..., 1] / 200.0
    # The outline with the curvature that a lens gives it.
    t = np.linspace(0, 1, 200, endpoint=False)[:, None]
    c = plain(0, T).corners
    sides = zip(c, np.roll(c, -1, axis=0), strict=True)
    outline = camera.project(np.vstack([a + t * (b - a) for a, b in sides]))
    x, y = outline.T
    x1, y1 = np.roll(outline, -1, axis=0).T
    cross = x * y1 - x1 * y
    area = cross.sum() / 2
    centre = np.array([((x + x1) @ cross), ((y + y1) @ cross)]) / (6 * area)
    v, u = np.mgrid[:480, :640]
    found = np.array([(share * u).sum(), (share * v).sum()]) / share.sum()
    assert share.sum() == pytest.approx(area, rel=2e-3)
    np.testing.assert_allclose(found, centre, atol=0.03)
    assert np.count_nonzero((share > 0.1) & (share < 0.9)) > 200  # not a hard edge


def test_reported_corners_are_the_projected_ones():
    T = pose(tilt=30, axis=1.0)
    (corners,) = quiet([plain(200, T)], LENS).corners
    x, y = WIDTH / 2, HEIGHT / 2
    as_printed = T.apply([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]])
    np.testing.assert_allclose(corners, LENS.project(as_printed), atol=1e-9)
    # Upright and seen from the front: top-left comes first.
    assert corners[0, 0] < corners[1, 0]
    assert corners[0, 1] < corners[3, 1]


@pytest.mark.parametrize("camera", [PLAIN, LENS], ids=["plain", "lens"])
def test_depth_is_that_of_the_plane(camera):
    T = pose((0.03, 0.01, 0.8), tilt=50, axis=0.6)
    depth = quiet([plain(200, T)], camera).true_depth
    on_plane = T.apply([[0, 0, 0], [0.1, 0.08, 0], [-0.1, 0.08, 0], [0.05, -0.07, 0]])
    pixels = np.rint(camera.project(on_plane)).astype(int)
    rays = camera.rays(pixels)
    normal = T.rotation.as_matrix()[:, 2]
    expected = (normal @ T.translation) / (rays @ normal)
    found = depth[pixels[:, 1], pixels[:, 0]]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert np.ptp(found) > 0.05  # it is oblique: the depths really differ


def test_depth_reaches_to_the_pixels_whose_centres_are_inside():
    rendering = quiet([plain(200, pose((0.0, 0.0, 0.7)))])
    rows, columns = np.nonzero(rendering.true_depth < 1.0)
    (corners,) = rendering.corners
    assert (columns.min(), rows.min()) == tuple(np.ceil(corners[0]).astype(int))
    assert (columns.max(), rows.max()) == tuple(np.floor(corners[2]).astype(int))


def test_without_rectangles_there_is_the_background():
    rendering = quiet([], background_depth=1.25)
    assert np.all(rendering.true_depth == 1.25)
    assert np.all(rendering.frame.color == 128)
    assert rendering.corners == ()


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearer_rectangle_hides_the_farther_whatever_their_order(order):
    far = plain(50, pose((0.0, 0.0, 0.9)))
    near = plain(220, pose((0.06, 0.0, 0.6)), width=0.12)
    both = [far, near]
    rendering = quiet([both[i] for i in order])
    middle = np.rint(PLAIN.project([[0.06, 0.0, 0.6]])[0]).astype(int)
    assert rendering.frame.color[middle[1], middle[0], 0] == 220
    assert rendering.true_depth[middle[1], middle[0]] == pytest.approx(0.6)
    visible = dict(zip(order, rendering.visible, strict=True))
    # The near one covers x = 0 … 0.12 at 0.6 m: of the far one 0 … 0.12 at 0.9 m, its right half.
    assert visible[0] == pytest.approx(0.5, abs=0.02)
    assert visible[1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_board_just_before_an_oblique_face_hides_it_wherever_its_centre_is(side):
    T = pose(tilt=45, axis=np.pi / 2)
    board_pose = T * RigidTransform.from_translation([side * 0.08, 0.0, 0.005])
    board = plain(220, board_pose, width=0.08, height=0.3)
    rendering = quiet([plain(50, T), board])
    # It covers a third of the face's width, 0.04 … 0.12 m from the centre.
    x = side * np.array([0.04, 0.12, 0.12, 0.04])
    y = np.array([1, 1, -1, -1]) * HEIGHT / 2
    strip = PLAIN.project(T.apply(np.column_stack([x, y, np.zeros(4)])))
    hidden = area_of(strip) / area_of(rendering.corners[0])
    assert rendering.visible[0] == pytest.approx(1 - hidden, abs=0.03)
    assert rendering.visible[1] == pytest.approx(1.0, abs=0.02)
    column, row = np.rint(PLAIN.project([board_pose.translation])[0]).astype(int)
    assert rendering.frame.color[row, column, 0] == 220
    assert rendering.true_depth[row, column] == pytest.approx(board_pose.translation[2], abs=2e-3)


def test_faces_of_a_convex_box_hide_nothing_of_each_other():
    size = (0.2, 0.15, 0.1)
    T = pose((0.02, 0.0, 0.7), tilt=35, axis=0.8)
    faces = [
        Rectangle(
            np.full((9, 9, 3), 100, np.uint8),
            *box_face_size(size, side),
            T * box_face_pose(size, side),
        )
        for side in SIDES
    ]
    rendering = quiet(faces)
    shown = [
        v
        for v, corners in zip(rendering.visible, rendering.corners, strict=True)
        if corners is not None
    ]
    assert len(shown) == 3
    np.testing.assert_allclose(shown, 1.0, atol=0.02)


def test_three_boards_each_leaning_on_the_next_are_all_drawn():
    boards = []
    for k in range(3):
        around = Rotation.from_euler("z", 120 * k, degrees=True)
        lean = Rotation.from_euler("y", 10, degrees=True)
        place = np.array([0.0, 0.0, 0.7]) + around.apply([0.0, 0.05, 0.0])
        turn = around * lean * Rotation.from_matrix(FRONTAL)
        boards.append(plain(100, RigidTransform.from_components(place, turn), height=0.05))
    assert all(v > 0.3 for v in quiet(boards).visible)


def test_what_lies_outside_of_the_image_is_not_visible():
    half = 319.5 / 525.0 * 0.7  # the left border of the image at 0.7 m
    rendering = quiet([plain(200, pose((-half, 0.0, 0.7))), plain(200, pose((2.0, 0.0, 0.7)))])
    assert rendering.visible[0] == pytest.approx(0.5, abs=0.01)
    assert rendering.visible[1] == 0.0
    assert np.all(rendering.true_depth[:, 300:] == 1.5)


def test_the_back_of_a_rectangle_is_not_there():
    turned = RigidTransform.from_components([0, 0, 0.7], Rotation.identity())
    rendering = quiet([plain(200, turned)])
    assert rendering.corners == (None,)
    assert rendering.visible == (0.0,)
    assert np.all(rendering.true_depth == 1.5)


def test_a_rectangle_that_reaches_behind_the_camera_is_left_out():
    rendering = quiet([plain(200, pose((0, 0, 0.05), tilt=80), width=1.0, height=1.0)])
    assert rendering.corners == (None,)


def test_colour_noise_has_the_stated_standard_deviation():
    T = pose()
    noisy = render([plain(120, T)], PLAIN, np.random.default_rng(1), color_noise=3.0)
    inside = noisy.frame.color[180:300, 270:390].astype(float)
    n = inside.size
    # Rounding adds 1/12 to the variance; bounds at five standard errors.
    sigma = np.sqrt(9 + 1 / 12)
    assert inside.std() == pytest.approx(sigma, abs=5 * sigma / np.sqrt(2 * n))
    assert inside.mean() == pytest.approx(120, abs=5 * sigma / np.sqrt(n))


def test_the_same_seed_gives_the_same_frame_and_another_seed_another():
    def frame(seed):
        return render([plain(120, pose())], PLAIN, np.random.default_rng(seed)).frame

    np.testing.assert_array_equal(frame(3).color, frame(3).color)
    np.testing.assert_array_equal(frame(3).depth, frame(3).depth)
    assert np.any(frame(3).color != frame(4).color)
    assert np.any(frame(3).depth != frame(4).depth)


def test_a_texture_finer_than_the_pixels_becomes_its_mean_and_no_moire():
    checker = np.indices((1000, 1000)).sum(axis=0) % 2 * 255
    fine = np.repeat(checker[..., None], 3, axis=2).astype(np.uint8)
    T = pose((0.0, 0.0, 1.2), tilt=50, axis=0.3)
    rendering = quiet([Rectangle(fine, 0.25, 0.25, T)])
    inside = rendering.frame.color[220:260, 300:340].astype(float)
    assert inside.mean() == pytest.approx(127.5, abs=1)
    assert inside.std() < 3  # 127.5 where it is sampled once a pixel
