"""Try an installed planegrasp with nothing but its own dependencies: teach, save, find, pose."""

from __future__ import annotations

import tempfile

import cv2
import numpy as np

import planegrasp as pg
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.simulation import Rectangle, render


def main() -> None:
    """Render a textured face, find it with each extractor, and compare with the truth."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 256, (24, 32, 3)).astype(np.uint8)
    texture = cv2.GaussianBlur(
        cv2.resize(coarse, (640, 480), interpolation=cv2.INTER_NEAREST), (0, 0), 1.0
    ).astype(np.uint8)
    camera = pg.PinholeCamera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
    truth = RigidTransform.from_components(
        [0.03, -0.02, 0.7], Rotation.from_euler("xyz", (170.0, 25.0, 10.0), degrees=True)
    )
    frame = render([Rectangle(texture, 0.28, 0.21, truth)], camera, rng).frame
    with tempfile.TemporaryDirectory() as folder:
        library = pg.ObjectLibrary(folder)
        pg.teach(library, pg.ObjectModel.from_image("board", texture, width=0.28))
        for extractor in ("sift", "akaze", "brisk", "orb"):
            config = pg.DetectorConfig(extractor=extractor)
            (found,) = pg.Detector(pg.ObjectLibrary(folder), config).detect(frame)
            if found.T_camera_object is None:
                raise SystemExit(f"{extractor}: no pose: {found.pose_failure}")
            motion = found.T_camera_object.inv() * truth
            degrees = np.degrees(motion.rotation.magnitude())
            millimetres = 1e3 * float(np.linalg.norm(motion.translation))
            print(f"{extractor}: {found.inliers} inliers, {degrees:.2f}°, {millimetres:.2f} mm")
            if degrees > 0.5 or millimetres > 3.0:
                raise SystemExit(f"{extractor}: the pose is wrong")
    print(f"planegrasp {pg.__version__} works")


if __name__ == "__main__":
    main()
