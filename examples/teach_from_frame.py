"""Teach an object from the first frame of an RGB-D recording, and follow it through the others.

Usage: python examples/teach_from_frame.py RECORDING X,Y X,Y X,Y X,Y

The four points are the object's corners in the first frame, in pixels: top-left, top-right,
bottom-right, bottom-left as printed on it. Its size is measured from the depth.
"""

from __future__ import annotations

import sys

import numpy as np

import planegrasp as pg
from planegrasp.io.sources import open_source


def main(source: str, corners: list[list[float]]) -> None:
    frames = iter(open_source(source))
    model = pg.ObjectModel.from_frame("thing", next(frames), corners)
    face = model.faces[0]
    quality = pg.assess(face.image)
    print(f"{1000 * face.width:.0f} × {1000 * face.height:.0f} mm, quality {quality.score} of 100")
    for reason in quality.reasons:
        print(f"  - {reason}")

    detector = pg.Detector([model])
    for frame in frames:
        found = next(iter(detector.detect(frame)), None)
        if found is None or found.T_camera_object is None or found.euler is None:
            print(f"{frame.name}  not found")
            continue
        x, y, z = found.T_camera_object.translation
        roll, pitch, yaw = np.degrees(found.euler)
        print(
            f"{frame.name}  {found.inliers:3} inliers  x {x:+.3f} y {y:+.3f} z {z:+.3f} m  "
            f"roll {roll:+.1f}° pitch {pitch:+.1f}° yaw {yaw:+.1f}°"
        )


if __name__ == "__main__":
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    main(sys.argv[1], [[float(v) for v in point.split(",")] for point in sys.argv[2:]])
