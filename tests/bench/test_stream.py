"""Rendered streams: what they say is true is what they show."""

from dataclasses import replace
from itertools import combinations, islice

import cv2
import numpy as np
import pytest

from planegrasp.bench.scenes import CAMERA, corner_error
from planegrasp.bench.stream import StreamSettings, absences, models, stream
from planegrasp.bench.stream_stage import stage
from planegrasp.detector import Detector
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import Rotation

COUNTS = [1, 3, 10]
TREMOR_SPEED = 2 * np.pi * 12 * 0.001
# Coarse in time, so that much happens in few frames.
BUSY = StreamSettings(rate=4, seconds=12.0, exposure=0.0, leaving=True)


def corners_of(model, T_camera_object):
    return CAMERA.project(T_camera_object.apply(model.faces[0].object_corners))


def likeness(frame, model, corners):
    """Correlation of a face's photograph with what the frame shows between these corners."""
    face = model.faces[0]
    size = (60, round(60 * face.height / face.width))
    outline = np.array([[0, 0], [size[0], 0], size, [0, size[1]]], np.float32) - 0.5
    H = cv2.getPerspectiveTransform(outline, corners.astype(np.float32))
    seen = cv2.warpPerspective(frame.color, H, size, flags=cv2.INTER_AREA | cv2.WARP_INVERSE_MAP)
    printed = cv2.resize(face.image, size, interpolation=cv2.INTER_AREA)
    return np.corrcoef(seen.ravel(), printed.ravel())[0, 1]


def scene(config):
    return stage(config, models(config))


@pytest.mark.parametrize("objects", COUNTS)
def test_the_image_shows_each_object_where_it_truly_is(objects):
    config = StreamSettings(rate=1, seconds=3.0, objects=objects, exposure=0.01, seed=1)
    taught = models(config)
    assert len({model.name for model in taught}) == objects
    for shot in stream(config):
        assert set(shot.truth) == set(shot.visible) == {model.name for model in taught}
        for model in taught:
            corners = corners_of(model, shot.truth[model.name])
            true = likeness(shot.frame, model, corners)
            assert true > 0.8
            for shift in ((3, 0), (-3, 0), (0, 3), (0, -3)):
                assert likeness(shot.frame, model, corners + shift) < true


def test_blur_is_about_the_truth():
    """An object on its way out of the image: blurred along its way, not displaced."""
    config = replace(BUSY, rate=10, exposure=1 / 30)
    leaves = next(a for a in absences(config) if not a.behind_board)
    chosen = (leaves.leaves + leaves.hidden) // 2 - 2
    shot = next(islice(stream(config), chosen, None))
    sharp = next(islice(stream(replace(config, exposure=0.0)), chosen, None))
    model = models(config)[0]
    corners = corners_of(model, shot.truth[model.name])
    assert np.allclose(shot.truth[model.name].as_matrix(), sharp.truth[model.name].as_matrix())
    # Twice differentiated, little is left of a blurred image.
    sharpness = [cv2.Laplacian(s.frame.color, cv2.CV_32F).std() for s in (shot, sharp)]
    assert sharpness[0] < sharpness[1]
    true = likeness(shot.frame, model, corners)
    for shift in ((4, 4), (-4, -4), (4, -4), (-4, 4)):
        assert likeness(shot.frame, model, corners + shift) < true


@pytest.mark.parametrize("objects", COUNTS)
def test_a_still_stream_is_still(objects):
    config = StreamSettings(rate=10, seconds=0.4, objects=objects, motion="still")
    shots = list(stream(config))
    assert len(shots) == config.frames == 4
    first = shots[0]
    for shot in shots[1:]:
        for name, T in shot.truth.items():
            assert np.array_equal(T.as_matrix(), first.truth[name].as_matrix())
        difference = shot.frame.color.astype(float) - first.frame.color
        inner = (first.frame.color > 15) & (first.frame.color < 240)
        # The noise of two images, and nothing else.
        assert difference[inner].std() == pytest.approx(3.0 * np.sqrt(2), rel=0.03)
        assert np.abs(difference).max() < 35
    assert [shot.frame.timestamp for shot in shots] == pytest.approx([0.0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize("objects", COUNTS)
@pytest.mark.parametrize("seed", [0, 1])
def test_hands_move_objects_within_their_bounds(objects, seed):
    config = StreamSettings(objects=objects, seed=seed, speed=0.15)
    step = 1 / 240
    times = np.arange(0.0, 3.0, step)
    for held in scene(config).held[:2]:
        poses = [held.pose(t) for t in times]
        way = np.diff([T.translation for T in poses], axis=0)
        speed = np.linalg.norm(way, axis=1) / step
        assert speed.max() < config.speed + TREMOR_SPEED
        # Steps of a twentieth of a second show drift, hardly tremor.
        drift = np.linalg.norm(np.diff([T.translation for T in poses[::12]], axis=0), axis=1) / 0.05
        assert np.median(drift) > 0.01
        rotations = Rotation.concatenate([T.rotation for T in poses])
        turns = (rotations[:-1].inv() * rotations[1:]).magnitude()
        # Waves of at most 1 Hz.
        assert np.radians(5) < turns.max() / step < 2 * np.pi * config.turn
        angles = (rotations[0].inv() * rotations).magnitude()
        assert angles.max() < config.turn + 1e-9


@pytest.mark.parametrize("objects", COUNTS)
@pytest.mark.parametrize("motion", ["still", "handheld"])
def test_objects_leave_and_come_back_when_it_is_said(objects, motion):
    seconds = 24.0 if objects == 1 else 12.0
    config = replace(BUSY, objects=objects, motion=motion, seconds=seconds, seed=2)
    away = absences(config)
    assert len(away) >= objects
    assert {a.behind_board for a in away} == {True, False}
    assert list(away) == sorted(away, key=lambda a: (a.appears, a.name))
    shots = list(stream(config))
    in_place = {name: np.ones(len(shots), bool) for name in shots[0].truth}
    for a in away:
        assert 0 <= a.leaves < a.hidden <= a.appears < a.returned < len(shots)
        in_place[a.name][a.leaves + 1 : a.returned] = False
        assert all(shots[i].visible[a.name] == 0.0 for i in range(a.hidden, a.appears))
        before, after = shots[a.leaves].truth[a.name], shots[a.returned].truth[a.name]
        assert (before.rotation.inv() * after.rotation).magnitude() > 0.01
    for name, expected in in_place.items():
        seen = np.array([shot.visible[name] for shot in shots])
        assert np.all(seen[expected] > 0.97)
        assert np.any(seen[~expected] < 0.5)


@pytest.mark.parametrize("objects", COUNTS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_each_keeps_to_its_own_part_of_the_image(objects, seed):
    config = replace(BUSY, objects=objects, seed=seed, seconds=20.0, turn=np.radians(30))
    shown = scene(config)
    boards = [(held.model.name, sheet) for held in shown.held for sheet in held.life.boards]
    for t in np.arange(0.0, config.seconds, 0.21):
        outlines = [(held.model.name, corners_of(held.model, held.pose(t))) for held in shown.held]
        nearest = min(held.rectangle(t).corners[:, 2].min() for held in shown.held)
        things = shown.things(t, 0.0)[objects:]
        active = [name for name, sheet in boards if sheet.start <= t <= sheet.end]
        assert len(things) == len(active)
        for name, thing in zip(active, things, strict=True):
            corners = thing(t).corners
            assert corners[:, 2].max() < nearest
            outlines.append((name, CAMERA.project(corners)))
        for (a, first), (b, second) in combinations(outlines, 2):
            if a != b:
                hulls = (cv2.convexHull(o.astype(np.float32)) for o in (first, second))
                assert cv2.intersectConvexConvex(*hulls)[0] == 0.0


@pytest.mark.parametrize("objects", COUNTS)
def test_a_hand_hides_a_part_of_objects(objects):
    config = replace(BUSY, objects=objects, leaving=False, occlusion=True, seconds=10.0)
    shots = list(stream(config))
    seen = np.array([[shot.visible[name] for name in shot.visible] for shot in shots])
    assert seen.min() > 0.15
    assert np.count_nonzero(seen < 0.85) >= 3
    assert np.count_nonzero(seen > 0.97) > 0.4 * seen.size
    # Without it, nothing hides anything.
    clear = list(stream(replace(config, occlusion=False, seconds=2.0)))
    assert min(share for shot in clear for share in shot.visible.values()) > 0.97


def test_the_same_seed_gives_the_same_stream():
    config = replace(BUSY, objects=3, occlusion=True, exposure=0.02, seconds=2.0, seed=5)
    twice = zip(stream(config), stream(config), strict=True)
    for a, b in twice:
        assert np.array_equal(a.frame.color, b.frame.color)
        assert np.array_equal(a.frame.depth, b.frame.depth)
        assert a.visible == b.visible
    other = next(stream(replace(config, seed=6)))
    assert not np.array_equal(other.frame.color, next(stream(config)).frame.color)


def test_the_rate_changes_only_how_often_one_looks():
    slow, fast = (replace(BUSY, rate=rate, seconds=30.0, seed=3) for rate in (30, 60))
    for a, b in zip(absences(slow), absences(fast), strict=True):
        assert abs(2 * a.appears - b.appears) <= 1
    pairs = zip(scene(slow).held, scene(fast).held, strict=True)
    for a, b in pairs:
        assert np.array_equal(a.pose(7.3).as_matrix(), b.pose(7.3).as_matrix())


def test_the_detector_finds_what_is_taught():
    config = StreamSettings(objects=3, rate=1, seconds=1.0)
    taught = models(config)
    shot = next(stream(config))
    found = {d.name: d for d in Detector(taught).detect(shot.frame)}
    for model in taught:
        corners = corners_of(model, shot.truth[model.name])
        assert corner_error(found[model.name].corners, corners) < 2.0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"rate": 0}, "at least 1 frame a second, got 0"),
        ({"seconds": 0.01}, "at least one frame, got 0.01 s at 30 Hz"),
        ({"seconds": np.inf}, "at least one frame, got inf"),
        ({"objects": 2}, "1, 3 or 10 objects, got 2"),
        ({"exposure": -0.01}, "an exposure is from 0 s"),
        ({"rate": 60, "exposure": 0.02}, "at 60 Hz 0.01667 s, got 0.02"),
        ({"motion": "wild"}, "motion is one of still, handheld, got 'wild'"),
        ({"speed": -0.1}, "speed must be ≥ 0 m/s, got -0.1"),
        ({"turn": 1.0}, "turns by 0 to 0.52 rad, got 1.0"),
    ],
)
def test_a_configuration_says_what_is_wrong(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        StreamSettings(**wrong)
