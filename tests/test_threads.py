"""The number of threads decides how long a frame takes, not what is seen in it."""

import os
import subprocess
import sys

SCRIPT = """
import numpy as np
from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import backgrounds, texture
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render

models = [ObjectModel.from_image(n, texture(n), 0.25) for n in ("coffee", "astronaut", "rocket")]
rng = np.random.default_rng(0)
poses = [facing_pose(np.array([x, 0.0, 0.8]), np.radians(40), 0.4, 0.3) for x in (-0.15, 0.15)]
scene = [r for model, T in zip(models, poses) for r in rectangles(model, T)]
frame = render(scene, CAMERA, rng, background=backgrounds()[4]).frame
for extractor in ("sift", "surf"):
    for d in Detector(models, DetectorConfig(extractor=extractor)).detect(frame):
        numbers = (d.homography, d.corners, d.T_camera_object.as_matrix(), d.covariance)
        exact = b"".join(np.ascontiguousarray(a).tobytes() for a in numbers).hex()
        print(extractor, d.name, d.instance, d.inliers, float(d.score).hex(), exact)
"""


def detections(threads):
    environment = os.environ | {"RAYON_NUM_THREADS": str(threads)}
    command = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_one_and_three_threads_see_the_same_to_the_last_bit():
    one = detections(1)
    found = {tuple(line.split()[:2]) for line in one}
    assert found == {(e, n) for e in ("sift", "surf") for n in ("astronaut", "coffee")}
    assert detections(3) == one
