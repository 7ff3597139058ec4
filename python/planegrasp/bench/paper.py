"""Figures that the authors of the paper (arXiv:2101.07347) published, to print beside ours.

Their tables as printed again in Paul, Nicolescu & Nicolescu, Sensors 2023, 23, 5798, Tables 1 and
2 (the largest angles of SIFT and SURF are those of the paper).
"""

from __future__ import annotations

# Table I: largest out-of-plane rotation [deg].
MAX_TILT_DEG = {"sift": 48.0, "surf": 37.0, "akaze": 18.0, "brisk": 22.0}

# Table II: seconds to detect 1 … 6 objects.
SECONDS_BY_OBJECTS = {
    "sift": (0.06, 0.11, 0.17, 0.22, 0.28, 0.34),
    "surf": (0.09, 0.17, 0.26, 0.35, 0.45, 0.54),
}
