"""Look for every face of the library among a frame's matches, also several times."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.appearance import agreement
from planegrasp.detection import FaceDetection, FaceReport
from planegrasp.homography import (
    apply_homography,
    check_outline,
    check_shape,
    coverage,
    hypotheses,
    reference_corners,
    refine,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.homography import HomographyConfig, HomographyEstimate
    from planegrasp.matching.index import Candidates
    from planegrasp.references import FaceReference


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What the search needs of one frame.

    Attributes:
        candidates: nearest references of the frame's features.
        gray: H×W uint8, undistorted.
        camera: of the frame.
    """

    candidates: Candidates
    gray: NDArray[np.uint8]
    camera: PinholeCamera


class FaceSearch:
    """Turns the candidates of a frame into verified faces, and says why others are not there."""

    def __init__(self, references: Sequence[FaceReference], config: HomographyConfig) -> None:
        self._references = references
        self._config = config

    def find(
        self,
        view: View,
        max_instances: int,
    ) -> tuple[dict[int, list[FaceDetection]], list[FaceReport]]:
        """Find every instance of every face.

        Args:
            view: the frame.
            max_instances: of one face.

        Returns:
            Detections by index of the face, best supported first, and a report for each attempt.
        """
        found: dict[int, list[FaceDetection]] = {}
        reports: list[FaceReport] = []
        for face in range(len(self._references)):
            remaining = view
            for instance in range(max_instances):
                detection, report = self._attempt(face, instance, remaining)
                if instance == 0 or detection is not None:
                    reports.append(report)
                if detection is None:
                    break
                found.setdefault(face, []).append(detection)
                inside = _inside(detection, remaining.candidates, self._references[face])
                remaining = replace(remaining, candidates=remaining.candidates.without(inside))
        return found, reports

    def look_where(
        self,
        face: int,
        predicted: NDArray[np.float64],
        view: View,
    ) -> FaceDetection | None:
        """Verify one face where a homography (reference edges to undistorted pixels) predicts it.

        The matches need not pass the ratio test: they must lie where another face of the object,
        already found, says.
        """
        reference = self._references[face]
        if check_outline(predicted, reference.size, view.camera, self._config):
            return None
        estimate = refine(predicted, view.candidates, face, self._config)
        if estimate is None:
            return None
        figures: dict[str, float] = {}
        if self._verify(reference, estimate, view, figures):
            return None
        return self._accept(reference, estimate, view.camera, figures)

    def _attempt(
        self,
        face: int,
        instance: int,
        view: View,
    ) -> tuple[FaceDetection | None, FaceReport]:
        """One attempt at one face: matches, homography, verification."""
        reference, config, candidates = self._references[face], self._config, view.candidates
        matching = {"features": float(len(candidates.image_points))}

        def report(
            stage: str, reason: str = "", verified: Mapping[str, float] | None = None
        ) -> FaceReport:
            names = reference.object.name, reference.face.name
            figures = {**matching, **(verified or {})}
            return FaceReport(*names, instance, stage == "found", stage, reason, figures)

        if not len(reference.set.points):
            return None, report("features", "the reference image has no features")
        matches = len(candidates.matches(face, config.max_ratio))
        matching["matches"] = float(matches)
        refusal = (
            report("homography", f"no homography explains any four of its {matches} matches")
            if matches >= config.min_matches
            else report("matching", f"{matches} matches (at least {config.min_matches})")
        )
        for estimate in hypotheses(candidates, face, config):
            figures: dict[str, float] = {}
            reason = self._verify(reference, estimate, view, figures)
            if not reason:
                detection = self._accept(reference, estimate, view.camera, figures)
                return detection, report("found", verified=figures)
            refusal = report("verification", reason, figures)
        return None, refusal

    def _verify(
        self,
        reference: FaceReference,
        estimate: HomographyEstimate,
        view: View,
        figures: dict[str, float],
    ) -> str:
        """Why the estimate cannot be a view of the face; "" where it can."""
        config = self._config
        inliers, matrix = estimate.inliers, estimate.matrix
        figures["inliers"] = float(len(inliers))
        if len(inliers) < config.min_inliers:
            return f"{len(inliers)} inliers (at least {config.min_inliers})"
        if reason := check_outline(matrix, reference.size, view.camera, config):
            return reason
        reason, figures["stretch"] = check_shape(
            matrix, reference.face.face_from_edge, view.camera, config
        )
        if reason:
            return reason
        figures["coverage"] = coverage(inliers.reference_points, *reference.size)
        if figures["coverage"] < config.min_coverage:
            return (
                f"inliers cover {figures['coverage']:.0%} of the face "
                f"(at least {config.min_coverage:.0%})"
            )
        figures["agreement"] = agreement(reference.appearance, view.gray, matrix)
        if figures["agreement"] < config.min_agreement:
            return (
                f"{figures['agreement']:.0%} of the face looks like its reference "
                f"(at least {config.min_agreement:.0%})"
            )
        return ""

    def _accept(
        self,
        reference: FaceReference,
        estimate: HomographyEstimate,
        camera: PinholeCamera,
        figures: dict[str, float],
    ) -> FaceDetection:
        outline = apply_homography(estimate.matrix, reference_corners(*reference.size))
        inliers = estimate.inliers
        return FaceDetection(
            name=reference.face.name,
            homography=estimate.matrix,
            corners=camera.distort(outline),
            reference_points=inliers.reference_points,
            image_points=inliers.image_points,
            coverage=figures["coverage"],
            agreement=figures["agreement"],
        )


def _inside(
    detection: FaceDetection, candidates: Candidates, face: FaceReference
) -> NDArray[np.bool_]:
    """Which features of the frame lie inside of a found face."""
    outline = apply_homography(detection.homography, reference_corners(*face.size))
    sides = np.roll(outline, -1, axis=0) - outline
    offsets = candidates.image_points[:, None] - outline
    # A verified outline is convex and turns one way: inside is to the same side of all its sides.
    turns = sides[:, 0] * offsets[..., 1] - sides[:, 1] * offsets[..., 0]
    return np.asarray(np.all(turns >= 0, axis=1), dtype=np.bool_)
