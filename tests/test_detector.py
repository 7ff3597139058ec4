"""End to end: rendered frames in, corners and poses out, against exact truth."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planegrasp.bench.distractors import distractor_scene
from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles, view
from planegrasp.bench.textures import OBJECTS, backgrounds
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.errors import InvalidInputError, LibraryError, UnknownObjectError
from planegrasp.features import SIFT, SIFTConfig
from planegrasp.features.oblique import FRONTAL, ObliqueConfig
from planegrasp.features.pruning import PruningConfig
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.homography import HomographyConfig, apply_homography, reference_corners
from planegrasp.library import ObjectLibrary
from planegrasp.matching.index import NativeIndex
from planegrasp.objects import ObjectModel, PlanarFace
from planegrasp.pose import FusedConfig, FusedEstimator
from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation import Rectangle, render

LENS = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (0.12, -0.25, 0.001, -0.002, 0.08))
FRONT = np.diag([1.0, -1.0, -1.0])
# A quarter of the trial views chooses descriptors nearly as well, in a quarter of the time.
QUICK = DetectorConfig(pruning=PruningConfig(views=40))


@pytest.fixture(scope="module")
def taught(photo):
    """A photograph as a one-face object."""

    @cache
    def model(name, width=0.25, called=None):
        return ObjectModel.from_image(called or name, photo(name, width=300), width)

    return model


@pytest.fixture(scope="module")
def detector(taught):
    """A detector of some photographs, made once."""

    @cache
    def make(*names, **settings):
        return Detector([taught(name) for name in names], replace(QUICK, **settings))

    return make


def pose(x=0.02, y=-0.01, z=0.7, *, tilt=30.0, axis=0.4, roll=0.3):
    return facing_pose(np.array([x, y, z]), np.radians(tilt), axis, roll)


def frame_of(*placed, camera=CAMERA, seed=0, background=4):
    """A noisy frame of (model, pose) and rectangles."""
    scene = []
    for item in placed:
        scene += [item] if isinstance(item, Rectangle) else rectangles(*item)
    rng = np.random.default_rng(seed)
    return render(scene, camera, rng, background=backgrounds()[background])


def corner_errors(detection, corners):
    return np.linalg.norm(detection.corners - corners, axis=1)


def pose_errors(detection, truth):
    """Millimetres and degrees."""
    difference = detection.T_camera_object.inv() * truth
    return 1e3 * np.linalg.norm(difference.translation), np.degrees(difference.rotation.magnitude())


def assert_found(detection, rendering, index, truth, *, pixels=0.6, mm=1.0, degrees=0.3):
    """Corners and pose near the truth; the defaults are about five times the usual error."""
    assert corner_errors(detection, rendering.corners[index]).mean() < pixels
    off_mm, off_degrees = pose_errors(detection, truth)
    assert off_mm < mm
    assert off_degrees < degrees


@pytest.mark.parametrize("name", ["astronaut", "coffee", "retina"])
@pytest.mark.parametrize("tilt", [0.0, 45.0])
def test_an_object_is_found_with_its_corners_and_pose(detector, taught, name, tilt):
    T = pose(tilt=tilt)
    rendering = frame_of((taught(name), T))
    (found,) = detector(name).detect(rendering.frame)
    assert_found(found, rendering, 0, T)
    assert found.name == name
    assert found.model is taught(name)
    assert found.instance == 0
    assert found.inliers >= 8
    assert 0.5 < found.score <= 1.0
    assert found.covariance.shape == (6, 6)
    assert not found.ambiguous
    assert len(found.euler) == 3


@pytest.mark.parametrize("width", [150, 511])
def test_no_half_pixel_of_the_reference_is_lost(photo, width):
    # Small references are used as they are, large ones shrunk; half a pixel is 0.8 and 0.3 mm.
    model = ObjectModel.from_image("a", photo("astronaut", width=width), 0.25)
    detector = Detector([model])
    offsets = []
    for roll in range(4):
        T = pose(tilt=15, roll=roll)
        (found,) = detector.detect(frame_of((model, T), seed=roll).frame)
        offsets.append((T.inv() * found.T_camera_object).translation[:2])
    assert 1e3 * np.abs(np.mean(offsets, axis=0)).max() < 0.12


@pytest.mark.parametrize("extractor", ["sift", "akaze", "brisk", "orb"])
def test_every_extractor_finds_it_straight_on(detector, taught, extractor):
    T = pose(tilt=15)
    rendering = frame_of((taught("astronaut"), T))
    (found,) = detector("astronaut", extractor=extractor).detect(rendering.frame)
    assert_found(found, rendering, 0, T, pixels=1.5, mm=1.5, degrees=0.5)


@pytest.mark.parametrize(
    ("extractor", "matcher"),
    [("sift", "flann-kmeans"), ("sift", "brute-force"), ("orb", "flann-lsh")],
)
def test_every_matcher_will_do(detector, taught, extractor, matcher):
    T = pose(tilt=15)
    rendering = frame_of((taught("astronaut"), T))
    (found,) = detector("astronaut", extractor=extractor, matcher=matcher).detect(rendering.frame)
    assert_found(found, rendering, 0, T, pixels=1.5, mm=1.5, degrees=0.5)


@pytest.mark.parametrize(("method", "mm", "degrees"), [("pnp", 2, 0.5), ("three_point", 8, 4)])
def test_every_pose_method_will_do(detector, taught, method, mm, degrees):
    T = pose(tilt=20)
    # On a plain board, so that the paper's look-ups at the face's edge do not meet a depth edge.
    behind = T * RigidTransform.from_translation([0.0, 0.0, -0.001])
    board = Rectangle(np.full((9, 9, 3), 90, np.uint8), 0.4, 0.4, behind)
    rendering = frame_of((taught("astronaut"), T), board)
    (found,) = detector("astronaut", pose=method).detect(rendering.frame)
    assert_found(found, rendering, 0, T, mm=mm, degrees=degrees)


def test_stages_with_settings_of_their_own_are_used(taught):
    T = pose()
    frame = frame_of((taught("coffee"), T)).frame
    few = SIFT(SIFTConfig(max_features=300))
    exact = FusedEstimator(FusedConfig(size_sigma=0.0, pixel_sigma=0.5))
    config = DetectorConfig(extractor=few, pose=exact)
    custom = Detector([taught("coffee")], config).explain(frame)
    default = Detector([taught("coffee")]).explain(frame)
    assert custom.faces[0].figures["features"] <= 300 < default.faces[0].figures["features"]
    ours, theirs = custom.detections[0].covariance, default.detections[0].covariance
    # A size without doubt leaves less doubt about the distance.
    assert np.sqrt(np.trace(ours[:3, :3])) < 0.5 * np.sqrt(np.trace(theirs[:3, :3]))


def test_where_the_method_gives_no_pose_the_detection_says_why(detector, taught):
    frame = without_depth(frame_of((taught("astronaut"), pose())).frame)
    (found,) = detector("astronaut", pose="three_point").detect(frame)
    assert found.T_camera_object is None
    assert found.covariance is None
    assert found.euler is None
    assert "depth" in found.pose_failure


def test_oblique_views_find_what_the_reference_alone_does_not(detector, taught):
    T = pose(tilt=70, axis=1.0)
    rendering = frame_of((taught("coffee"), T))
    assert detector("coffee", oblique=FRONTAL).detect(rendering.frame) == []
    (found,) = detector("coffee").detect(rendering.frame)
    assert_found(found, rendering, 0, T, pixels=1, mm=2)


def test_a_far_object_is_found(detector, taught):
    T = pose(z=1.6, tilt=20)
    rendering = frame_of((taught("astronaut"), T))
    (found,) = detector("astronaut").detect(rendering.frame)
    assert_found(found, rendering, 0, T, mm=5, degrees=1)


def test_a_partly_hidden_object_is_found(detector, taught, photo):
    T = pose(tilt=25)
    cover = Rectangle(
        photo("chelsea"), 0.12, 0.3, T * RigidTransform.from_translation([0.09, 0, 0.04])
    )
    rendering = frame_of((taught("astronaut"), T), cover)
    assert rendering.visible[0] < 0.7
    (found,) = detector("astronaut").detect(rendering.frame)
    assert_found(found, rendering, 0, T, pixels=1, mm=2)


def test_lens_distortion_is_taken_out_and_put_back(detector, taught):
    T = pose(0.14, 0.08, 0.65, tilt=30)
    rendering = frame_of((taught("astronaut"), T), camera=LENS)
    straight = frame_of((taught("astronaut"), T))
    bent = np.linalg.norm(rendering.corners[0] - straight.corners[0], axis=1)
    assert bent.max() > 0.8
    (found,) = detector("astronaut").detect(rendering.frame)
    assert_found(found, rendering, 0, T)
    assert corner_errors(found, rendering.corners[0]).max() < bent.max()
    # The same image with the lens left out of the camera is off by more than the tolerance.
    ignored = RGBDFrame(rendering.frame.color, rendering.frame.depth, CAMERA)
    (wrong,) = detector("astronaut").detect(ignored)
    assert pose_errors(wrong, T)[0] > 1.5 * pose_errors(found, T)[0]


def test_a_strong_lens_does_not_make_the_face_look_unlike_its_reference(detector, taught):
    # A wide-angle lens: without undistortion the face would be compared tens of pixels off.
    barrel = PinholeCamera(640, 480, 420.0, 420.0, 319.5, 239.5, (-0.3, 0.1, 0.0, 0.0, -0.015))
    T = pose(0.25, 0.14, 0.6, tilt=15)
    rendering = frame_of((taught("astronaut"), T), camera=barrel)
    (found,) = detector("astronaut").detect(rendering.frame)
    assert_found(found, rendering, 0, T)
    assert found.faces[0].agreement > 0.85


def without_depth(frame):
    return RGBDFrame(frame.color, None, frame.camera)


def test_without_depth_the_pose_follows_from_the_known_size(detector, taught):
    T = pose(tilt=45)
    rendering = frame_of((taught("astronaut"), T))
    (found,) = detector("astronaut").detect(without_depth(rendering.frame))
    assert not found.ambiguous
    assert_found(found, rendering, 0, T, mm=2, degrees=0.5)


def test_depth_that_is_all_missing_is_as_no_depth(detector, taught):
    frame = frame_of((taught("astronaut"), pose(tilt=45))).frame
    empty = RGBDFrame(frame.color, np.zeros_like(frame.depth), CAMERA)
    (a,) = detector("astronaut").detect(empty)
    (b,) = detector("astronaut").detect(without_depth(frame))
    np.testing.assert_array_equal(a.T_camera_object.as_matrix(), b.T_camera_object.as_matrix())


def test_a_small_distant_view_without_depth_does_not_flip_silently(detector, taught):
    # About 40 px wide: perspective is hardly more than the noise.
    ambiguous = 0
    for seed in range(8):
        T = pose(0.0, 0.0, 3.2, tilt=12, axis=0.5 + seed)
        frame = frame_of((taught("astronaut"), T), seed=seed).frame
        (found,) = detector("astronaut").detect(without_depth(frame))
        _, off = pose_errors(found, T)
        if found.ambiguous:
            ambiguous += 1
            other = (found.alternative.inv() * T).rotation.magnitude()
            off = min(off, np.degrees(other))
        # Noise turns so small a view by less than 1°, a flip by twice its tilt: 24°.
        assert off < 6
    assert ambiguous >= 2


@pytest.mark.parametrize("checks", [{}, {"min_agreement": 0.0, "min_doubtful_tiles": 0.0}])
@pytest.mark.parametrize(
    ("higher", "z", "tilt"), [(1.75, 0.7, 40), (1.75, 1.6, 20), (0.57, 0.7, 60)]
)
def test_a_face_of_another_shape_than_taught_is_refused_for_its_shape(
    taught, checks, higher, z, tilt
):
    """Few matches are no excuse: a rigid view turned away would agree with some of them."""
    true = taught("astronaut")
    image = true.faces[0].image
    wrong = ObjectModel("wrong", (PlanarFace("front", image, 0.25, 0.25 * higher),))
    detector = Detector([wrong], replace(QUICK, homography=HomographyConfig(**checks)))
    report = detector.explain(frame_of((true, pose(z=z, tilt=tilt))).frame)
    assert report.detections == ()
    reason = r"no rigid view .* stretched by (\d\.\d+) \(at most 1\.6\)"
    found = re.fullmatch(reason, report.faces[0].reason)
    assert found, report.faces[0].reason
    assert float(found[1]) == pytest.approx(1.75, abs=0.1)


def test_matches_on_a_corner_of_a_face_do_not_put_the_rest_of_it_elsewhere(taught):
    """SURF finds a rocket by one cluster of keypoints; its grey values say where the rest is."""
    model = taught("rocket")
    detector = Detector([model], replace(QUICK, extractor="surf"))
    found = []
    for number in (14, 46, 62):
        rng = np.random.default_rng([11, number, 77])
        _, rendering = view(model, rng, np.radians(65))
        found += [corner_errors(d, rendering.corners[0]) for d in detector.detect(rendering.frame)]
    assert found
    assert np.max(found) < 1.0


@pytest.mark.parametrize("places", [[(-0.16, 0.0), (0.16, 0.03)],
                                    [(-0.2, -0.08), (0.18, -0.08), (0.0, 0.14)]])  # fmt: skip
def test_every_instance_of_an_object_is_found_once(detector, taught, places):
    model = taught("coffee", 0.2)
    poses = [pose(x, y, 0.75 + 0.03 * i, tilt=20, roll=i) for i, (x, y) in enumerate(places)]
    rendering = frame_of(*[(model, T) for T in poses])
    found = Detector([model]).detect(rendering.frame)
    assert [d.instance for d in found] == list(range(len(places)))
    nearest = [
        int(np.argmin([corner_errors(d, corners).mean() for corners in rendering.corners]))
        for d in found
    ]
    assert sorted(nearest) == list(range(len(places)))
    for detection, index in zip(found, nearest, strict=True):
        assert_found(detection, rendering, index, poses[index])


def test_at_most_max_instances_are_looked_for(taught):
    model = taught("coffee", 0.2)
    frame = frame_of(*[(model, pose(x, 0, 0.75, tilt=10)) for x in (-0.16, 0.16)]).frame
    assert len(Detector([model], DetectorConfig(max_instances=1)).detect(frame)) == 1


def test_two_objects_in_one_frame_are_told_apart(detector, taught):
    left, right = pose(-0.16, 0.0, 0.75, roll=2.0), pose(0.16, 0.02, 0.7)
    rendering = frame_of((taught("astronaut"), left), (taught("coffee"), right))
    found = {d.name: d for d in detector("astronaut", "coffee").detect(rendering.frame)}
    assert set(found) == {"astronaut", "coffee"}
    assert_found(found["astronaut"], rendering, 0, left)
    assert_found(found["coffee"], rendering, 1, right)


def test_an_object_in_the_library_but_not_in_the_frame_is_not_found(detector, taught):
    frame = frame_of((taught("astronaut"), pose())).frame
    assert [d.name for d in detector("astronaut", "coffee").detect(frame)] == ["astronaut"]


BOX = (0.2, 0.15, 0.12)


@pytest.fixture(scope="module")
def carton(photo):
    def crop(name, aspect):
        image = photo(name, width=400)
        return np.ascontiguousarray(image[: round(400 / aspect)])

    faces = {
        "front": crop("coffee", BOX[0] / BOX[1]),
        "right": np.ascontiguousarray(photo("astronaut", width=300)[:, :240]),
        "top": crop("chelsea", BOX[0] / BOX[2]),
    }
    return ObjectModel.box("carton", BOX, faces)


def test_two_faces_of_a_box_are_one_detection_with_one_pose(carton):
    rotation = Rotation.from_euler("y", 40, degrees=True) * Rotation.from_matrix(FRONT)
    T = RigidTransform.from_components([0.0, 0.0, 0.6], rotation)
    rendering = frame_of((carton, T))
    shown = {f.name for f, c in zip(carton.faces, rendering.corners, strict=True) if c is not None}
    (found,) = Detector([carton], QUICK).detect(rendering.frame)
    assert len(shown) == 2
    assert {face.name for face in found.faces} == shown
    off_mm, off_degrees = pose_errors(found, T)
    assert off_mm < 2
    assert off_degrees < 0.6
    by_name = {f.name: c for f, c in zip(carton.faces, rendering.corners, strict=True)}
    for face in found.faces:
        assert np.linalg.norm(face.corners - by_name[face.name], axis=1).mean() < 1.5
    assert found.inliers == sum(face.inliers for face in found.faces)
    assert found.faces[0].inliers == max(face.inliers for face in found.faces)


def test_a_face_that_only_the_other_one_leads_to_is_reported_as_found(carton):
    rotation = Rotation.from_euler("y", 40, degrees=True) * Rotation.from_matrix(FRONT)
    T = RigidTransform.from_components([0.0, 0.0, 0.6], rotation)
    frame = frame_of((carton, T)).frame
    alone = {r.face: r.figures["matches"] for r in Detector([carton], QUICK).explain(frame).faces}
    fewer, more = sorted(alone.values())[-2:]
    assert fewer < more
    homography = HomographyConfig(min_matches=int(more), max_loose_ratio=0.8)
    demanding = replace(QUICK, homography=homography)
    report = Detector([carton], demanding).explain(frame)
    (found,) = report.detections
    assert len(found.faces) == 2
    by_face = {r.face: r for r in report.faces}
    for face in found.faces:
        assert by_face[face.name].found
        assert by_face[face.name].stage == "found"
        assert by_face[face.name].reason == ""
        assert by_face[face.name].figures["inliers"] == face.inliers


def test_two_boxes_in_one_frame_are_two_detections(carton):
    turn = Rotation.from_euler("y", 35, degrees=True) * Rotation.from_matrix(FRONT)
    poses = [RigidTransform.from_components([x, 0.0, 0.8], turn) for x in (-0.17, 0.17)]
    rendering = frame_of(*[(carton, T) for T in poses])
    found = Detector([carton], QUICK).detect(rendering.frame)
    assert len(found) == 2
    for T in poses:
        off = min(pose_errors(d, T) for d in found)
        assert off[0] < 5
        assert off[1] < 1.5


def report_of(detector, frame, name):
    (report,) = [r for r in detector.explain(frame).faces if r.object == name and r.instance == 0]
    return report


def test_what_is_found_is_explained_with_its_numbers(detector, taught):
    frame = frame_of((taught("astronaut"), pose())).frame
    result = detector("astronaut").explain(frame)
    report = result.faces[0]
    assert (report.object, report.face, report.found) == ("astronaut", "front", True)
    assert report.stage == "found"
    assert report.reason == ""
    assert report.figures["features"] > report.figures["matches"] >= 10
    assert report.figures["inliers"] == result.detections[0].inliers
    assert report.figures["stretch"] == pytest.approx(1, abs=0.05)
    assert list(result.seconds) == ["extract", "match", "homography", "pose"]
    assert all(s >= 0 for s in result.seconds.values())


def test_an_object_that_is_not_there_has_too_few_matches_or_is_refused(detector, taught):
    frame = frame_of((taught("astronaut"), pose())).frame
    report = report_of(detector("astronaut", "coffee"), frame, "coffee")
    assert not report.found
    assert report.stage in ("matching", "homography", "verification")
    assert report.reason


def test_an_empty_view_has_no_matches(detector):
    plain = RGBDFrame(np.full((480, 640, 3), 128, np.uint8), None, CAMERA)
    result = detector("astronaut").explain(plain)
    assert result.detections == ()
    assert result.faces[0].stage == "matching"
    assert result.faces[0].reason == "0 matches (at least 10)"
    assert result.faces[0].figures == {"features": 0, "matches": 0}


def test_a_hidden_object_has_too_few_matches(detector, taught):
    board = Rectangle(np.full((9, 9, 3), 200, np.uint8), 0.4, 0.4, pose(z=0.6, tilt=0))
    scene = [*rectangles(taught("astronaut"), pose(tilt=20)), board]
    rendering = render(scene, CAMERA, np.random.default_rng(0))
    assert rendering.visible[0] == 0.0
    report = report_of(detector("astronaut"), rendering.frame, "astronaut")
    assert (report.found, report.stage) == (False, "matching")
    assert re.fullmatch(r"\d matches \(at least 10\)", report.reason)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"min_matches": 100_000}, r"\d+ matches \(at least 100000\)"),
        ({"min_inliers": 100_000}, r"\d+ inliers \(at least 100000\)"),
        ({"min_coverage": 0.999}, r"inliers cover \d+% of the face \(at least 100%\)"),
        ({"min_agreement": 1.01}, r"\d+% of the face looks like its reference \(at least 101%\)"),
        ({"min_side": 5000.0}, r"px short \(at least 5000 px\)"),
        ({"max_stretch": 1.0000001}, "no rigid view"),
    ],
)
def test_the_check_that_refused_is_named(taught, settings, reason):
    config = DetectorConfig(oblique=FRONTAL, homography=HomographyConfig(**settings))
    frame = frame_of((taught("astronaut"), pose(tilt=20))).frame
    result = Detector([taught("astronaut")], config).explain(frame)
    assert result.detections == ()
    (report,) = result.faces
    assert re.search(reason, report.reason), report.reason


def test_an_empty_library_is_refused(tmp_path):
    with pytest.raises(LibraryError, match="library is empty: teach an object first"):
        Detector([])
    with pytest.raises(LibraryError, match="library is empty"):
        Detector(ObjectLibrary(tmp_path / "objects"))


def plain_object(name="plain"):
    return ObjectModel.from_image(name, np.full((80, 100, 3), 90, np.uint8), 0.2)


def test_a_library_without_any_feature_is_refused():
    with pytest.raises(LibraryError, match="no object of the library has features"):
        Detector([plain_object()])


@pytest.mark.parametrize("extractor", ["sift", "orb"])
def test_an_object_without_features_does_not_disturb_the_others(taught, extractor):
    T = pose(tilt=15)
    rendering = frame_of((taught("astronaut"), T))
    models = [plain_object("a"), taught("astronaut"), plain_object("b")]
    detector = Detector(models, DetectorConfig(extractor=extractor))
    (found,) = detector.detect(rendering.frame)
    assert_found(found, rendering, 0, T, pixels=1.5, mm=1.5, degrees=0.5)
    report = report_of(detector, rendering.frame, "b")
    assert (report.stage, report.reason) == ("features", "the reference image has no features")


def test_two_objects_of_one_name_are_refused(taught):
    with pytest.raises(InvalidInputError, match="two objects are called 'coffee'"):
        Detector([taught("coffee"), taught("coffee", 0.3)])


@pytest.mark.parametrize(
    "wrong",
    [
        {"extractor": "surfboard"},
        {"matcher": "annoy"},
        {"pose": "guess"},
        {"matcher": "flann-lsh"},
        {"extractor": "orb", "matcher": "flann-kdtree"},
    ],
)
def test_settings_that_do_not_exist_are_refused(taught, wrong):
    name = next(iter(wrong.values()))
    with pytest.raises(InvalidInputError, match=wrong.get("matcher", name)):
        Detector([taught("coffee")], DetectorConfig(oblique=FRONTAL, **wrong))


@pytest.mark.parametrize("wrong", [{"reference_side": 31}, {"neighbours": 1}, {"max_instances": 0}])
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(InvalidInputError, match="reference_side ≥ 32, neighbours ≥ 2"):
        DetectorConfig(**wrong)


def test_features_from_the_cache_find_the_same(taught, tmp_path):
    library = ObjectLibrary(tmp_path / "objects")
    library.add(taught("astronaut"))
    library.save()
    frame = frame_of((taught("astronaut"), pose())).frame
    config = DetectorConfig(oblique=ObliqueConfig(tilts=(1.0, 2.0)))
    first, second = (Detector(library, config).detect(frame) for _ in range(2))
    assert list(library.cache_dir("astronaut").iterdir())
    np.testing.assert_array_equal(first[0].corners, second[0].corners)


def as_numbers(detections):
    return [
        (d.name, d.instance, d.corners.tolist(), d.T_camera_object.as_matrix().tolist())
        for d in detections
    ]


def test_the_same_frame_gives_the_same_answer(detector, taught):
    frame = frame_of(
        (taught("astronaut"), pose(tilt=60)), (taught("coffee"), pose(-0.2, 0.1, 0.9))
    ).frame
    once = detector("astronaut", "coffee")
    again = Detector([taught("astronaut"), taught("coffee")], once.config)
    expected = as_numbers(once.detect(frame))
    assert len(expected) == 2
    assert as_numbers(once.detect(frame)) == expected
    assert as_numbers(again.detect(frame)) == expected


def test_nothing_is_found_among_other_things(detector):
    searching = detector(*OBJECTS)
    rng = np.random.default_rng(11)
    for number in range(8):
        assert searching.detect(distractor_scene(rng, str(number))) == []


@pytest.mark.parametrize("shape", [(1, 1), (5, 7), (40, 60)])
@pytest.mark.parametrize("extractor", ["sift", "akaze", "brisk", "orb"])
def test_a_tiny_image_has_no_objects(detector, shape, extractor):
    height, width = shape
    camera = PinholeCamera(width, height, 50.0, 50.0, width / 2, height / 2)
    noise = np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)
    frame = RGBDFrame(noise, np.full(shape, 0.7, np.float32), camera)
    assert detector("coffee", extractor=extractor, oblique=FRONTAL).detect(frame) == []


@pytest.fixture(scope="module")
def first_looks(taught):
    """Detectors of three photographs that compare with so many descriptors at first."""
    names = ("coffee", "astronaut", "retina")

    @cache
    def make(first_look):
        config = replace(QUICK, first_look=first_look)
        return Detector([taught(name) for name in names], config)

    return make


def test_what_a_first_look_misses_a_closer_one_finds(first_looks, taught):
    scenes = [frame_of((taught("coffee"), pose(tilt=62, axis=i)), seed=i) for i in range(4)]
    # The first block of bright keypoints and the first of dark ones.
    hasty, thorough = first_looks(32), first_looks(0)
    for scene in scenes:
        truth = scene.corners[0]
        (found,), (expected,) = (d.detect(scene.frame) for d in (hasty, thorough))
        for detection in (found, expected):
            assert detection.name == "coffee"
            assert corner_errors(detection, truth).mean() < 1.0
    # A first look alone has few inliers, if it finds the face at all.
    closer = [d.inliers for scene in scenes for d in hasty.detect(scene.frame)]
    first = [sum(d.inliers for d in hasty.detect(s.frame, closely=False)) for s in scenes]
    assert sum(first) < 0.7 * sum(closer)


@pytest.mark.parametrize(("most", "names"), [(0, set()), (1, {"coffee"}), (2, {"coffee"})])
def test_a_closer_look_is_at_the_faces_with_most_matches(first_looks, taught, most, names):
    """With one block of each sign at first, all three faces stay open; one of them is there."""
    objects = [taught(name) for name in ("retina", "coffee", "astronaut")]
    prepared = [face for o in objects for face in first_looks(0).prepared(o)]
    detector = Detector.of(prepared, replace(QUICK, first_look=24, closer_look=most))
    scene = frame_of((taught("coffee"), pose(tilt=66)))
    report = detector.explain(scene.frame)
    assert {d.name for d in report.detections} == names
    assert {r.face for r in report.faces}  # Also those without a closer look have a fate.


@pytest.mark.parametrize(("tilt", "first"), [(30, 1), (50, 32)])
def test_few_inliers_are_enough_where_grey_values_leave_no_doubt(
    first_looks, taught, monkeypatch, tilt, first
):
    T = pose(tilt=tilt)
    rendering = frame_of((taught("coffee"), T))
    # Of the first one only its block is looked at, 32 of its sign; of 32 a block of each sign.
    hasty = Detector.of(first_looks(0).prepared(taught("coffee")), replace(QUICK, first_look=first))

    def closer(*_):
        pytest.fail("the face was found for sure")

    monkeypatch.setattr(NativeIndex, "look_closer", closer)
    (found,) = hasty.detect(rendering.frame)
    assert found.inliers < 12
    assert_found(found, rendering, 0, T)


def test_a_first_look_at_most_descriptors_changes_no_detection(first_looks, taught):
    places = {"coffee": pose(-0.17, -0.02, 0.8), "retina": pose(0.16, 0.02, 0.8, tilt=15)}
    rendering = frame_of(*[(taught(name), T) for name, T in places.items()])
    for detector in (first_looks(0), first_looks(1000), first_looks(64)):
        found = {d.name: d for d in detector.detect(rendering.frame)}
        assert found.keys() == places.keys()
        for index, (name, T) in enumerate(places.items()):
            assert_found(found[name], rendering, index, T)


def test_aligned_grey_values_make_corners_better_than_matches_alone(detector, taught):
    matched, aligned = [], []
    corners = reference_corners(*taught("astronaut").faces[0].image.shape[1::-1])
    for seed in range(8):
        T = pose(tilt=10 + 7 * seed, axis=seed)
        rendering = frame_of((taught("astronaut"), T), seed=seed)
        (found,) = detector("astronaut").detect(rendering.frame)
        (face,) = found.faces
        assert face.is_aligned
        for homography, errors in ((face.matched_homography, matched), (face.homography, aligned)):
            off = apply_homography(homography, corners) - rendering.corners[0]
            errors.append(np.linalg.norm(off, axis=1).mean())
    assert np.median(aligned) < 0.6 * np.median(matched)
    assert np.max(aligned) < 0.5


def test_only_some_objects_are_looked_for_where_asked(taught):
    objects = [taught(name) for name in ("coffee", "astronaut")]
    detector = Detector(objects, QUICK)
    scene = frame_of((taught("coffee"), pose(tilt=20)))
    assert [d.name for d in detector.detect(scene.frame, among=["coffee"])] == ["coffee"]
    assert detector.detect(scene.frame, among=["astronaut"]) == []
    assert detector.detect(scene.frame, among=[]) == []
    with pytest.raises(UnknownObjectError, match="no object 'unicorn'; there are"):
        detector.detect(scene.frame, among=["unicorn"])
