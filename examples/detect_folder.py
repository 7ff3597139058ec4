"""Find a library's objects in every frame of an image folder, a video or an RGB-D recording.

python examples/detect_folder.py RECORDING LIBRARY
"""

from __future__ import annotations

import sys

import numpy as np

import planegrasp as pg
from planegrasp.io.sources import open_source


def main(source: str, library: str) -> None:
    frames = open_source(source)
    for note in frames.notes:
        print(f"note: {note}")
    detector = pg.Detector(pg.ObjectLibrary(library))
    for frame in frames:
        report = detector.explain(frame)
        for found in report.detections:
            print(f"{frame.name}  {found.name} #{found.instance}  {describe(found)}")
        missing = {face.object for face in report.faces} - {d.name for d in report.detections}
        for face in report.faces:
            if face.object in missing:
                print(f"{frame.name}  no {face.object}: {face.face}: {face.reason}")


def describe(found: pg.Detection) -> str:
    """The pose in one line, with its standard deviations where they are known."""
    if found.T_camera_object is None:
        return f"no pose: {found.pose_failure}"
    x, y, z = found.T_camera_object.translation
    text = f"at {x:+.3f} {y:+.3f} {z:+.3f} m"
    if found.covariance is not None:
        sigma = np.sqrt(np.diag(found.covariance))
        millimetres, degrees = 1e3 * sigma[:3].max(), np.degrees(sigma[3:].max())
        text += f", sigma {millimetres:.1f} mm {degrees:.2f}°"
    return text + (", or the other planar solution" if found.ambiguous else "")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
