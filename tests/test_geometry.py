import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planegrasp.errors import CameraError, InvalidInputError
from planegrasp.geometry import (
    PinholeCamera,
    RigidTransform,
    Rotation,
    euler_from_rotation,
    rigid_transform,
    rotation_angle,
    rotation_from_euler,
    transform_from_quaternion,
)

PLAIN = PinholeCamera(640, 480, 525.0, 520.0, 319.5, 239.5)
# About what the factory calibration of a Kinect v1 or a RealSense D415 says.
LENS = PinholeCamera(640, 480, 525.0, 520.0, 319.5, 239.5, (0.12, -0.25, 0.001, -0.002, 0.08))

distortions = st.tuples(
    st.floats(-0.15, 0.15),
    st.floats(-0.1, 0.1),
    st.floats(-0.003, 0.003),
    st.floats(-0.003, 0.003),
    st.floats(-0.05, 0.05),
)
pixels_in_image = st.lists(
    st.tuples(st.floats(0, 639), st.floats(0, 479)), min_size=1, max_size=20
).map(np.array)
points_in_view = st.lists(
    st.tuples(st.floats(-0.6, 0.6), st.floats(-0.45, 0.45), st.floats(0.3, 5.0)),
    min_size=1,
    max_size=20,
).map(lambda rows: np.array([(x * z, y * z, z) for x, y, z in rows]))
rotations = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


def reaches_the_corners(distortion):
    """Whether the lens model has a ray for every pixel: its radius grows until beyond them."""
    k1, k2, _, _, k3 = distortion
    r = np.linspace(0.0, 1.3, 400)
    distorted = r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6)
    growing = np.cumprod(np.diff(distorted) > 0.1 * np.diff(r)).astype(bool)
    # The farthest corner is 0.77 from the optical axis, tangential terms add up to 0.01.
    return distorted[1:][growing].max() > 0.8


@st.composite
def lenses(draw):
    return PinholeCamera(
        640, 480, 525.0, 520.0, 319.5, 239.5, draw(distortions.filter(reaches_the_corners))
    )


@given(camera=lenses(), points=points_in_view)
def test_project_agrees_with_opencv(camera, points):
    expected, _ = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), camera.matrix, camera.coefficients
    )
    np.testing.assert_allclose(camera.project(points), expected.reshape(-1, 2), atol=1e-9)


@given(camera=lenses(), pixels=pixels_in_image, depth=st.floats(0.1, 10))
def test_a_point_on_a_ray_projects_to_its_pixel(camera, pixels, depth):
    np.testing.assert_allclose(camera.project(camera.rays(pixels) * depth), pixels, atol=1e-5)


@given(camera=lenses(), pixels=pixels_in_image)
def test_undistort_and_distort_are_inverse(camera, pixels):
    np.testing.assert_allclose(camera.distort(camera.undistort(pixels)), pixels, atol=1e-5)


@given(camera=lenses(), pixels=pixels_in_image)
def test_undistort_agrees_with_opencv(camera, pixels):
    # Many plain fixed-point iterations of OpenCV as the second implementation.
    criteria = (cv2.TERM_CRITERIA_COUNT, 200, 0.0)
    expected = cv2.undistortPoints(
        pixels.reshape(-1, 1, 2), camera.matrix, camera.coefficients, P=camera.matrix,
        R=np.eye(3), criteria=criteria,
    )  # fmt: skip
    np.testing.assert_allclose(camera.undistort(pixels), expected.reshape(-1, 2), atol=1e-5)


def test_the_lens_of_these_tests_moves_points_far_more_than_their_tolerance():
    corners = np.array([[0.0, 0.0], [639.0, 479.0]])
    assert np.linalg.norm(LENS.undistort(corners) - corners, axis=1).min() > 0.5


def test_without_distortion_points_stay_exactly_where_they_are():
    pixels = np.array([[0.0, 0.0], [12.25, 400.5]])
    np.testing.assert_array_equal(PLAIN.undistort(pixels), pixels)
    np.testing.assert_array_equal(PLAIN.distort(pixels), pixels)
    zeros = PinholeCamera(640, 480, 525.0, 520.0, 319.5, 239.5, (0.0, 0.0))
    assert not zeros.is_distorted
    assert LENS.is_distorted


def test_rays_have_unit_depth_and_the_principal_point_looks_straight_ahead():
    rays = PLAIN.rays([[319.5, 239.5], [319.5 + 525.0, 239.5], [319.5, 239.5 - 520.0]])
    np.testing.assert_allclose(rays, [[0, 0, 1], [1, 0, 1], [0, -1, 1]])  # y points down


@pytest.mark.parametrize("camera", [PLAIN, LENS])
def test_no_points_give_no_points(camera):
    none = np.zeros((0, 2))
    assert camera.undistort(none).shape == (0, 2)
    assert camera.distort(none).shape == (0, 2)
    assert camera.rays(none).shape == (0, 3)
    assert camera.project(np.zeros((0, 3))).shape == (0, 2)


@pytest.mark.parametrize("z", [0.0, -1.0])
def test_points_that_are_not_in_front_are_refused_with_their_depth(z):
    with pytest.raises(InvalidInputError, match=rf"\(z > 0\) project, got z = {z:g}$"):
        PLAIN.project([[0.0, 0.0, 1.0], [0.1, 0.1, z]])


@pytest.mark.parametrize("points", [[1.0, 2.0], [[1.0, 2.0, 3.0]], [[[1.0, 2.0]]]])
def test_pixels_of_another_shape_are_refused(points):
    with pytest.raises(InvalidInputError, match="expected an N×2 array"):
        PLAIN.undistort(points)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"width": 0}, "image size must be positive, got 0×480"),
        ({"height": -480}, "image size must be positive, got 640×-480"),
        ({"fx": 0.0}, "focal lengths must be > 0 px, got fx=0.0"),
        ({"fy": -525.0}, "focal lengths must be > 0 px.*fy=-525.0"),
        ({"fx": math.nan}, "camera parameters must be finite"),
        ({"cy": math.inf}, "camera parameters must be finite"),
        ({"distortion": (0.1, math.nan)}, "camera parameters must be finite"),
        ({"cx": -641.0}, "principal point .* lies far outside of the 640×480 image"),
        ({"cy": 961.0}, "principal point .* lies far outside of the 640×480 image"),
        ({"distortion": (0.1,) * 8}, r"up to 5 coefficients \(k1, k2, p1, p2, k3\), got 8"),
    ],
)
def test_impossible_cameras_are_refused_with_the_value(wrong, message):
    right = {"width": 640, "height": 480, "fx": 525.0, "fy": 525.0, "cx": 319.5, "cy": 239.5}
    with pytest.raises(CameraError, match=message):
        PinholeCamera(**(right | wrong))


def test_missing_coefficients_are_zero():
    camera = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (0.1, 0.2))
    np.testing.assert_array_equal(camera.coefficients, [0.1, 0.2, 0, 0, 0])


@given(quaternion=rotations)
def test_euler_angles_give_the_rotation_back(quaternion):
    R = Rotation.from_quat(quaternion)
    again = rotation_from_euler(*euler_from_rotation(R))
    np.testing.assert_allclose(again.as_matrix(), R.as_matrix(), atol=1e-7)


@given(
    phi=st.floats(-math.pi, math.pi),
    theta=st.floats(-1.57, 1.57),
    psi=st.floats(-math.pi, math.pi),
)
def test_euler_angles_agree_with_scipy(phi, theta, psi):
    R = rotation_from_euler(phi, theta, psi)
    yaw, pitch, roll = R.as_euler("ZYX")
    found = np.array(euler_from_rotation(R))
    difference = found - (roll, pitch, yaw)
    # -π and π are the same angle.
    np.testing.assert_allclose(np.angle(np.exp(1j * difference)), 0, atol=1e-9)


def test_the_rotation_is_that_of_the_papers_equation_6():
    phi, theta, psi = 0.3, -0.4, 2.9
    c, s = math.cos, math.sin
    Rx = [[1, 0, 0], [0, c(phi), -s(phi)], [0, s(phi), c(phi)]]
    Ry = [[c(theta), 0, s(theta)], [0, 1, 0], [-s(theta), 0, c(theta)]]
    Rz = [[c(psi), -s(psi), 0], [s(psi), c(psi), 0], [0, 0, 1]]
    expected = np.array(Rz) @ Ry @ Rx
    np.testing.assert_allclose(rotation_from_euler(phi, theta, psi).as_matrix(), expected)


@pytest.mark.parametrize("phi", [-3.0, -1.0, 0.5, 2.0, 3.0])
def test_the_quadrant_is_kept_where_an_arctangent_of_the_ratio_loses_it(phi):
    assert euler_from_rotation(rotation_from_euler(phi, 0.2, -phi)) == pytest.approx(
        (phi, 0.2, -phi)
    )


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("phi", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("psi", [0.0, -1.2, 3.0])
def test_at_90_degrees_roll_is_zero_and_yaw_has_the_whole_rotation(sign, phi, psi):
    R = rotation_from_euler(phi, sign * math.pi / 2, psi)
    found_phi, found_theta, found_psi = euler_from_rotation(R)
    assert found_phi == 0.0
    assert found_theta == pytest.approx(sign * math.pi / 2)
    difference = found_psi - (psi - sign * phi)
    assert math.remainder(difference, 2 * math.pi) == pytest.approx(0, abs=1e-9)
    again = rotation_from_euler(found_phi, found_theta, found_psi)
    np.testing.assert_allclose(again.as_matrix(), R.as_matrix(), atol=1e-12)


@given(
    away=st.floats(-1e-6, 1e-6),
    phi=st.floats(-3, 3),
    psi=st.floats(-3, 3),
    sign=st.sampled_from([1, -1]),
)
def test_next_to_90_degrees_the_rotation_still_comes_back(away, phi, psi, sign):
    R = rotation_from_euler(phi, sign * math.pi / 2 + away, psi)
    again = rotation_from_euler(*euler_from_rotation(R))
    np.testing.assert_allclose(again.as_matrix(), R.as_matrix(), atol=1e-7)


@given(angle=st.floats(0, math.pi), quaternion=rotations)
def test_rotation_angle_is_the_angle_between_the_two(angle, quaternion):
    a = Rotation.from_quat(quaternion)
    b = a * Rotation.from_rotvec([0, angle * 0.6, angle * 0.8])
    assert rotation_angle(a, b) == pytest.approx(angle, abs=1e-7)
    assert rotation_angle(b, a) == pytest.approx(angle, abs=1e-7)


@given(quaternion=rotations, translation=st.tuples(*[st.floats(-10, 10)] * 3))
def test_a_rigid_matrix_becomes_the_same_transform(quaternion, translation):
    T = RigidTransform.from_components(translation, Rotation.from_quat(quaternion))
    found = rigid_transform(T.as_matrix()).as_matrix()
    np.testing.assert_allclose(found, T.as_matrix(), atol=1e-12)


def rotated(first_row=(1.0, 0.0, 0.0, 0.0), last_row=(0.0, 0.0, 0.0, 1.0)):
    matrix = np.eye(4)
    matrix[0], matrix[3] = first_row, last_row
    return matrix


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), r"4×4 matrix, got shape \(3, 3\)"),
        (np.full((4, 4), np.nan), "finite"),
        (rotated((1.0, 0.0, 0.0, np.inf)), "finite"),
        (rotated(last_row=(0.0, 0.0, 0.1, 1.0)), r"last row must be \(0, 0, 0, 1\)"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "deviates from the identity by 3"),
        (rotated((1.0, 0.01, 0.0, 0.0)), "deviates from the identity by 0.01"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "mirrors"),
        (np.eye(4).T[[3, 1, 2, 0]], "last row"),
    ],
)
def test_what_is_not_rigid_is_refused_with_the_reason(matrix, message):
    with pytest.raises(InvalidInputError, match=message):
        rigid_transform(matrix)


def test_rounding_of_a_written_matrix_is_accepted():
    T = RigidTransform.from_components([0.1, 0.2, 0.3], Rotation.from_euler("xyz", [0.3, 1, 2]))
    rounded = np.round(T.as_matrix(), 5)
    found = rigid_transform(rounded).as_matrix()
    np.testing.assert_allclose(found, rounded, atol=2e-5)
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-12)


@given(quaternion=rotations, translation=st.tuples(*[st.floats(-10, 10)] * 3))
def test_a_quaternion_becomes_its_rotation(quaternion, translation):
    rotation = Rotation.from_quat(quaternion)
    T = transform_from_quaternion(translation, rotation.as_quat())
    np.testing.assert_allclose(T.rotation.as_matrix(), rotation.as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(T.translation, translation)


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0.9), (0, 0, 0, 0), (np.nan, 0, 0, 1)])
def test_a_quaternion_of_another_length_is_refused(quaternion):
    with pytest.raises(InvalidInputError, match=r"quaternion .* has length .*, a rotation has 1"):
        transform_from_quaternion((0, 0, 0), quaternion)
