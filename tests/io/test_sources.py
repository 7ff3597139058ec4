"""Every layout, written here and read back exactly; and what each refuses."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from planegrasp.errors import CameraError, DepthError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io import write_camera, write_color, write_depth
from planegrasp.io.sources import assumed_camera, open_source
from planegrasp.io.sources.sequence import natural_key
from planegrasp.rgbd import RGBDFrame

WIDTH, HEIGHT = 32, 24
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CAMERA = PinholeCamera(WIDTH, HEIGHT, 30.0, 31.0, 15.5, 11.25, (0.01, -0.02))


def make_frame(i):
    """Noise, with depth in whole millimetres and some pixels without a measurement."""
    rng = np.random.default_rng(i)
    color = rng.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    depth = (rng.integers(400, 3000, (HEIGHT, WIDTH)) / 1000).astype(np.float32)
    depth[i, :5] = 0
    return RGBDFrame(color, depth, CAMERA, f"{i:06d}")


@pytest.fixture
def frames():
    return [make_frame(i) for i in range(3)]


def write_two_folders(path, frames, scale=0.001):
    for frame in frames:
        write_color(path / "color" / f"{frame.name}.png", frame.color)
        write_depth(path / "depth" / f"{frame.name}.png", frame.depth, scale)
    write_camera(path / "camera.json", CAMERA, scale)
    return path


def write_flat(path, frames):
    for frame in frames:
        write_color(path / f"{frame.name}-color.png", frame.color)
        write_depth(path / f"{frame.name}-depth.png", frame.depth, 0.0002)
    write_camera(path / "camera.json", CAMERA, 0.0002)
    return path


def write_tum(path, frames, gap=0.01):
    colors, depths = ["# color images", "# timestamp filename"], []
    for i, frame in enumerate(frames):
        write_color(path / "rgb" / f"{i}.png", frame.color)
        write_depth(path / "depth" / f"{i}.png", frame.depth, 1 / 5000)
        colors.append(f"{1305031102.175 + i / 30:.6f} rgb/{i}.png")
        depths.append(f"{1305031102.175 + i / 30 + gap:.6f} depth/{i}.png")
    (path / "rgb.txt").write_text("\n".join(colors) + "\n")
    (path / "depth.txt").write_text("\n".join(reversed(depths)) + "\n\n")
    return path


def write_bop(path, frames):
    cameras = {}
    for i, frame in enumerate(frames):
        write_color(path / "rgb" / f"{i:06d}.png", frame.color)
        write_depth(path / "depth" / f"{i:06d}.png", frame.depth, 0.0001)
        K = [30.0 + i, 0.0, 15.5, 0.0, 31.0, 11.25, 0.0, 0.0, 1.0]
        cameras[str(i)] = {"cam_K": K, "depth_scale": 0.1, "cam_t_w2c": [0, 0, 0]}
    (path / "scene_camera.json").write_text(json.dumps(cameras))
    return path


def assert_same(read, written):
    assert len(read) == len(written)
    for a, b in zip(read, written, strict=True):
        np.testing.assert_array_equal(a.color, b.color)
        np.testing.assert_allclose(a.depth, b.depth, atol=1e-6)


@pytest.mark.parametrize("write", [write_two_folders, write_flat])
def test_rgbd_folder(tmp_path, frames, write):
    source = open_source(write(tmp_path / "run", frames))
    assert (source.name, source.length, source.camera, source.notes) == ("run", 3, CAMERA, ())
    read = list(source)
    assert_same(read, frames)
    assert [f.name for f in read] == ["000000", "000001", "000002"]
    assert all(f.camera == CAMERA and f.timestamp is None for f in read)
    assert len(list(source)) == 3, "iterating again starts again"


def test_given_camera_and_scale_win(tmp_path, frames):
    write_two_folders(tmp_path / "run", frames)
    other = PinholeCamera(WIDTH, HEIGHT, 40.0, 40.0, 15.5, 11.5)
    write_camera(tmp_path / "other.json", other, 0.0005)
    by_file = next(iter(open_source(tmp_path / "run", camera=tmp_path / "other.json")))
    assert by_file.camera == other
    np.testing.assert_allclose(by_file.depth, frames[0].depth / 2, atol=1e-6)
    by_value = next(iter(open_source(tmp_path / "run", camera=other, depth_scale=0.002)))
    np.testing.assert_allclose(by_value.depth, frames[0].depth * 2, atol=1e-6)


def test_frames_are_read_one_at_a_time(tmp_path, frames):
    path = write_two_folders(tmp_path, frames)
    (path / "color" / "000002.png").write_bytes(b"")
    iterator = iter(open_source(path))
    assert [next(iterator).name, next(iterator).name] == ["000000", "000001"]
    with pytest.raises(SourceError, match=r"000002\.png is empty"):
        next(iterator)


def test_sizes_that_differ_name_both_files(tmp_path, frames):
    path = write_two_folders(tmp_path, frames)
    write_depth(path / "depth" / "000000.png", np.ones((HEIGHT, WIDTH - 2), np.float32))
    message = r"color/000000\.png is 32×24 and .*depth/000000\.png is 30×24"
    with pytest.raises(SourceError, match=message):
        next(iter(open_source(path)))


def test_camera_of_another_size(tmp_path, frames):
    path = write_two_folders(tmp_path, frames)
    camera = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
    with pytest.raises(CameraError, match=r"000000\.png.*640×480 images, this image is 32×24"):
        next(iter(open_source(path, camera=camera)))


def test_wrong_scale_says_so(tmp_path, frames):
    path = write_two_folders(tmp_path, frames)
    with pytest.raises(DepthError, match=r"depth/000000\.png at 1 m per unit: .*in metres"):
        next(iter(open_source(path, depth_scale=1.0)))


def test_missing_depth_image_and_camera(tmp_path, frames):
    two, flat = write_two_folders(tmp_path / "two", frames), write_flat(tmp_path / "flat", frames)
    (two / "depth" / "000001.png").unlink()
    (flat / "000001-depth.png").unlink()
    with pytest.raises(SourceError, match=r"1 of 3 .*color/000001\.png: expected .*/000001\.png"):
        open_source(two)
    with pytest.raises(SourceError, match=r"expected 000001-depth\.png"):
        open_source(flat)
    (two / "camera.json").unlink()
    with pytest.raises(SourceError, match=r"camera\.json is missing"):
        open_source(two)
    (two / "color" / "sub").mkdir()
    for file in (two / "depth").iterdir():
        file.unlink()
    (two / "depth").rmdir()
    with pytest.raises(SourceError, match="no folder depth/"):
        open_source(two, camera=CAMERA)


def test_one_image_assumes_a_camera_and_says_so(tmp_path, frames):
    write_color(tmp_path / "photo.png", frames[0].color)
    source = open_source(tmp_path / "photo.png")
    assert source.length == 1
    assert source.camera is None
    assert len(source.notes) == 1
    assert "field of view of 60°" in source.notes[0]
    (frame,) = source
    np.testing.assert_array_equal(frame.color, frames[0].color)
    assert frame.depth is None
    assert frame.camera == assumed_camera(WIDTH, HEIGHT)


def test_one_image_with_camera_and_depth(tmp_path, frames):
    write_color(tmp_path / "photo.png", frames[0].color)
    write_depth(tmp_path / "d.npy", frames[0].depth)
    source = open_source(tmp_path / "photo.png", camera=CAMERA, depth=tmp_path / "d.npy")
    assert source.notes == ()
    assert_same(list(source), frames[:1])
    with pytest.raises(SourceError, match="depth but without a camera"):
        open_source(tmp_path / "photo.png", depth=tmp_path / "d.npy")
    with pytest.raises(SourceError, match=r"no image file .*gone\.png"):
        open_source(tmp_path / "photo.png", camera=CAMERA, depth=tmp_path / "gone.png")


def test_field_of_view(tmp_path, frames):
    write_color(tmp_path / "photo.png", frames[0].color)
    (frame,) = open_source(tmp_path / "photo.png", field_of_view=math.radians(90))
    assert frame.camera.fx == pytest.approx(WIDTH / 2)
    left, right = frame.camera.rays([[-0.5, 0], [WIDTH - 0.5, 0]])[:, 0]
    assert (left, right) == pytest.approx((-1, 1))
    with pytest.raises(SourceError, match="not both"):
        open_source(tmp_path / "photo.png", camera=CAMERA, field_of_view=1.0)
    with pytest.raises(CameraError, match="between 0° and 180°, got 200°"):
        list(open_source(tmp_path / "photo.png", field_of_view=math.radians(200)))


def test_image_folder_in_natural_order(tmp_path, frames):
    for name, frame in zip(("10.png", "9.jpg", "a2.png"), frames, strict=True):
        write_color(tmp_path / "images" / name, frame.color)
    (tmp_path / "images" / "notes.txt").touch()
    (tmp_path / "images" / ".hidden.png").touch()
    source = open_source(tmp_path / "images")
    assert source.length == 3
    assert [frame.name for frame in source] == ["9", "10", "a2"]


def test_image_folder_with_depth_folder_and_namesakes(tmp_path, frames):
    for frame in frames:
        write_color(tmp_path / "c" / f"{frame.name}.png", frame.color)
        write_depth(tmp_path / "d" / f"{frame.name}.npy", frame.depth)
    source = open_source(tmp_path / "c", camera=CAMERA, depth=tmp_path / "d")
    assert_same(list(source), frames)
    write_camera(tmp_path / "c" / "camera.json", CAMERA)
    assert open_source(tmp_path / "c").camera == CAMERA
    write_color(tmp_path / "c" / "000000.jpg", frames[0].color)
    assert [f.name for f in open_source(tmp_path / "c")][:2] == ["000000.jpg", "000000.png"]
    with pytest.raises(SourceError, match="is a folder too"):
        open_source(tmp_path / "c", camera=CAMERA, depth=tmp_path / "d" / "000000.npy")


@pytest.mark.parametrize(
    ("names", "ordered"),
    [
        (["b", "a10", "a9"], ["a9", "a10", "b"]),
        (["1", "01", "a", "2"], ["01", "1", "2", "a"]),
        (["frame-100", "frame-20", "frame-3"], ["frame-3", "frame-20", "frame-100"]),
    ],
)
def test_natural_key(tmp_path, names, ordered):
    paths = sorted((tmp_path / name for name in names), key=natural_key)
    assert [path.name for path in paths] == ordered


def test_tum(tmp_path, frames):
    source = open_source(write_tum(tmp_path / "rgbd_dataset_freiburg1_xyz", frames), camera=CAMERA)
    read = list(source)
    assert_same(read, frames)
    assert [f.timestamp for f in read] == pytest.approx(
        [1305031102.175, 1305031102.208333, 1305031102.241667], abs=1e-6
    )
    assert source.notes == ()


def test_tum_keeps_its_depth_scale_with_a_camera_file(tmp_path, frames):
    write_camera(tmp_path / "camera.json", CAMERA)
    source = open_source(write_tum(tmp_path / "run", frames), camera=tmp_path / "camera.json")
    assert_same(list(source), frames)


def test_tum_leaves_out_frames_without_depth(tmp_path, frames):
    path = write_tum(tmp_path, frames)
    lines = (path / "depth.txt").read_text().splitlines()
    (path / "depth.txt").write_text("\n".join(lines[:2]))
    source = open_source(path, camera=CAMERA)
    assert_same(list(source), frames[1:])
    assert source.notes == (
        "1 of 3 colour frames have no depth image within 20 ms and are left out",
    )
    write_tum(path, frames, gap=0.5)
    with pytest.raises(SourceError, match=r"within 20 ms \(3 colour, 3 depth\)"):
        open_source(path)


@pytest.mark.parametrize(
    ("name", "focal"),
    [("freiburg1_desk", 517.3), ("freiburg2_xyz", 520.9), ("Freiburg3_x", 535.4), ("desk", 525.0)],
)
def test_tum_camera_by_name(tmp_path, frames, name, focal):
    source = open_source(write_tum(tmp_path / f"rgbd_{name}", frames))
    assert source.camera.fx == focal
    assert "no camera given" in source.notes[0]


def test_tum_damaged_lists(tmp_path, frames):
    path = write_tum(tmp_path, frames)
    (path / "rgb.txt").write_text("# c\n1.0 rgb/0.png\nnow rgb/1.png\n")
    with pytest.raises(SourceError, match=r"rgb\.txt, line 3: .*got 'now rgb/1\.png'"):
        open_source(path)
    (path / "rgb.txt").write_text("# nothing\n")
    with pytest.raises(SourceError, match=r"rgb\.txt lists no images"):
        open_source(path)
    (path / "depth.txt").unlink()
    write_tum(tmp_path, frames)
    (path / "depth.txt").unlink()
    with pytest.raises(SourceError, match=r"depth\.txt is missing"):
        open_source(path)


def test_bop(tmp_path, frames):
    source = open_source(write_bop(tmp_path / "000001", frames))
    read = list(source)
    assert_same(read, frames)
    assert source.camera is None
    assert [f.camera.fx for f in read] == [30.0, 31.0, 32.0]
    assert (read[0].camera.width, read[0].camera.cy) == (WIDTH, 11.25)
    assert open_source(tmp_path / "000001", camera=CAMERA).camera == CAMERA


def test_bop_damaged(tmp_path, frames):
    path = write_bop(tmp_path / "set" / "000001", frames)
    with pytest.raises(SourceError, match=r"folder of BOP scenes, give one of them \(000001\)"):
        open_source(tmp_path / "set")
    cameras = json.loads((path / "scene_camera.json").read_text())
    del cameras["2"]
    (path / "scene_camera.json").write_text(json.dumps(cameras))
    with pytest.raises(SourceError, match=r"no camera for .*000002\.png"):
        open_source(path)
    cameras["2"] = {"cam_K": [1.0, 2.0]}
    (path / "scene_camera.json").write_text(json.dumps(cameras))
    with pytest.raises(SourceError, match=r"scene_camera\.json: 2\.cam_K: .*9 items"):
        open_source(path)
    (path / "scene_camera.json").write_text("{")
    with pytest.raises(SourceError, match="as JSON"):
        open_source(path)


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    assert writer.isOpened()
    for i in range(5):
        writer.write(np.full((48, 64, 3), (10, 20, 40 * i), np.uint8))
    writer.release()
    return path


def test_video(video):
    source = open_source(video)
    assert (source.name, source.length) == ("film.avi", 5)
    read = list(source)
    assert [f.timestamp for f in read] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert [f.name for f in read] == [f"{i:06d}" for i in range(5)]
    for i, frame in enumerate(read):
        np.testing.assert_allclose(frame.color.mean(axis=(0, 1)), (40 * i, 20, 10), atol=4)
    assert "60°" in source.notes[0]
    with pytest.raises(CameraError, match=r"film\.avi, frame 0: .*32×24 images"):
        list(open_source(video, camera=CAMERA))
    with pytest.raises(SourceError, match="a video takes no depth"):
        open_source(video, depth=video)


def test_damaged_video(video):
    data = video.read_bytes()
    video.write_bytes(data[:100])
    with pytest.raises(SourceError, match=r"film\.avi is (not a video|a video without a frame)"):
        list(open_source(video))
    video.write_text("no video")
    with pytest.raises(SourceError, match="not a video"):
        open_source(video)


def test_nothing_known(tmp_path):
    with pytest.raises(SourceError, match=r"no file or folder .*gone"):
        open_source(tmp_path / "gone")
    (tmp_path / "empty").mkdir()
    with pytest.raises(SourceError, match="is an empty folder: expected an RGB-D folder"):
        open_source(tmp_path / "empty")
    (tmp_path / "empty" / "a.txt").touch()
    with pytest.raises(SourceError, match=r"no known layout \(it holds a\.txt\)"):
        open_source(tmp_path / "empty")
    with pytest.raises(SourceError, match=r"neither an image \(\.bmp.* nor a video"):
        open_source(tmp_path / "empty" / "a.txt")


def test_options_that_do_not_apply_are_refused(tmp_path, frames):
    path = write_two_folders(tmp_path, frames)
    with pytest.raises(SourceError, match=r"an RGB-D folder takes no field of view, got 1\.0"):
        open_source(path, field_of_view=1.0)
    for scale in (0.0, -0.001, math.nan):
        with pytest.raises(SourceError, match="depth_scale must be > 0"):
            open_source(path, depth_scale=scale)


def test_recorded_sequences():
    if not DATA.is_dir():
        pytest.skip(f"the recorded data is not there: {DATA}")
    cube, scene = open_source(DATA / "cube"), open_source(DATA / "negatives")
    assert (cube.length, scene.length) == (49, 2)
    for source in (cube, scene):
        frame = next(iter(source))
        assert frame.color.shape == (480, 640, 3)
        assert 0.3 < np.median(frame.depth[frame.depth > 0]) < 3
