"""A live recording can be read back, and says what is true of the stream."""

from __future__ import annotations

import builtins
import socket
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from rendered_stream import GRASP, covered, processed, shots, taught
from rerun_server import free_port, rerun_server
from rrd import rows, unfinished_rows

from planegrasp.detector import Detector
from planegrasp.errors import InvalidInputError, MissingExtraError, RecordingError, ViewerError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.live import Live, LiveConfig, LiveRates, Skipped
from planegrasp.rgbd import RGBDFrame
from planegrasp.viz.rerun_live import LiveRecording, LiveRecordingConfig
from planegrasp.viz.rerun_live_blueprint import live_blueprint
from planegrasp.viz.rerun_streams import to_browser, to_file, to_viewer

pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")

NAME = taught()[0].name
OBJECT = f"/world/objects/{NAME}/0"
RATES = LiveRates(30.0, 29.5, 2.0, 0.003, 0.009, 7)
# The object is hidden for longer than a track's patience, then it is there again.
HIDDEN = range(8, 16)


def frames():
    return [covered(shot) if i in HIDDEN else shot.frame for i, shot in enumerate(shots())]


@pytest.fixture(scope="module")
def detector():
    return Detector(taught())


@pytest.fixture(scope="module")
def seen(detector):
    return processed(detector, frames())


@pytest.fixture(scope="module")
def recording(seen, tmp_path_factory):
    path = tmp_path_factory.mktemp("rrd") / "out" / "live.rrd"
    with LiveRecording(to_file(path, live_blueprint())) as writer:
        for i, one in enumerate(seen):
            writer.write(one, replace(RATES, dropped=i))
            for track in one.new:
                writer.note(f"found {track.name}")
    return path


def in_sight(seen):
    return [i for i, one in enumerate(seen) if one.detections]


def test_the_scenario(seen):
    visible = in_sight(seen)
    assert not set(visible) & set(HIDDEN)
    assert len(visible) >= len(seen) - len(HIDDEN) - 1
    assert sum(len(one.new) for one in seen) == 2
    assert sum(len(one.lost) for one in seen) == 1


def test_poses_are_the_true_ones_where_the_object_is_seen(recording, seen):
    places = rows(recording, OBJECT, "Transform3D:translation")
    turns = rows(recording, OBJECT, "Transform3D:quaternion")
    assert [number for number, _ in places] == in_sight(seen)
    for (number, place), (_, turn) in zip(places, turns, strict=True):
        truth = shots()[number].truth[NAME]
        assert np.linalg.norm(place[0] - truth.translation) < 0.005
        assert (truth.rotation.inv() * Rotation.from_quat(turn[0])).magnitude() < 0.02


def test_outlines_are_on_the_image_where_the_face_is(recording, seen):
    outlines = rows(recording, f"/world/camera/outlines/{NAME}/0", "LineStrips2D:strips")
    assert [number for number, _ in outlines] == in_sight(seen)
    face = taught()[0].faces[0]
    for number, strips in outlines:
        truth = shots()[number].truth[NAME].apply(face.object_corners)
        corners = shots()[number].frame.camera.project(truth)
        np.testing.assert_allclose(strips[0], [*corners, corners[0]], atol=1.5)


def test_an_object_that_is_not_seen_is_gone(recording, seen):
    visible = in_sight(seen)
    gone = next(i for i in range(len(seen)) if i > visible[0] and i not in visible)
    assert (gone, [True]) in rows(recording, OBJECT, "Clear:is_recursive")
    corners = rows(recording, f"{OBJECT}/faces/front", "Mesh3D:vertex_positions")
    again = next(i for i in visible if i > gone)
    # What it looks like is stored when it appears, its picture once.
    assert [number for number, _ in corners] == [visible[0], again]
    pictures = rows(recording, f"{OBJECT}/faces/front", "Mesh3D:albedo_texture_buffer")
    assert [number for number, _ in pictures] == [None]


def test_states(recording, seen):
    visible = in_sight(seen)
    states = rows(recording, f"/states/{NAME}/0", "StateChange:state")
    lost = next(i for i, one in enumerate(seen) if one.lost)
    hidden = next(i for i in range(len(seen)) if i > visible[0] and i not in visible)
    again = next(i for i in visible if i > hidden)
    assert states == [
        (visible[0], ["seen"]),
        (hidden, ["hidden"]),
        (lost, ["lost"]),
        (again, ["seen"]),
    ]
    assert hidden < lost < again


def test_skipped_is_not_hidden(detector, tmp_path):
    """A track that no time was spent on says so."""
    first, second = processed(detector, [shot.frame for shot in shots()[:2]])
    idle = replace(
        second,
        detections=(),
        tracks=tuple(replace(track, detection=None) for track in second.tracks),
        skipped=(Skipped(NAME, 0, "no time"),),
    )
    with LiveRecording(to_file(tmp_path / "a.rrd", live_blueprint())) as writer:
        for one in (first, second, idle):
            writer.write(one)
    states = rows(tmp_path / "a.rrd", f"/states/{NAME}/0", "StateChange:state")
    assert [state for _, (state,) in states] == ["seen", "skipped"]


def test_grasps_are_where_they_were_taught(recording):
    grasp = f"{OBJECT}/grasps/side/flipped"
    (_, place), *_ = rows(recording, grasp, "Transform3D:translation")
    (_, turn), *_ = rows(recording, grasp, "Transform3D:quaternion")
    np.testing.assert_allclose(place[0], GRASP.T_object_gripper.translation, atol=1e-6)
    rest = GRASP.T_object_gripper.rotation.inv() * Rotation.from_quat(turn[0])
    assert rest.magnitude() < 1e-6
    (_, strips), *_ = rows(recording, grasp, "LineStrips3D:strips")
    across = np.ptp(np.array(strips[0])[:, 1])
    assert across == pytest.approx(GRASP.opening)


def test_grasps_can_be_left_out(detector, tmp_path):
    path = tmp_path / "a.rrd"
    config = LiveRecordingConfig(grasps=False, cloud=False)
    with LiveRecording(to_file(path, live_blueprint()), config=config) as writer:
        writer.write(processed(detector, [shots()[0].frame])[0])
    assert rows(path, f"{OBJECT}/axes", "Arrows3D:vectors")
    assert not rows(path, f"{OBJECT}/grasps/side/flipped", "Transform3D:translation")
    assert not rows(path, "/world/cloud", "Points3D:positions")


def test_arrows_show_the_way_in_half_a_second(detector, tmp_path):
    """An object that stands before a camera that is carried along: it moves in the fixed frame."""
    path, still = tmp_path / "a.rrd", shots()[0].frame
    velocity = np.array([0.2, -0.1, 0.05])
    with (
        Live(detector, config=LiveConfig(background=False)) as live,
        LiveRecording(to_file(path, live_blueprint())) as writer,
    ):
        for time in np.arange(20) / 30:
            T_fixed_camera = RigidTransform.from_translation(time * velocity)
            one = live.process(replace(still, timestamp=time), T_fixed_camera)
            writer.write(one, None, T_fixed_camera)
    arrows = rows(path, f"/world/velocities/{NAME}/0", "Arrows3D:vectors")
    origins = rows(path, f"/world/velocities/{NAME}/0", "Arrows3D:origins")
    places = dict(rows(path, OBJECT, "Transform3D:translation"))
    assert [number for number, _ in arrows][-10:] == list(range(10, 20))
    for (number, vectors), (_, origin) in zip(arrows[-5:], origins[-5:], strict=True):
        np.testing.assert_allclose(vectors[0], 0.5 * velocity, atol=0.01)
        np.testing.assert_allclose(origin[0], places[number][0], atol=1e-6)


def test_no_arrow_where_nothing_moves(detector, tmp_path):
    path, still = tmp_path / "a.rrd", shots()[0].frame
    with LiveRecording(to_file(path, live_blueprint())) as writer:
        for one in processed(detector, [replace(still, timestamp=i / 30) for i in range(20)]):
            writer.write(one)
    arrows = rows(path, f"/world/velocities/{NAME}/0", "Arrows3D:vectors")
    assert not [number for number, _ in arrows if number > 10]
    assert len(rows(path, OBJECT, "Transform3D:translation")) >= 19


def test_images_and_clouds_come_at_a_reduced_rate(seen, recording, tmp_path):
    images = rows(recording, "/world/camera/color", "EncodedImage:blob")
    clouds = rows(recording, "/world/cloud", "Points3D:positions")
    assert [number for number, _ in images] == list(range(0, len(seen), 3))  # 10 of 30 Hz
    assert [number for number, _ in clouds] == [number for number, _ in images]
    picture = cv2.imdecode(np.array(images[1][1][0], np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1]
    difference = picture.astype(float) - shots()[3].frame.color
    assert np.abs(difference).mean() < 4
    points = np.array(clouds[0][1])
    depth = shots()[0].frame.depth
    u, v = shots()[0].frame.camera.project(points[500].reshape(1, 3))[0]
    assert depth[round(v), round(u)] == pytest.approx(points[500][2], abs=1e-4)
    for rate, expected in ((1000.0, len(seen)), (0.0, 0)):
        path = tmp_path / f"{rate}.rrd"
        config = LiveRecordingConfig(image_rate=rate, cloud=False)
        with LiveRecording(to_file(path, live_blueprint()), config=config) as writer:
            for one in seen:
                writer.write(one)
        assert len(rows(path, "/world/camera/color", "EncodedImage:blob")) == expected


def test_plots(recording, seen):
    last = len(seen) - 1
    for plot, value in {
        "rate/camera": 30.0,
        "rate/tracking": 29.5,
        "rate/detector": 2.0,
        "latency/p50": 3.0,
        "latency/p99": 9.0,
        "count/dropped": last,
        "count/seen": 1,
    }.items():
        found = rows(recording, f"/plots/{plot}", "Scalars:scalars")
        assert len(found) == len(seen), plot
        assert found[-1] == (last, [pytest.approx(value)]), plot
    seen_now = rows(recording, "/plots/count/seen", "Scalars:scalars")
    assert [i for i, (count,) in seen_now if count] == in_sight(seen)


def test_events_are_noted_in_their_frame(recording, seen):
    notes = rows(recording, "/events", "TextLog:text")
    assert notes == [(i, [f"found {NAME}"]) for i, one in enumerate(seen) for _ in one.new]


def test_time_begins_with_the_first_frame(detector, tmp_path):
    from rerun.chunk import RrdReader

    path = tmp_path / "a.rrd"
    first = shots()[0].frame
    late = [replace(first, timestamp=1.7e9 + t) for t in (0.0, 0.5)]
    with LiveRecording(to_file(path, live_blueprint())) as writer:
        for one in processed(detector, late):
            writer.write(one)
    times = {
        time.total_seconds()
        for chunk in RrdReader(path).stream()
        if chunk.entity_path == "/world/camera"
        for time in chunk.to_record_batch().column("time").to_pylist()
    }
    assert times == {0.0, 0.5}


def test_a_camera_that_moves(detector, tmp_path):
    """The world is the fixed frame: the object stands there, the camera does not."""
    T_fixed_camera = RigidTransform.from_components(
        [1.0, 2.0, 3.0], Rotation.from_euler("y", 40, degrees=True)
    )
    shot, path = shots()[0], tmp_path / "a.rrd"
    with (
        Live(detector, config=LiveConfig(background=False)) as live,
        LiveRecording(to_file(path, live_blueprint())) as writer,
    ):
        for i in range(2):
            frame = replace(shot.frame, timestamp=i / 30)
            writer.write(live.process(frame, T_fixed_camera), None, T_fixed_camera)
    truth = (T_fixed_camera * shot.truth[NAME]).translation
    for _, place in rows(path, OBJECT, "Transform3D:translation"):
        np.testing.assert_allclose(place[0], truth, atol=0.01)
    for entity in ("/world/camera", "/world/cloud"):
        (_, place), *_ = rows(path, entity, "Transform3D:translation")
        np.testing.assert_allclose(place[0], [1.0, 2.0, 3.0], atol=1e-6)


def test_the_resolution_changes_and_depth_stops(detector, tmp_path):
    frame = shots()[0].frame
    small = cv2.resize(frame.color, (320, 240), interpolation=cv2.INTER_AREA)
    camera = replace(
        frame.camera,
        width=320,
        height=240,
        fx=frame.camera.fx / 2,
        fy=frame.camera.fy / 2,
        cx=(frame.camera.cx + 0.5) / 2 - 0.5,
        cy=(frame.camera.cy + 0.5) / 2 - 0.5,
    )
    path = tmp_path / "a.rrd"
    changed = RGBDFrame(small, None, camera, "small", 1 / 30)
    with LiveRecording(to_file(path, live_blueprint())) as writer:
        for one in processed(detector, [frame, changed]):
            writer.write(one)
    sizes = rows(path, "/world/camera", "Pinhole:resolution")
    assert sizes == [(0, [[640.0, 480.0]]), (1, [[320.0, 240.0]])]
    images = rows(path, "/world/camera/color", "EncodedImage:blob")
    shapes = [
        cv2.imdecode(np.array(blob[0], np.uint8), cv2.IMREAD_COLOR).shape for _, blob in images
    ]
    assert shapes == [(480, 640, 3), (240, 320, 3)]
    assert rows(path, "/world/cloud", "Clear:is_recursive") == [(1, [True])]


def test_what_cannot_be_begun(tmp_path):
    (tmp_path / "old.rrd").write_bytes(b"old")
    with pytest.raises(RecordingError, match=r"old\.rrd exists already"):
        to_file(tmp_path / "old.rrd", live_blueprint())
    with pytest.raises(RecordingError, match="cannot be written"):
        to_file(tmp_path / "old.rrd" / "a.rrd", live_blueprint())
    for rate in (-1.0, float("nan"), 1e6):
        with pytest.raises(InvalidInputError, match="the rate of images is from 0 to 1000 Hz"):
            LiveRecordingConfig(image_rate=rate)


def test_without_rerun(monkeypatch):
    importing = builtins.__import__

    def without(name, *rest):
        if name.partition(".")[0] == "rerun":
            raise ImportError(name)
        return importing(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"planegrasp\[rerun\]"):
        live_blueprint()


def test_no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerError, match="no display for the Rerun viewer: --web shows it"):
        to_viewer(live_blueprint(), free_port())


@pytest.mark.parametrize("taken", ["port", "web_port"])
def test_a_port_is_taken(taken):
    with socket.socket() as other:
        other.bind(("0.0.0.0", 0))
        other.listen()
        number = other.getsockname()[1]
        ports = {"port": free_port(), "web_port": free_port(), taken: number}
        with pytest.raises(ViewerError, match=f"port {number} is taken"):
            to_browser(live_blueprint(), **ports, opens=False)


def test_a_viewer_that_is_closed(seen):
    """Rerun's own server stands for the viewer: it needs no display."""
    port = free_port()
    with rerun_server(port) as viewer:
        stream = to_viewer(live_blueprint(), port)
        writer = LiveRecording(stream)
        writer.write(seen[0])
        stream.flush()
        viewer.kill()
        viewer.wait()
        with pytest.raises(ViewerError, match="the Rerun viewer takes no data any more"):
            write_until_it_fails(writer, stream, seen[0])
        writer.close()


_FULL = """
import resource, sys
from planegrasp.viz.rerun_live_blueprint import live_blueprint
from planegrasp.viz.rerun_streams import to_file
from planegrasp.errors import RecordingError
import rerun as rr
stream = to_file(sys.argv[1], live_blueprint())
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
try:
    for i in range(1000):
        stream.stream.set_time("frame", sequence=i)
        stream.stream.log("bytes", rr.Points3D([[i, 0, 0]] * 1000))
        stream.flush()
except RecordingError as error:
    print(i, error)
stream.close()
"""


def test_a_full_disk(tmp_path):
    """What was written before is readable. In a process of its own, for its limit."""
    path = tmp_path / "a.rrd"
    done = subprocess.run(
        [sys.executable, "-c", _FULL, path],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    number, message = done.stdout.split(" ", 1)
    assert "a.rrd cannot be written any further: File too large" in message
    points = unfinished_rows(path, "/bytes", "Points3D:positions")
    assert [i for i, _ in points] == list(range(len(points)))
    assert 3 < len(points) <= int(number)


def write_until_it_fails(writer, stream, one):
    for _ in range(1000):
        writer.write(one)
        stream.flush()
