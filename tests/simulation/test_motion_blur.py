"""Blur against the mean of many sharp renderings."""

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.simulation import Rectangle, render, render_moving

PLAIN = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
# Half the size: brute force is slow.
SMALL = PinholeCamera(320, 240, 262.0, 262.0, 159.5, 119.5)
LENS = PinholeCamera(320, 240, 262.0, 262.0, 159.5, 119.5, (0.12, -0.25, 0.001, -0.002, 0.08))
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
TIME, EXPOSURE = 2.0, 0.02


def moving(texture, at, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), width=0.2):
    """A rectangle that is at a place at `TIME`, with a speed [m/s] and a turn [rad/s]."""
    height = width * texture.shape[0] / texture.shape[1]

    def now(t):
        dt = t - TIME
        turn = Rotation.from_rotvec(np.array(spin) * dt)
        position = np.array(at) + np.array(velocity) * dt
        return Rectangle(
            texture, width, height, RigidTransform.from_components(position, turn * FRONTAL)
        )

    return now


def seed():
    return np.random.default_rng(0)


def blurred(things, exposure=EXPOSURE, camera=PLAIN, **settings):
    return render_moving(things, TIME, exposure, camera, seed(), **settings)


def mean_of_sharp(things, camera, background, count=24):
    """The frame without noise, by brute force."""
    total = np.zeros((camera.height, camera.width, 3))
    for k in range(count):
        t = TIME + EXPOSURE * ((k + 0.5) / count - 0.5)
        now = [thing(t) for thing in things]
        sharp = render(now, camera, seed(), color_noise=0.0, background=background)
        total += sharp.frame.color
    return total / count


@pytest.mark.parametrize("camera", [SMALL, LENS], ids=["plain", "lens"])
def test_a_frame_is_the_mean_of_the_sharp_ones_during_its_exposure(photo, camera):
    # One passes before another, one turns and comes nearer, one enters the image, one is still.
    things = [
        moving(photo("coffee", 200), (-0.1, -0.1, 0.8), (0.3, 0.1, 0.0)),
        moving(photo("astronaut", 100), (0.0, -0.1, 0.6), (-0.6, 0.2, 0.0), width=0.1),
        moving(photo("chelsea", 200), (0.2, 0.18, 0.7), (0.1, 0.0, -1.0), (1.0, 3.0, 5.0)),
        moving(photo("coffee", 200), (-0.46, 0.2, 0.7), (0.8, 0.0, 0.0)),
        moving(photo("chelsea", 200), (0.25, -0.15, 0.7)),
    ]
    background = photo("immunohistochemistry")
    shot = blurred(things, camera=camera, color_noise=0.0, background=background)
    mean = mean_of_sharp(things, camera, background)
    error = np.abs(shot.frame.color - mean)
    assert error.mean() < 0.25
    assert np.percentile(error, 99.9) < 6.0
    # Sharp frames would not do: the motion is some pixels.
    sharp = blurred(things, exposure=0.0, camera=camera, color_noise=0.0, background=background)
    assert np.abs(sharp.frame.color - mean).mean() > 4 * error.mean()
    assert np.percentile(np.abs(sharp.frame.color - mean), 99.9) > 40.0


def test_a_step_is_smeared_over_the_way_that_it_moves():
    white = np.full((40, 40, 3), 255, np.uint8)
    # 0.8 m/s at 0.7 m for 20 ms is 12 pixels.
    thing = moving(white, (0.0, 0.0, 0.7), (0.8, 0.0, 0.0))
    row = blurred([thing], color_noise=0.0).frame.color[240, :, 0].astype(float)
    edge = PLAIN.project([[0.1, 0.0, 0.7]])[0, 0]
    columns = np.arange(640)
    ramp = 128 + 127 * np.clip(0.5 - (columns - edge) / 12.0, 0, 1)
    near = np.abs(columns - edge) < 20
    # Sub-exposures lie up to a pixel apart.
    assert np.abs(row - ramp)[near].max() < 127 / 12


def test_what_is_still_is_rendered_as_ever(photo):
    things = [moving(photo("coffee", 200), (0.0, 0.0, 0.7), width=0.3)]
    shot = blurred(things)
    still = render([things[0](TIME)], PLAIN, seed())
    assert np.array_equal(shot.frame.color, still.frame.color)
    assert np.array_equal(shot.frame.depth, still.frame.depth)
    assert shot.visible == still.visible


def test_without_exposure_there_is_no_blur(photo):
    thing = moving(photo("coffee", 200), (0.0, 0.0, 0.7), (1.0, 0.0, 0.0))
    shot = blurred([thing], exposure=0.0)
    assert np.array_equal(shot.frame.color, render([thing(TIME)], PLAIN, seed()).frame.color)


def test_depth_and_truth_are_of_the_middle_of_the_exposure(photo):
    things = [
        moving(photo("coffee", 200), (0.0, 0.0, 0.8), (0.5, 0.5, -1.0)),
        moving(photo("chelsea", 100), (0.03, 0.0, 0.6), (-0.5, 0.0, 0.0), width=0.08),
    ]
    shot = blurred(things)
    middle = render([thing(TIME) for thing in things], PLAIN, seed())
    assert np.array_equal(shot.true_depth, middle.true_depth)
    assert np.array_equal(shot.frame.depth, middle.frame.depth)
    assert shot.visible == middle.visible
    assert np.array_equal(shot.corners, middle.corners)
    assert shot.frame.timestamp == TIME


def test_noise_is_added_once():
    gray = np.full((40, 40, 3), 100, np.uint8)
    thing = moving(gray, (0.0, 0.0, 0.7), (1.0, 0.0, 0.0), width=0.4)
    inside = blurred([thing]).frame.color[150:330, 230:410].astype(float)
    # A mean of fifteen noisy frames would have less than one grey level.
    assert inside.std() == pytest.approx(3.0, rel=0.05)


def test_what_turns_away_or_is_outside_leaves_no_trace(photo):
    picture = photo("coffee", 200)
    away = moving(picture, (0.0, 0.0, 0.7))

    def back(t):
        r = away(t)
        flipped = RigidTransform.from_rotation(Rotation.from_euler("y", 180, degrees=True))
        return Rectangle(r.texture, r.width, r.height, r.T_camera_rectangle * flipped)

    shot = blurred([back, moving(picture, (2.0, 0.0, 0.7), (1.0, 0.0, 0.0))], color_noise=0.0)
    assert np.all(shot.frame.color == 128)
    assert shot.corners[0] is None
    assert shot.visible == (0.0, 0.0)


@pytest.mark.parametrize("exposure", [-0.01, np.nan, np.inf])
def test_an_exposure_is_a_length_of_time(exposure, photo):
    with pytest.raises(InvalidInputError, match="exposure must be"):
        blurred([moving(photo("coffee", 200), (0.0, 0.0, 0.7))], exposure=exposure)
