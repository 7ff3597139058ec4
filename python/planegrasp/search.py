"""Look for every face of the library among a frame's matches, also several times."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.detection import FaceDetection, FaceReport
from planegrasp.homography import apply_homography, reference_corners

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.features import Features
    from planegrasp.geometry import PinholeCamera
    from planegrasp.homography import HomographyConfig
    from planegrasp.matching.index import Candidates, ReferenceSet
    from planegrasp.references import FaceReference


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What the search needs of one frame.

    Attributes:
        features: that are looked at.
        image_points: N×2, their undistorted pixels.
        evidence: their candidates, sorted by face.
        gray: H×W uint8, undistorted.
        camera: of the frame.
    """

    features: Features
    image_points: NDArray[np.float64]
    evidence: _core.Evidence
    gray: NDArray[np.uint8]
    camera: PinholeCamera


@dataclass(slots=True, eq=False)
class Outcome:
    """What the search for one face gave.

    Attributes:
        found: its instances.
        reports: of each attempt.
        is_evident: whether the grey values of the first instance leave no doubt.
    """

    found: list[FaceDetection] = field(default_factory=list)
    reports: list[FaceReport] = field(default_factory=list)
    is_evident: bool = False

    @property
    def inliers(self) -> int:
        """Of the first instance, 0 without any."""
        return self.found[0].inliers if self.found else 0


class FaceSearch:
    """Turns the candidates of a frame into verified faces, and says why others are not there."""

    def __init__(self, config: HomographyConfig) -> None:
        self._references: list[FaceReference] = []
        self._core = _core.FaceSearch(_core.SearchSettings(**asdict(config)))

    @property
    def nbytes(self) -> int:
        """Bytes that the faces occupy, without the objects' own images."""
        return self._core.nbytes

    def add(self, reference: FaceReference, features: ReferenceSet) -> None:
        """Add a face, which gets the next number."""
        self._core.add(
            reference.face.face_from_edge,
            features.points,
            features.frames,
            cv2.cvtColor(reference.face.image, cv2.COLOR_RGB2GRAY).astype(np.uint8),
        )
        self._references.append(reference)

    def evidence(
        self, candidates: Candidates, features: Features, image_points: NDArray[np.float64]
    ) -> _core.Evidence:
        """Sort the candidates of a frame by face.

        Args:
            candidates: of the features.
            features: of the frame.
            image_points: N×2, the features' undistorted pixels.
        """
        return self._core.evidence(
            candidates.face,
            candidates.reference,
            candidates.ratio,
            image_points,
            features.scales,
            features.angles,
        )

    def outside(
        self, found: Mapping[int, Sequence[FaceDetection]], image_points: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Which undistorted pixels (N×2) lie in none of the faces found, by number of the face."""
        outside = np.ones(len(image_points), dtype=np.bool_)
        x, y = np.ascontiguousarray(image_points.T)
        for face, detections in found.items():
            corners = reference_corners(*self._references[face].size)
            for detection in detections:
                outline = apply_homography(detection.homography, corners)
                inside = np.ones(len(image_points), dtype=np.bool_)
                # A verified outline is convex and turns one way: inside is to the same side of all.
                for corner, side in zip(
                    outline, np.roll(outline, -1, axis=0) - outline, strict=True
                ):
                    turn = side[0] * (y - corner[1]) - side[1] * (x - corner[0])
                    inside &= turn >= 0
                outside &= ~inside
        return outside

    def find(
        self,
        view: View,
        faces: NDArray[np.uint32],
        max_instances: int,
        *,
        explain: bool = True,
    ) -> dict[int, Outcome]:
        """Find every instance of some faces.

        Args:
            view: the frame.
            faces: their numbers.
            max_instances: of one face.
            explain: whether faces that are not there are reported, too.

        Returns:
            The outcome by number of the face.
        """
        attempts = self._core.find(
            view.evidence,
            view.gray,
            to_core_camera(view.camera),
            among=faces,
            max_instances=max_instances,
            refused=explain,
        )
        outcomes: dict[int, Outcome] = {}
        for attempt in attempts:
            outcome = outcomes.setdefault(attempt.face, Outcome())
            outcome.reports.append(self._report(attempt, len(view.evidence)))
            found = attempt.found
            if found is not None:
                outcome.is_evident |= attempt.instance == 0 and found.is_evident
                outcome.found.append(self._detection(attempt.face, found, view.camera))
        return outcomes

    def look_where(
        self, face: int, predicted: NDArray[np.float64], view: View
    ) -> FaceDetection | None:
        """Verify one face where a homography (reference edges to undistorted pixels) predicts it.

        The matches need not pass the ratio test: they must lie where another face of the object,
        already found, says.
        """
        found = self._core.look_where(
            face, predicted, view.evidence, view.gray, to_core_camera(view.camera)
        )
        return None if found is None else self._detection(face, found, view.camera)

    def matches(self, evidence: _core.Evidence, face: int, max_ratio: float) -> _core.Matches:
        """Matches with one face that pass a ratio test."""
        return self._core.matches(evidence, face, max_ratio)

    def hypotheses(
        self, evidence: _core.Evidence, face: int, camera: PinholeCamera
    ) -> list[_core.HomographyEstimate]:
        """Homographies of one face to be verified, the likelier source first.

        First from the matches that pass the ratio test, sampled in the order of their ratio. Then,
        for faces with few right matches among many, from all those with a weaker ratio that support
        each other, sampled in the order of their support.
        """
        return self._core.hypotheses(evidence, face, to_core_camera(camera))

    def refine(
        self,
        start: NDArray[np.float64],
        evidence: _core.Evidence,
        face: int,
        camera: PinholeCamera,
    ) -> _core.HomographyEstimate | None:
        """A homography refined over all matches that agree with it, whatever their ratio.

        Returns:
            The estimate, or None where it degenerates or fewer than four matches agree.
        """
        return self._core.refine(start, evidence, face, to_core_camera(camera))

    def _detection(self, face: int, found: _core.FoundFace, camera: PinholeCamera) -> FaceDetection:
        inliers, matched = found.inliers, found.matched_homography
        return FaceDetection(
            name=self._references[face].face.name,
            homography=found.homography if found.is_aligned else matched,
            matched_homography=matched,
            corners=camera.distort(found.outline),
            reference_points=inliers.reference_points,
            image_points=inliers.image_points,
            coverage=found.coverage,
            agreement=found.agreement,
        )

    def not_proposed(self, face: int) -> FaceReport:
        """The report of a face that a large library's index did not propose."""
        reference = self._references[face]
        reason = "too few features agree where it is, beside those of the library's other faces"
        names = reference.object.name, reference.face.name
        return FaceReport(*names, 0, found=False, stage="proposal", reason=reason)

    def _report(self, attempt: _core.Attempt, features: int) -> FaceReport:
        reference = self._references[attempt.face]
        return FaceReport(
            object=reference.object.name,
            face=reference.face.name,
            instance=attempt.instance,
            found=attempt.stage == "found",
            stage=attempt.stage,
            reason=attempt.reason,
            figures={"features": float(features), **attempt.figures},
        )
