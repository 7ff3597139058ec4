import cv2
import numpy as np
import pytest

from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import backgrounds
from planegrasp.errors import InvalidInputError
from planegrasp.features import ORB, SIFT
from planegrasp.features.oblique import FRONTAL, ObliqueConfig, extract_oblique, oblique_views
from planegrasp.geometry import edge_from_pixel
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render

DOTS = np.array([[30.0, 40.0], [150.0, 35.0], [90.0, 75.0], [25.0, 110.0], [160.0, 115.0]])


def dotted(shape=(150, 190), sigma=4.0):
    """Smooth dots at `DOTS` (pixel centres at integers)."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    square = (x[..., None] - DOTS[:, 0]) ** 2 + (y[..., None] - DOTS[:, 1]) ** 2
    return np.rint(250 * np.exp(-square / (2 * sigma**2)).sum(axis=2)).astype(np.uint8)


def gray(image):
    return cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def centroid(image, near, reach):
    x0, y0 = np.rint(near).astype(int)
    y, x = np.mgrid[y0 - reach[1] : y0 + reach[1] + 1, x0 - reach[0] : x0 + reach[0] + 1]
    inside = (x >= 0) & (y >= 0) & (x < image.shape[1]) & (y < image.shape[0])
    w = image[y.clip(0, image.shape[0] - 1), x.clip(0, image.shape[1] - 1)] * inside.astype(float)
    return np.array([(w * x).sum(), (w * y).sum()]) / w.sum()


def test_dots_of_the_reference_appear_where_each_view_says():
    views = list(oblique_views(dotted(), ObliqueConfig()))
    worst = 0.0
    for view in views:
        tilt = 1 / np.linalg.det(view.view_from_reference[:, :2])
        reach = (round(17 / tilt) + 4, 20)
        for dot in DOTS:
            expected = view.view_from_reference @ [*dot, 1.0]
            error = centroid(view.image, expected, reach) - expected
            worst = max(worst, np.abs(error).max())
    # A dot four times compressed is 1 px wide; half a pixel lost anywhere would be 0.1 or more.
    assert worst < 0.05


@pytest.mark.parametrize("tilt", [1.0, 2**0.5, 2.0, 4.0])
def test_views_compress_by_the_tilt_in_one_direction(tilt):
    for view in oblique_views(dotted(), ObliqueConfig(tilts=(tilt,))):
        values = np.linalg.svd(view.view_from_reference[:, :2], compute_uv=False)
        np.testing.assert_allclose(values, [1.0, 1.0 / tilt])
        assert np.linalg.det(view.view_from_reference[:, :2]) > 0  # not mirrored


def test_the_whole_reference_is_in_every_view():
    corners = np.array([[0, 0, 1], [189, 0, 1], [189, 149, 1], [0, 149, 1]])
    for view in oblique_views(dotted(), ObliqueConfig()):
        placed = corners @ view.view_from_reference.T
        height, width = view.image.shape
        assert np.all(placed > -1e-6)
        assert np.all(placed <= (width - 0.5, height - 0.5))


def test_the_frontal_view_is_the_reference_itself():
    (view,) = oblique_views(dotted(), FRONTAL)
    np.testing.assert_array_equal(view.image, dotted())
    np.testing.assert_array_equal(view.view_from_reference, np.eye(2, 3))


@pytest.mark.parametrize(
    ("config", "count"),
    [
        # Multiples of 50°/t below 180°: 1, then 6, 8, 11, 15, 21.
        (ObliqueConfig(), 62),
        (ObliqueConfig(tilts=(1.0, 2.0)), 9),
        (ObliqueConfig(tilts=(1.0, 2.0), rotation_step=36.0), 11),
        (FRONTAL, 1),
    ],
)
def test_number_of_views(config, count):
    assert len(list(oblique_views(dotted(), config))) == count


def test_blur_acts_along_the_compressed_direction():
    noise = np.random.default_rng(0).integers(0, 256, (150, 190)).astype(np.uint8)

    def contrast(blur):
        (view,) = oblique_views(noise, ObliqueConfig((4.0,), rotation_step=720.0, blur=blur))
        return view.image.astype(float)

    sharp, blurred = contrast(0.0), contrast(0.8)
    assert blurred.std() < 0.5 * sharp.std()
    # Down the columns, which are not compressed, neighbours stay as different as they were.
    rows = blurred - blurred.mean(axis=0)
    correlation = (rows[1:] * rows[:-1]).mean() / (rows * rows).mean()
    assert abs(correlation) < 0.1


@pytest.mark.parametrize("tilts", [(), (0.5,), (1.0, 11.0), (float("nan"),)])
def test_impossible_tilts_are_refused_with_their_value(tilts):
    with pytest.raises(InvalidInputError, match="tilts are ≥ 1 and ≤ 10") as caught:
        ObliqueConfig(tilts=tilts)
    assert str(tilts) in str(caught.value)


@pytest.mark.parametrize("wrong", [{"rotation_step": 0.0}, {"rotation_step": -1.0}, {"blur": -0.1}])
def test_impossible_steps_and_blurs_are_refused(wrong):
    with pytest.raises(InvalidInputError, match="rotation_step must be > 0° and blur ≥ 0"):
        ObliqueConfig(**wrong)


def test_keypoints_of_all_views_lie_on_the_dots_of_the_reference():
    features = extract_oblique(SIFT(), dotted(), ObliqueConfig())
    distance = np.linalg.norm(features.points[:, None] - DOTS, axis=2)
    nearest = distance.min(axis=1)
    # SIFT also answers between the dots; those on a dot must be on its centre.
    on_dot = nearest < 4
    counts = np.bincount(distance.argmin(axis=1)[on_dot], minlength=len(DOTS))
    assert counts.min() >= 15  # of 28 views
    assert np.median(nearest[on_dot]) < 0.2


def test_keypoints_stay_on_the_reference(photo):
    image = gray(photo("coffee", width=200))
    features = extract_oblique(SIFT(), image, ObliqueConfig())
    height, width = image.shape
    assert np.all((features.points >= 0) & (features.points <= (width - 1, height - 1)))
    assert len(features.points) == len(features.frames) == len(features.descriptors)


def test_frontal_features_are_those_of_the_extractor(photo):
    image = gray(photo("coffee", width=200))
    plain, features = SIFT().extract(image), extract_oblique(SIFT(), image, FRONTAL)
    np.testing.assert_allclose(features.points, plain.points, atol=1e-6)
    np.testing.assert_allclose(features.frames, plain.frames, rtol=1e-6, atol=1e-5)
    np.testing.assert_array_equal(features.descriptors, plain.descriptors)


@pytest.mark.parametrize("extractor", [SIFT(), ORB()])
@pytest.mark.parametrize("shape", [(1, 1), (5, 5), (1, 40), (60, 80)])
def test_a_reference_without_texture_has_no_features(extractor, shape):
    features = extract_oblique(extractor, np.full(shape, 99, np.uint8), ObliqueConfig())
    assert len(features) == 0
    assert features.frames.shape == (0, 2, 2)


def right_matches(photo, tilt, config):
    """How many mutual nearest neighbours of a rendered oblique view are right, and their maps."""
    image = photo("astronaut", width=300)
    model = ObjectModel.from_image("a", image, 0.25)
    T = facing_pose(np.array([0.02, 0.01, 0.7]), np.radians(tilt), 0.5, 0.3)
    rng = np.random.default_rng(2)
    rendering = render(rectangles(model, T), CAMERA, rng, background=backgrounds()[4])
    n = image.shape[0]
    edge = np.array([[0, 0], [300, 0], [300, n], [0, n]], np.float32)
    H = cv2.getPerspectiveTransform(edge, rendering.corners[0].astype(np.float32))
    taught = extract_oblique(SIFT(), gray(image), config)
    seen = SIFT().extract(gray(rendering.frame.color))
    matches = cv2.BFMatcher(cv2.NORM_L2, crossCheck=True).match(
        taught.descriptors, seen.descriptors
    )
    i, j = np.array([(m.queryIdx, m.trainIdx) for m in matches]).T
    edges = edge_from_pixel(taught.points[i])
    true = cv2.perspectiveTransform(edges[None], H)[0]
    right = np.linalg.norm(seen.points[j] - true, axis=1) < 3
    step = 0.5
    jacobian = np.stack(
        [
            (cv2.perspectiveTransform((edges + axis)[None], H)[0] - true) / step
            for axis in step * np.eye(2)
        ],
        axis=2,
    )
    found = seen.frames[j] @ np.linalg.inv(taught.frames[i].astype(float))
    return np.count_nonzero(right), found[right], jacobian[right]


def test_views_give_right_matches_where_the_reference_alone_has_few(photo):
    frontal, _, _ = right_matches(photo, 72, FRONTAL)
    oblique, _, _ = right_matches(photo, 72, ObliqueConfig())
    assert oblique > 50
    assert oblique > 5 * frontal


def test_frames_of_an_oblique_match_give_the_local_map(photo):
    _, found, true = right_matches(photo, 60, ObliqueConfig())
    relative = np.linalg.inv(true) @ found
    off = np.linalg.norm(relative - np.eye(2), axis=(1, 2))
    # The nearest of the views is within a factor √2 of the tilt and 18° of its direction.
    assert np.median(off) < 0.4
    # Without the views' maps they are far off: the true one compresses two times.
    similarity = np.sqrt(np.linalg.det(found))[:, None, None] * np.eye(2)
    assert (
        np.median(np.linalg.norm(np.linalg.inv(true) @ similarity - np.eye(2), axis=(1, 2))) > 0.6
    )
