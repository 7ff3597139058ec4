"""RViz, Foxglove and Rerun are told the same pose of an object."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap_contents import contents
from rendered_stream import processed
from rosbags.typesys import Stores, get_typestore
from rrd import rows

from planegrasp.detector import Detector
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.foxglove import FoxgloveStream, FoxgloveTopics
from planegrasp.io.messages import FrameIds, live_messages
from planegrasp.io.ros2.conversions import tf_message
from planegrasp.io.ros2.markers import marker_array
from planegrasp.io.sources import open_source
from planegrasp.objects import ObjectModel
from planegrasp.viz.rerun_live import LiveRecording
from planegrasp.viz.rerun_live_blueprint import live_blueprint
from planegrasp.viz.rerun_streams import to_file

pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
TYPES = get_typestore(Stores.ROS2_HUMBLE).types.__getitem__


@pytest.fixture(params=["rendered", "recorded"])
def watching(request, watched):
    """What is seen in one frame, with the colours of its object."""
    if request.param == "rendered":
        objects, _, seen = watched
        return objects, seen[2]
    if not DATA.is_dir():
        pytest.skip(f"the recorded data is not there: {DATA}")
    truth = json.loads((DATA / "cube" / "ground_truth.json").read_text())["faces"]["front"]
    frame = next(iter(open_source(DATA / "cube")))
    corners = truth["corners_px_in_frame_0"]
    cube = ObjectModel.from_corners("cube", frame.color, corners, *truth["size_m"])
    (seen,) = processed(Detector([cube]), [frame])
    return (cube,), seen


def test_the_same_pose_everywhere(watching, tmp_path):
    objects, seen = watching
    (track,) = seen.tracks
    T = track.filtered.T_base_object.as_matrix()
    assert np.linalg.norm(T[:3, 3]) > 0.3, "of something in front of the camera"
    _, tracks = live_messages(seen)
    with FoxgloveStream(objects) as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.live(seen)
    found, topics = contents(tmp_path / "run.mcap"), FoxgloveTopics()
    with LiveRecording(to_file(tmp_path / "run.rrd", live_blueprint())) as recording:
        recording.write(seen)

    ((_, transforms),) = found[topics.transforms]
    body, foxglove = transforms.transforms
    ids = FrameIds()
    placed = [(tracks.header, ids.object(track.name), tracks.objects[0].pose.pose)]
    (ros,) = tf_message(TYPES, placed).transforms
    assert (foxglove.parent_frame_id, foxglove.child_frame_id) == (
        ros.header.frame_id,
        ros.child_frame_id,
    )
    assert_pose(foxglove.translation, foxglove.rotation, T)
    assert_pose(ros.transform.translation, ros.transform.rotation, T)
    root = f"/world/objects/{track.name}/0"
    ((_, (position,)),) = rows(tmp_path / "run.rrd", root, "Transform3D:translation")
    ((_, (turn,)),) = rows(tmp_path / "run.rrd", root, "Transform3D:quaternion")
    shown = RigidTransform.from_components(position, Rotation.from_quat(turn)).as_matrix()
    np.testing.assert_allclose(shown, T, atol=1e-6)  # Rerun has 32 bits

    ((_, scene),) = found[topics.scene]
    (cube,) = scene.entities[0].cubes
    box, *_ = marker_array(TYPES, tracks).markers
    T_box = (track.filtered.T_base_object * at(track.model.outer_body.centre)).as_matrix()
    assert_pose(cube.pose.position, cube.pose.orientation, T_box)
    assert_pose(box.pose.position, box.pose.orientation, T_box)
    sizes = [[size.x, size.y, size.z] for size in (cube.size, box.scale)]
    np.testing.assert_allclose(sizes, [track.model.outer_body.size] * 2)
    # Seen from the body, what the optical frame has in front (z) is in front (x).
    T_body = Rotation.from_quat(quaternion(body.rotation)).apply(T[:3, 3])
    np.testing.assert_allclose(T_body, [T[2, 3], -T[0, 3], -T[1, 3]], atol=1e-12)


def at(centre):
    return RigidTransform.from_translation(centre)


def quaternion(message):
    return [message.x, message.y, message.z, message.w]


def assert_pose(position, orientation, T):
    turn = Rotation.from_quat(quaternion(orientation))
    told = RigidTransform.from_components([position.x, position.y, position.z], turn)
    np.testing.assert_allclose(told.as_matrix(), T, atol=1e-12)
