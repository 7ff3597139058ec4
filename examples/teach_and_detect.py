"""Teach two objects from photos, find them in rendered RGB-D frames, compare with the truth.

python examples/teach_and_detect.py [LIBRARY]
"""

from __future__ import annotations

import sys

import numpy as np

import planegrasp as pg
from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import random_background, texture
from planegrasp.geometry import rotation_angle
from planegrasp.simulation import render


def main(folder: str | None) -> None:
    # Without a folder the library stays in memory.
    library = pg.ObjectLibrary(folder)
    for name in ("coffee", "chelsea"):
        model = pg.ObjectModel.from_image(name, texture(name), width=0.2)
        verdict = pg.teach(library, model, replace=True)["front"]
        print(f"{name}: quality {verdict.score} of 100")

    detector = pg.Detector(library)
    rng = np.random.default_rng(0)
    for tilt in (0, 30, 60):
        truth = {
            "coffee": facing_pose(np.array([-0.12, 0.0, 0.7]), np.radians(tilt), 0.3, 0.5),
            "chelsea": facing_pose(np.array([0.13, 0.02, 0.8]), np.radians(tilt), 2.0, -0.8),
        }
        scene = [face for name, T in truth.items() for face in rectangles(library[name], T)]
        frame = render(scene, CAMERA, rng, background=random_background(rng)).frame
        for found in detector.detect(frame):
            T = found.T_camera_object
            if T is None:
                print(f"tilt {tilt:2}°  {found.name:8} no pose: {found.pose_failure}")
                continue
            degrees = np.degrees(rotation_angle(T.rotation, truth[found.name].rotation))
            mm = 1e3 * np.linalg.norm(T.translation - truth[found.name].translation)
            print(
                f"tilt {tilt:2}°  {found.name:8} {found.inliers:3} inliers, score "
                f"{found.score:.2f}, off by {degrees:.2f}° and {mm:.1f} mm"
            )


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
