"""Lines of a live run are whole, whatever happens to the disk."""

from __future__ import annotations

import json
import resource

import numpy as np
import pytest
from rendered_stream import covered, processed, shots, taught

from planegrasp.detector import Detector
from planegrasp.errors import RecordingError
from planegrasp.io.sinks import LiveLinesWriter

NAME = taught()[0].name


@pytest.fixture(scope="module")
def seen():
    """Seen in three frames, then hidden until it is lost."""
    chosen = shots()[:12]
    frames = [shot.frame if i < 3 else covered(shot) for i, shot in enumerate(chosen)]
    return processed(Detector(taught()), frames)


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_a_line_says_what_is_known(seen, tmp_path):
    with LiveLinesWriter(tmp_path / "new" / "a.jsonl") as writer:
        for one in seen:
            writer.write(one)
    rows = lines_of(tmp_path / "new" / "a.jsonl")
    assert len(rows) == writer.frames == 12
    third, fourth = rows[2], rows[3]
    (track,) = third["tracks"]
    assert (track["number"], track["instance"], track["seen"]) == (0, 0, True)
    truth = shots()[2].truth[NAME]
    np.testing.assert_allclose(track["translation"], truth.translation, atol=0.005)
    assert abs(np.dot(track["quaternion"], truth.rotation.as_quat(canonical=True))) > 0.9999
    speed = np.linalg.norm(track["linear_velocity"])
    assert speed == pytest.approx(float(np.linalg.norm(seen[2].tracks[0].filtered.linear_velocity)))
    assert third["detections"][0]["tracked"] is True
    assert fourth["detections"] == []
    assert (fourth["tracks"][0]["seen"], fourth["tracks"][0]["reason"] != "") == (False, True)
    assert [row["lost"] for row in rows if row["lost"]] == [[0]]
    assert set(third["seconds"]) == {"take", "track", "detect"}


def test_a_full_disk_leaves_whole_lines(seen, tmp_path):
    path = tmp_path / "a.jsonl"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with LiveLinesWriter(path) as writer:
        writer.write(seen[0])
        limit = path.stat().st_size * 3 // 2
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
        try:
            with pytest.raises(RecordingError, match="further: File too large; the 1 lines"):
                writer.write(seen[1])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [row["frame"] for row in lines_of(path)] == [seen[0].frame.name]


def test_what_cannot_be_begun(tmp_path):
    (tmp_path / "a.jsonl").write_text("old")
    with pytest.raises(RecordingError, match=r"a\.jsonl exists already"):
        LiveLinesWriter(tmp_path / "a.jsonl")
    with pytest.raises(RecordingError, match="cannot be written"):
        LiveLinesWriter(tmp_path / "a.jsonl" / "b.jsonl")
    assert (tmp_path / "a.jsonl").read_text() == "old"
