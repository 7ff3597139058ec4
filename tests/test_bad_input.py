"""Arguments that no sensible caller passes: a typed error or an empty result, never a panic.

A panic of the core would arrive as pyo3_runtime.PanicException, which is no Exception and so
passes every `pytest.raises` and `except` here.
"""

import numpy as np
import pytest

from planegrasp import _core
from planegrasp.alignment import AlignmentConfig, align, prepare_alignment
from planegrasp.errors import ImageError, InvalidInputError, PlanegraspError
from planegrasp.features import EXTRACTORS, SURFConfig, make_extractor
from planegrasp.homography import HomographyConfig

NOISE = np.random.default_rng(0).integers(0, 256, (64, 96)).astype(np.uint8)
NAMES = sorted(EXTRACTORS)
POINTS = np.random.default_rng(1).uniform(0, 90, (30, 2))
ENDS = [np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320]


def core_sift(**settings):
    return _core.Sift(**(_core.Sift.defaults() | {"threads": 0} | settings))


def core_surf(**settings):
    defaults = SURFConfig()
    names = SURFConfig.__dataclass_fields__
    return _core.Surf(**({name: getattr(defaults, name) for name in names} | settings))


TAKE_AN_IMAGE = {
    "sift": lambda image: core_sift().extract(image)[4],
    "surf": lambda image: core_surf().extract(image)[4],
    "alignment": _core.AlignmentReference,
    "appearance": _core.Appearance,
}
EXTRACTING = ("sift", "surf")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "image",
    [
        np.zeros((0, 0), np.uint8),
        np.zeros((0, 8), np.uint8),
        np.zeros((8, 0), np.uint8),
        np.zeros((8, 8, 3), np.uint8),
        np.zeros(8, np.uint8),
        np.zeros((), np.uint8),
        np.full((60, 60), np.nan),
        NOISE.astype(np.float32),
        NOISE.astype(np.int8),
        NOISE.astype(object),
        NOISE > 100,
    ],
    ids=lambda image: f"{image.dtype}-{'x'.join(map(str, image.shape))}",
)
def test_extractors_refuse_what_is_no_grey_image(name, image):
    with pytest.raises(ImageError):
        make_extractor(name).extract(image)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 96), (64, 1), (3, 5), (9, 9), (16, 16)])
def test_images_smaller_than_a_patch_have_finite_features_or_none(name, shape):
    features = make_extractor(name).extract(NOISE[: shape[0], : shape[1]])
    for values in (features.points, features.scales, features.angles, features.responses):
        assert np.all(np.isfinite(values))
    assert len(features.descriptors) == len(features)


@pytest.mark.parametrize("name", NAMES)
def test_extractors_see_the_same_in_every_memory_layout(name):
    extractor = make_extractor(name)
    wide = np.repeat(NOISE, 2, axis=1)
    expected = extractor.extract(NOISE).points
    assert len(expected) > 0
    for image in (np.asfortranarray(NOISE), wide[:, ::2], NOISE[::-1].copy()[::-1]):
        np.testing.assert_array_equal(extractor.extract(image).points, expected)


@pytest.mark.parametrize("taking", TAKE_AN_IMAGE)
@pytest.mark.parametrize(
    "image",
    [np.asfortranarray(NOISE), NOISE[::2, ::2], NOISE[::-1], np.broadcast_to(NOISE[0], (9, 96))],
    ids=["fortran", "strided", "flipped", "broadcast"],
)
def test_the_core_refuses_images_with_gaps_instead_of_reading_them_wrongly(taking, image):
    with pytest.raises(InvalidInputError, match="C-contiguous"):
        TAKE_AN_IMAGE[taking](image)


@pytest.mark.parametrize("taking", TAKE_AN_IMAGE)
@pytest.mark.parametrize("image", [NOISE.astype(np.float32), np.full((9, 9), np.nan), None, [[1]]])
def test_the_core_takes_no_other_types(taking, image):
    with pytest.raises(TypeError):
        TAKE_AN_IMAGE[taking](image)


@pytest.mark.parametrize("taking", TAKE_AN_IMAGE)
@pytest.mark.parametrize("shape", [(0, 0), (0, 9), (9, 0), (1, 1), (1, 5000), (5000, 1), (7, 7)])
def test_the_core_takes_or_refuses_images_without_a_patch(taking, shape):
    try:
        result = TAKE_AN_IMAGE[taking](np.zeros(shape, np.uint8))
    except InvalidInputError:
        assert taking not in EXTRACTING
    else:
        assert taking not in EXTRACTING or len(result) == 0


@pytest.mark.parametrize("shape", [(2, 100_000), (100_000, 2)])
def test_very_long_images_are_refused_by_sift_and_searched_by_surf(shape):
    long = np.zeros(shape, np.uint8)
    with pytest.raises(InvalidInputError, match="at most 65536 px"):
        make_extractor("sift").extract(long)
    assert len(make_extractor("surf").extract(long)) == 0


@pytest.mark.parametrize(
    "settings",
    [
        {"max_features": -1},
        {"octave_layers": 0},
        {"octave_layers": 2**40},
        {"contrast_threshold": np.nan},
        {"edge_threshold": np.inf},
        {"sigma": np.nan},
        {"sigma": -1.6},
        {"threads": -1},
        {"threads": 2**40},
    ],
)
def test_impossible_settings_of_sift_are_refused(settings):
    with pytest.raises(InvalidInputError, match=next(iter(settings))):
        core_sift(**settings)


@pytest.mark.parametrize(
    "settings",
    [
        {"hessian_threshold": np.nan},
        {"hessian_threshold": np.inf},
        {"octaves": 0},
        {"octaves": 2**40},
        {"octave_layers": -1},
        {"max_features": -1},
    ],
)
def test_impossible_settings_of_surf_are_refused(settings):
    with pytest.raises(InvalidInputError, match=next(iter(settings))):
        core_surf(**settings)


def test_a_budget_beyond_all_memory_is_no_limit():
    assert len(core_sift(max_features=2**62).extract(NOISE)[0]) > 0
    assert len(core_surf(max_features=2**62, hessian_threshold=0.0).extract(NOISE)[0]) > 0


def face(n, length=8):
    """Points, frames without area, and descriptors."""
    rng = np.random.default_rng(n)
    points = rng.uniform(0, 90, (n, 2)).astype(np.float32)
    frames = np.zeros((n, 2, 2), np.float32)
    return points, frames, rng.integers(0, 256, (n, length)).astype(np.uint8)


def keypoints(n):
    """Points, scales and angles; some of these say nothing."""
    points = np.zeros((n, 2), np.float32)
    return points, np.arange(n, dtype=np.float32), np.full(n, np.nan, np.float32)


@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("references", [0, 1, 2])
@pytest.mark.parametrize("queries", [0, 1, 40])
def test_the_index_answers_for_hardly_any_descriptors(is_binary, references, queries):
    index = _core.ReferenceIndex(8, is_binary=is_binary)
    index.add(*face(references), 1.0)
    descriptors = face(queries)[2]
    proposed = index.propose(descriptors, *keypoints(queries))
    number, reference, distance, ratio = index.candidates(descriptors, 3, among=proposed)
    assert number.shape == reference.shape == distance.shape == (queries, 3)
    assert ratio.shape == (queries,)
    np.testing.assert_array_equal((number >= 0).sum(axis=1), np.full(queries, references))
    np.testing.assert_array_equal(np.isfinite(distance), number >= 0)


def test_the_index_refuses_more_neighbours_than_there_is_memory_for():
    index = _core.ReferenceIndex(8, is_binary=False)
    for k in (4097, 2**40, 2**62):
        with pytest.raises(InvalidInputError, match="k must be"):
            index.candidates(face(3)[2], k, among=np.zeros(0, np.uint32))


def test_the_index_takes_any_radius_and_refuses_impossible_lengths_and_faces():
    for radius in ENDS:
        index = _core.ReferenceIndex(8, is_binary=False)
        index.add(*face(20), radius)
        queries = face(5)[2]
        ratio = index.candidates(queries, 4, among=index.propose(queries, *keypoints(5)))[3]
        assert not np.any(np.isnan(ratio))
    for length in (5000, 2**60):
        with pytest.raises(InvalidInputError):
            _core.ReferenceIndex(length, is_binary=False).add(*face(0, 8), 1.0)
    with pytest.raises(InvalidInputError, match="not in the index"):
        index.remove(2**60)
    with pytest.raises(InvalidInputError, match="not in the index"):
        index.candidates(face(5)[2], 4, among=np.array([2**32 - 1], np.uint32))


def is_typed_or_finite(call):
    """Whether the call ends in a typed error, in None or in finite numbers."""
    try:
        result = call()
    except PlanegraspError:
        return True
    matrix = result[0] if isinstance(result, tuple) else result
    return matrix is None or bool(np.all(np.isfinite(matrix)))


DEGENERATE = {
    "none": POINTS[:0],
    "three": POINTS[:3],
    "repeated": np.repeat(POINTS[:1], 30, axis=0),
    "two places": np.repeat(POINTS[:2], 15, axis=0),
    "three places": np.repeat(POINTS[:3], 10, axis=0),
    "a line": np.column_stack([np.arange(30.0), 2 * np.arange(30.0)]),
    "a row": np.column_stack([np.arange(30.0), np.zeros(30)]),
}


@pytest.mark.parametrize("source", DEGENERATE)
def test_matches_that_determine_no_homography_give_none(source):
    points = DEGENERATE[source]
    settings = {"threshold": 3.0, "max_iterations": 500}
    assert _core.estimate_homography(points, points, **settings) is None
    for start in (np.eye(3), np.zeros((3, 3)), np.ones((3, 3))):
        assert is_typed_or_finite(
            lambda start=start: _core.refine_homography(points, points, start, 1.0)
        )


@pytest.mark.parametrize("value", ENDS)
def test_homographies_of_extreme_numbers_are_refused_or_finite(value):
    settings = {"threshold": 3.0, "max_iterations": 200}
    bad = POINTS.copy()
    bad[3, 1] = value
    start = np.eye(3)
    start[1, 2] = value
    calls = [
        lambda: _core.estimate_homography(bad, POINTS, **settings),
        lambda: _core.estimate_homography(POINTS, bad, **settings),
        lambda: _core.estimate_homography(bad, bad, **settings),
        lambda: _core.estimate_homography(POINTS, POINTS, threshold=value, max_iterations=200),
        lambda: _core.refine_homography(bad, POINTS, np.eye(3), 1.0),
        lambda: _core.refine_homography(POINTS, bad, np.eye(3), 1.0),
        lambda: _core.refine_homography(POINTS, POINTS, start, 1.0),
        lambda: _core.refine_homography(POINTS, POINTS, np.eye(3), value),
    ]
    for number, call in enumerate(calls):
        assert is_typed_or_finite(call), number


def test_homographies_take_any_layout():
    settings = {"threshold": 3.0, "max_iterations": 200}
    expected = _core.estimate_homography(POINTS, POINTS, **settings)
    for points in (np.asfortranarray(POINTS), np.repeat(POINTS, 2, axis=0)[::2]):
        found = _core.estimate_homography(points, points, **settings)
        np.testing.assert_array_equal(found[0], expected[0])


CAMERA = _core.Camera(96, 64, 90.0, 90.0, 47.5, 31.5, (0.0,) * 5)
FACE_FROM_EDGE = np.array([[1e-3, 0, -0.048], [0, -1e-3, 0.032], [0, 0, 1.0]])


def search_of(points, frames):
    names = HomographyConfig.__dataclass_fields__
    config = HomographyConfig(min_agreement=0.0)
    search = _core.FaceSearch(_core.SearchSettings(**{n: getattr(config, n) for n in names}))
    search.add(FACE_FROM_EDGE, points.astype(np.float32), frames.astype(np.float32), NOISE)
    return search


def searched(image_points, points=POINTS, frames=None):
    """The attempts at a face whose keypoint i is seen at image point i."""
    n = len(image_points)
    frames = np.tile(np.eye(2), (len(points), 1, 1)) if frames is None else frames
    search = search_of(points, frames)
    evidence = search.evidence(
        np.zeros((n, 1), np.int32),
        np.arange(n, dtype=np.int32)[:, None],
        np.full(n, 0.5, np.float32),
        np.asarray(image_points, dtype=float),
        np.ones(n, np.float32),
        np.zeros(n, np.float32),
    )
    where = {"evidence": evidence, "gray": NOISE, "camera": CAMERA}
    attempts = search.find(**where, among=np.array([0, 9], np.uint32), max_instances=2**40)
    for predicted in (np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan), np.full((3, 3), 1e308)):
        search.look_where(0, predicted, **where)
    search.hypotheses(evidence, 0, CAMERA)
    return attempts


def test_a_face_of_good_matches_is_found():
    assert [attempt.stage for attempt in searched(POINTS - 0.5)] == ["found"]


@pytest.mark.parametrize("where", DEGENERATE)
def test_the_search_refuses_degenerate_matches(where):
    points = DEGENERATE[where]
    for image in (points, POINTS[: len(points)]):
        attempts = searched(image, points)
        assert [attempt.found for attempt in attempts] == [None]
        assert attempts[0].reason


@pytest.mark.parametrize("value", ENDS)
def test_the_search_refuses_or_outlives_extreme_numbers(value):
    image = POINTS.copy()
    image[:4] = value
    frames = np.tile(np.eye(2), (30, 1, 1))
    frames[5:9] = value
    for arguments in ((image,), (POINTS, POINTS, frames), (np.full((30, 2), value),)):
        with np.errstate(over="ignore"):
            try:
                searched(*arguments)
            except InvalidInputError as error:
                assert "finite" in str(error)  # noqa: PT017 - also no error is right


def test_a_face_of_one_keypoint_is_refused_for_its_matches():
    attempts = searched(POINTS[:1], POINTS[:1])
    assert [attempt.stage for attempt in attempts] == ["matching"]


def test_candidates_of_faces_and_keypoints_that_there_are_not_match_nothing():
    search = search_of(POINTS, np.tile(np.eye(2), (30, 1, 1)))
    n = 40
    none = np.full((n, 2), -1, np.int32)
    far = np.full((n, 2), 2**31 - 1, np.int32)
    column = np.ones(n, np.float32)
    for face_number, reference in ((none, none), (far, far), (np.zeros_like(none), far)):
        evidence = search.evidence(face_number, reference, column, np.ones((n, 2)), column, column)
        assert len(search.matches(evidence, 0, 1.0)) == 0
    with pytest.raises(InvalidInputError, match="there are 1 faces"):
        search.matches(evidence, -1, 1.0)


def core_align(frame, start):
    return align(prepare_alignment(NOISE), frame, start, AlignmentConfig())


@pytest.mark.parametrize(
    "start",
    [np.zeros((3, 3)), np.ones((3, 3)), np.diag([1, 1, 0.0]), np.diag([1, -1, 1.0])]
    + [np.full((3, 3), value) for value in ENDS]
    + [np.diag([value, value, 1.0]) for value in ENDS],
)
def test_alignment_from_an_impossible_start_has_no_result_or_a_finite_one(start):
    found = core_align(NOISE, start)
    assert found is None or np.all(np.isfinite(found.homography))


@pytest.mark.parametrize("shape", [(0, 0), (0, 96), (1, 1), (1, 96), (64, 1), (9, 9)])
def test_alignment_in_a_frame_without_a_tile_has_no_result(shape):
    assert core_align(np.zeros(shape, np.uint8), np.eye(3)) is None


def test_alignment_on_one_grey_has_no_result():
    flat = np.full((64, 96), 7, np.uint8)
    assert core_align(flat, np.eye(3)) is None
    assert align(prepare_alignment(flat), NOISE, np.eye(3), AlignmentConfig()) is None
