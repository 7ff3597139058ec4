"""Every benchmark end to end with tiny settings: names of figures, seeds, progress."""

import json

import numpy as np
import pytest

from planegrasp.bench import estimators, grasp, negatives, objects, pose, recorded, tilt
from planegrasp.bench.scenes import CAMERA, facing_pose, random_pose, rectangles
from planegrasp.bench.textures import background, random_background
from planegrasp.demo.objects import demo_objects
from planegrasp.demo.scene import poses
from planegrasp.errors import SourceError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io import write_camera, write_color, write_depth
from planegrasp.simulation import Rectangle, render


class Counter:
    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1


def run(bench, settings, seed=0):
    """Run it, and check what holds for every benchmark."""
    counter = Counter()
    result = bench.run(seed, settings, counter)
    assert counter.calls == settings.steps
    assert result.bench == bench.__name__.rpartition(".")[2]
    assert result.seed == seed
    assert len({tuple(row) for row in result.rows}) == 1  # the same columns in every row
    assert all(isinstance(value, (int, float)) for value in result.figures.values())
    json.loads(result.to_json())
    return result


def without_times(figures):
    return {name: value for name, value in figures.items() if not name.endswith("ms_median")}


@pytest.fixture(scope="module")
def tilt_result():
    settings = tilt.TiltSettings(
        frames=1,
        tilts_deg=(0, 45, 75, 80),
        extractors=("sift", "brisk"),
        photographs=("coffee", "rocket"),
    )
    return run(tilt, settings)


def test_tilt_gives_the_figures_of_each_extractor(tilt_result):
    for extractor in ("sift", "brisk"):
        for figure in ("max_tilt_deg", "weak.max_tilt_deg", "recall_75", "recall_80", "epsilon_45"):
            assert f"{extractor}.{figure}" in tilt_result.figures
    assert tilt_result.figures["sift.max_tilt_deg"] >= 45
    assert 0 < tilt_result.figures["sift.epsilon_45"] < 0.02
    assert tilt_result.figures["brisk.recall_80"] == 0


def test_tilt_gives_the_corner_error_with_and_without_the_alignment(tilt_result):
    figures = tilt_result.figures
    for extractor in ("sift", "brisk"):
        aligned = figures[f"{extractor}.corner_px_median"]
        assert 0 < aligned < 0.5
        assert aligned < figures[f"{extractor}.matched_corner_px_median"] < 2
    rows = {(r["extractor"], r["photographs"]): r for r in tilt_result.rows}
    for prefix, group in (("", "well-textured"), ("weak.", "weak")):
        row = rows["sift", group]
        assert row["corner px"] == figures[f"sift.{prefix}corner_px_median"]
        assert row["by matches px"] == figures[f"sift.{prefix}matched_corner_px_median"]


def test_tilt_prints_the_papers_angle_beside_ours(tilt_result):
    papers = {(r["extractor"], r["photographs"]): r["paper max °"] for r in tilt_result.rows}
    assert papers["sift", "well-textured"] == 48.0
    assert papers["brisk", "well-textured"] == 22.0
    assert papers["sift", "weak"] == ""


def test_objects_gives_times_over_one_object_recall_and_memory():
    settings = objects.ObjectsSettings(frames=1, in_view=(1, 2), libraries=(3,))
    figures = run(objects, settings).figures
    assert {"time_2_over_1", "time_3_over_1", "recall_3", "megabytes_per_object"} <= set(figures)
    assert figures["time_1_over_1"] == 1.0
    assert figures["recall_1"] == 1.0
    assert 0.1 < figures["megabytes_per_object"] < 50


def test_a_library_has_the_photographs_first_and_distinct_crops_after_them():
    models = objects.library_of(9, np.random.default_rng(0))
    assert [m.name for m in models[:2]] == ["astronaut", "coffee"]
    assert len({m.name for m in models}) == 9
    assert len({m.faces[0].image.tobytes() for m in models}) == 9


def test_pose_gives_the_figures_of_each_method_and_the_ratio_to_the_marker():
    settings = pose.PoseSettings(
        frames=1, tilts_deg=(30,), distances=(1.0,), photographs=("coffee",)
    )
    figures = run(pose, settings).figures
    for method in ("three_point", "pnp", "fused", "marker"):
        for figure in ("rotation_deg_median", "translation_mm_median", "recall"):
            assert f"{method}.{figure}" in figures
    assert figures["fused.recall"] == 1.0
    assert figures["fused.rotation_deg_median"] < 1.0
    assert figures["fused_over_marker.rotation"] == pytest.approx(
        figures["fused.rotation_deg_median"] / figures["marker.rotation_deg_median"]
    )
    assert "fused_over_marker.translation" in figures
    assert {"occluded.recall", "occluded.rotation_deg_median"} <= set(figures)


def test_one_seed_gives_one_result_and_another_seed_another():
    settings = estimators.EstimatorsSettings(frames=1, tilts_deg=(45,), photographs=("coffee",))
    first, again, other = (run(estimators, settings, seed) for seed in (1, 1, 2))
    assert without_times(first.figures) == without_times(again.figures)
    assert without_times(first.figures) != without_times(other.figures)


def test_an_object_among_the_negatives_is_a_false_positive_and_other_frames_have_none(tmp_path):
    cat = demo_objects()[1]
    write_recording(tmp_path, [rectangles(cat, random_pose(np.random.default_rng(0), 0.2))])
    settings = negatives.NegativesSettings(frames=1, data=tmp_path)
    result = run(negatives, settings)
    assert result.figures == {"frames": 2.0, "false_positives": 1.0}
    of_kind = {row["frames of"]: row["false positives"] for row in result.rows}
    assert of_kind["recorded"] == 1
    assert of_kind["rendered"] == 0
    assert any("chelsea" in str(row["frames of"]) for row in result.rows)


def write_recording(path, scenes):
    for folder in ("color", "depth"):
        (path / folder).mkdir()
    write_camera(path / "camera.json", CAMERA, 0.0002)
    frames = []
    for i, things in enumerate(scenes):
        rng = np.random.default_rng(i)
        rendering = render(things, CAMERA, rng, background=random_background(rng))
        write_color(path / "color" / f"{i:03d}.png", rendering.frame.color)
        write_depth(path / "depth" / f"{i:03d}.png", rendering.frame.depth, 0.0002)
        frames.append(rendering)
    return frames


def write_truth(path, carton, truth, corners):
    """The truth as a recording has it, for two sides of the demonstration's box."""
    sides = [face for face in carton.faces if face.name in ("front", "right")]
    T_cube_grid = RigidTransform.from_translation([0.1, -0.2, 0.05])
    names = [face.name for face in carton.faces]
    content = {
        "T_camera_grid": [(T * T_cube_grid).as_matrix().tolist() for T in truth],
        "T_camera_cube_in_frame_0": truth[0].as_matrix().tolist(),
        "faces": {
            face.name: {
                "size_m": [face.width, face.height],
                "corners_px_in_frame_0": corners[names.index(face.name)].tolist(),
                "T_cube_face": face.T_object_face.as_matrix().tolist(),
            }
            for face in sides
        },
    }
    (path / "ground_truth.json").write_text(json.dumps(content))


@pytest.fixture
def recording(tmp_path):
    """Three frames of the demonstration's box."""
    carton = demo_objects()[2]
    truth = [poses(share)["carton"] for share in (0.5, 0.4, 0.6)]
    frames = write_recording(tmp_path, [rectangles(carton, T) for T in truth])
    write_truth(tmp_path, carton, truth, frames[0].corners)
    return tmp_path


def test_recorded_teaches_from_the_first_frame_and_finds_each_face(recording):
    result = run(recorded, recorded.RecordedSettings(recording, max_frames=2))
    for face in ("front", "right", "object"):
        assert result.figures[f"{face}.recall"] == 1.0
        assert result.figures[f"{face}.rotation_deg_median"] < 1.5
        assert result.figures[f"{face}.translation_mm_median"] < 5.0
        assert f"{face}.three_point_rotation_deg_median" in result.figures
        assert f"{face}.scene_rotation_deg_median" in result.figures


def test_recorded_tells_a_wrong_truth_from_a_wrong_pose(tmp_path):
    carton = demo_objects()[2]
    moved = RigidTransform.from_components(
        [0.03, -0.02, 0.01], Rotation.from_rotvec(np.radians([2.0, -3.0, 4.0]))
    )
    first = poses(0.5)["carton"]
    truth = [first, moved * first]
    wall = background("motorcycle_left")
    T_first_wall = facing_pose(np.array([0.0, 0.0, 1.2]), 0.3, 0.0, 0.0)
    still = [
        Rectangle(wall, 1.6, 1.6 * wall.shape[0] / wall.shape[1], T * T_first_wall)
        for T in (RigidTransform.identity(), moved)
    ]
    scenes = [[*rectangles(carton, T), picture] for T, picture in zip(truth, still, strict=True)]
    frames = write_recording(tmp_path, scenes)
    wrong = RigidTransform.from_rotation(Rotation.from_rotvec([0.0, 0.0, np.radians(4.0)]))
    write_truth(tmp_path, carton, [first, truth[1] * wrong], frames[0].corners)

    figures = run(recorded, recorded.RecordedSettings(tmp_path)).figures
    assert figures["truth.rotation_deg_median"] == pytest.approx(4.0, abs=0.3)
    assert figures["object.rotation_deg_median"] == pytest.approx(4.0, abs=1.0)
    assert figures["object.scene_rotation_deg_median"] < 1.0
    assert figures["object.scene_translation_mm_median"] < 5.0


def test_recorded_says_which_truth_it_misses(tmp_path):
    with pytest.raises(SourceError, match=r"ground_truth\.json: no ground truth"):
        _ = recorded.RecordedSettings(tmp_path).steps


def test_grasp_does_experiments_and_judges_them():
    settings = grasp.GraspSettings(static=2, handheld=0, sides=("side",), jobs=1)
    figures = run(grasp, settings).figures
    for name in ("static.success", "handheld.success", "unreachable.refused", "robot_collisions"):
        assert name in figures
    for name in ("gripper_mm", "gripper_deg", "plan_seconds"):
        assert 0 < figures[f"{name}_median"] < 5
    assert np.isnan(figures["handheld.success"])
    assert figures["static.reachable"] + figures["unreachable.poses"] <= 2
