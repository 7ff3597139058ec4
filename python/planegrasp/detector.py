"""Find the library's objects in a frame and estimate their poses: the paper's Algorithm 1."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.detection import Detection, DetectionReport
from planegrasp.detector_config import DetectorConfig
from planegrasp.errors import InvalidInputError, LibraryError, PoseError, UnknownObjectError
from planegrasp.features import make_extractor
from planegrasp.features.oblique import FRONTAL, ObliqueConfig
from planegrasp.grouping import group_faces, observe, predicted_homography
from planegrasp.library import ObjectLibrary
from planegrasp.matching.index import NativeIndex, make_index
from planegrasp.pose import make_pose_estimator
from planegrasp.references import prepare_face
from planegrasp.search import FaceSearch, View
from planegrasp.stopwatch import StopWatch
from planegrasp.undistorted import Undistorted

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import FaceDetection, FaceReport
    from planegrasp.geometry import PinholeCamera
    from planegrasp.grouping import Found
    from planegrasp.matching.index import Look, ReferenceIndex, ReferenceSet
    from planegrasp.objects import ObjectModel
    from planegrasp.pose.base import PoseEstimate
    from planegrasp.references import FaceReference
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.search import Outcome

__all__ = ["Detector", "DetectorConfig"]

# A face that the first look found with fewer inliers is looked at closer, too, unless its grey
# values leave no doubt: few may be wrong.
_SURE = 12
# Of more faces than these, most are not there, and a look at some of their descriptors is in vain.
_FEW = 2
# Extractors whose features of oblique views recognise a face from the side.
_OBLIQUE = ("sift", "surf", "opencv-sift")


class Detector:
    """Finds the objects of a library in RGB-D frames.

    Features of the objects are extracted when the detector is made (or taken from the library's
    cache); objects added to the library later need `add`, or a new detector.

    Attributes:
        config: its settings.
        references: all faces it looks for.

    Raises:
        LibraryError: the library is empty.
        InvalidInputError: the configuration names something unknown, or two objects have one name.
    """

    config: DetectorConfig
    references: tuple[FaceReference, ...]
    _index: ReferenceIndex
    _search: FaceSearch
    _undistorted: Undistorted | None

    def __init__(
        self, library: ObjectLibrary | Iterable[ObjectModel], config: DetectorConfig | None = None
    ) -> None:
        self._configure(config)
        prepared = [face for model in library for face in self._prepared(model, library)]
        self._take(prepared)

    @classmethod
    def of(
        cls,
        prepared: Sequence[tuple[FaceReference, ReferenceSet]],
        config: DetectorConfig | None = None,
    ) -> Detector:
        """A detector of faces that another one of the same settings has prepared already."""
        detector = cls.__new__(cls)
        detector._configure(config)
        detector._take(prepared)
        return detector

    def prepared(self, model: ObjectModel) -> list[tuple[FaceReference, ReferenceSet]]:
        """An object's faces with their features, for `of`."""
        return list(self._prepared(model, ()))

    def add(self, model: ObjectModel) -> None:
        """Look for another object from the next frame on; the others stay as they are.

        Raises:
            InvalidInputError: an object has this name already, or the matcher cannot grow.
        """
        if any(reference.object.name == model.name for reference in self.references):
            raise InvalidInputError(f"two objects are called {model.name!r}")
        if not isinstance(self._index, NativeIndex):
            raise InvalidInputError("only the native matcher can grow: make a new detector")
        for reference, features in self._prepared(model, ()):
            self._index.add(features)
            self._search.add(reference, features)
            self.references = (*self.references, reference)

    @property
    def nbytes(self) -> int:
        """Bytes that the library occupies: descriptors, what is prepared of the images, images."""
        index = self._index.nbytes if isinstance(self._index, NativeIndex) else 0
        images = sum(reference.face.image.nbytes for reference in self.references)
        return index + self._search.nbytes + images

    def detect(
        self, frame: RGBDFrame, among: Iterable[str] | None = None, *, closely: bool = True
    ) -> list[Detection]:
        """All instances of all objects in a frame, best supported first.

        Args:
            frame: to look at.
            among: names of the objects to look for; all where None.
            closely: whether faces that a first look does not find for sure are looked at closer.
                That takes time wherever something is not there; without it some oblique and
                weakly textured faces are missed.

        Raises:
            UnknownObjectError: there is no object of such a name.
        """
        faces = None if among is None else self._faces_of(set(among))
        return list(self._run(frame, explain=False, among=faces, closely=closely).detections)

    def explain(self, frame: RGBDFrame) -> DetectionReport:
        """The detections of a frame, with the fate of every face of the library and the times."""
        return self._run(frame, explain=True)

    def _run(
        self,
        frame: RGBDFrame,
        *,
        explain: bool,
        among: NDArray[np.uint32] | None = None,
        closely: bool = True,
    ) -> DetectionReport:
        """Algorithm 1 of the paper, a line a stage."""
        watch = StopWatch()
        gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.uint8)
        features = self._extractor.extract(gray)
        watch.lap("extract")
        image_points = frame.camera.undistort(features.points)
        look = self._index.look(features, self.config.neighbours, among)
        watch.lap("match")
        evidence = self._search.evidence(look.candidates, features, image_points)
        flat = self._flat(gray, frame.camera)
        view = View(features, image_points, evidence, flat, frame.camera)
        outcomes = self._find(view, look.faces, explain=explain)
        watch.lap("homography")
        if closely:
            view = self._look_closer(view, look, outcomes, watch, explain=explain)
        faces = {face: outcome.found for face, outcome in outcomes.items() if outcome.found}
        detections = self._with_poses(faces, view, frame)
        watch.lap("pose")
        reports = self._reports(outcomes, look, detections) if explain else []
        return DetectionReport(tuple(detections), tuple(reports), watch.seconds)

    def _find(self, view: View, faces: NDArray[np.uint32], *, explain: bool) -> dict[int, Outcome]:
        return self._search.find(view, faces, self.config.max_instances, explain=explain)

    def _look_closer(
        self,
        view: View,
        look: Look,
        outcomes: dict[int, Outcome],
        watch: StopWatch,
        *,
        explain: bool,
    ) -> View:
        """Look at more descriptors of the faces that were not found for sure.

        Args:
            view: of the first look.
            look: what that gave.
            outcomes: of it; made better.
            watch: takes the times.
            explain: see `FaceSearch.find`.

        Returns:
            The view of the closest look that was taken.
        """
        unsure = look.faces
        for most in look.closer:
            sure = {f: o.found for f, o in outcomes.items() if _is_sure(o)}
            left = [face for face in unsure.tolist() if face not in sure]
            unsure = self._likeliest(left, view)
            if not len(unsure):
                break
            if len(unsure) > _FEW and most != look.closer[-1]:
                continue
            view = self._closer(view, sure, unsure, most)
            watch.lap("match")
            for face, outcome in self._find(view, unsure, explain=explain).items():
                if outcome.inliers >= outcomes.get(face, outcome).inliers:
                    outcomes[face] = outcome
            watch.lap("homography")
        return view

    def _reports(
        self, outcomes: dict[int, Outcome], look: Look, detections: Sequence[Detection]
    ) -> list[FaceReport]:
        """The fate of every face."""
        attempts = [r for _, outcome in sorted(outcomes.items()) for r in outcome.reports]
        reports = [_with_others(report, detections) for report in attempts]
        ignored = np.setdiff1d(np.arange(len(self.references)), look.faces)
        return reports + [self._search.not_proposed(int(face)) for face in ignored]

    def _faces_of(self, names: set[str]) -> NDArray[np.uint32]:
        """Numbers of the faces of some objects."""
        known = {reference.object.name for reference in self.references}
        if names - known:
            raise UnknownObjectError(
                f"there is no object {min(names - known)!r}; there are {', '.join(sorted(known))}"
            )
        numbers = [i for i, r in enumerate(self.references) if r.object.name in names]
        return np.array(numbers, dtype=np.uint32)

    def _likeliest(self, unsure: list[int], view: View) -> NDArray[np.uint32]:
        """Of the faces that a look left open those with most matches, ascending.

        Where there are more of them than a closer look is for, most are not in the frame.
        """
        most = self.config.closer_look
        if len(unsure) > most:
            matches = [len(self._search.matches(view.evidence, f, 0.8)) for f in unsure]
            best = np.argsort(matches, kind="stable")[::-1][:most]
            unsure = sorted(unsure[i] for i in best)
        return np.array(unsure, dtype=np.uint32)

    def _closer(
        self,
        view: View,
        found: dict[int, list[FaceDetection]],
        unsure: NDArray[np.uint32],
        most: int,
    ) -> View:
        """The features outside of the faces found for sure, with more references of the others."""
        rest = self._search.outside(found, view.image_points)
        features, image_points = view.features.select(rest), view.image_points[rest]
        candidates = self._index.look_closer(features, self.config.neighbours, unsure, most)
        evidence = self._search.evidence(candidates, features, image_points)
        return replace(view, features=features, image_points=image_points, evidence=evidence)

    def _with_poses(
        self, found: dict[int, list[FaceDetection]], view: View, frame: RGBDFrame
    ) -> list[Detection]:
        """Join the faces that one object shows in this frame, and estimate one pose for it."""
        groups: list[tuple[int, list[Found]]] = []
        for faces in self._faces_by_object(found):
            instances = group_faces(faces, self._pose, frame)
            instances.sort(key=_inliers, reverse=True)
            groups += enumerate(instances[: self.config.max_instances])
        poses = self._estimate([group for _, group in groups], frame)
        detections = [
            self._with_pose(instance, group, pose, view, frame)
            for (instance, group), pose in zip(groups, poses, strict=True)
        ]
        return sorted(detections, key=lambda d: -d.inliers)

    def _with_pose(
        self,
        instance: int,
        group: list[Found],
        pose: PoseEstimate | PoseError,
        view: View,
        frame: RGBDFrame,
    ) -> Detection:
        """One detection from faces that belong together, and from others that they point to."""
        model = group[0][0].object
        if not isinstance(pose, PoseError) and len(group) < len(model.faces):
            others = self._other_faces(group, pose, view)
            if others:
                group = [*group, *others]
                (pose,) = self._estimate([group], frame)
        shown = tuple(f for _, f in sorted(group, key=lambda pair: -pair[1].inliers))
        score = 1.0 - float(np.prod([1.0 - f.score for f in shown]))
        if isinstance(pose, PoseError):
            return Detection(model, instance, shown, score, None, str(pose))
        return Detection(model, instance, shown, score, pose)

    def _estimate(
        self, groups: Sequence[Sequence[Found]], frame: RGBDFrame
    ) -> list[PoseEstimate | PoseError]:
        """The pose of each group from its best supported face on, or why there is none."""
        ordered = (sorted(group, key=lambda pair: -pair[1].inliers) for group in groups)
        return self._pose.estimate_all([[observe(r, f) for r, f in g] for g in ordered], frame)

    def _other_faces(self, group: Sequence[Found], pose: PoseEstimate, view: View) -> list[Found]:
        """Faces of the object that were not found by themselves, where its pose puts them."""
        known = {f.name for _, f in group}
        others: list[Found] = []
        for index, reference in enumerate(self.references):
            if reference.object is not group[0][0].object or reference.face.name in known:
                continue
            predicted = predicted_homography(reference, pose.T_camera_object, view.camera)
            if predicted is None:
                continue
            detection = self._search.look_where(index, predicted, view)
            if detection is not None:
                others.append((reference, detection))
        return others

    def _faces_by_object(self, found: dict[int, list[FaceDetection]]) -> Iterator[list[Found]]:
        by_object: dict[str, list[Found]] = {}
        for face, detections in found.items():
            reference = self.references[face]
            for detection in detections:
                by_object.setdefault(reference.object.name, []).append((reference, detection))
        yield from by_object.values()

    def _flat(self, gray: NDArray[np.uint8], camera: PinholeCamera) -> NDArray[np.uint8]:
        """A grey image without lens distortion; the look-up stays for the camera's next frame."""
        undistorted = self._undistorted
        if undistorted is None or undistorted.camera != camera:
            undistorted = self._undistorted = Undistorted(camera)
        return undistorted.image(gray)

    def _configure(self, config: DetectorConfig | None) -> None:
        self.config = config or DetectorConfig()
        self._undistorted = None
        extractor, pose = self.config.extractor, self.config.pose
        self._extractor = make_extractor(extractor) if isinstance(extractor, str) else extractor
        self._pose = make_pose_estimator(pose) if isinstance(pose, str) else pose

    def _take(self, prepared: Sequence[tuple[FaceReference, ReferenceSet]]) -> None:
        """Index the faces of all objects."""
        if not prepared:
            raise LibraryError("the library is empty: teach an object first (`planegrasp teach`)")
        if not any(len(features.points) for _, features in prepared):
            raise LibraryError("no object of the library has features to be found by")
        by_name: dict[str, ObjectModel] = {}
        for reference, _ in prepared:
            if by_name.setdefault(reference.object.name, reference.object) is not reference.object:
                raise InvalidInputError(f"two objects are called {reference.object.name!r}")
        self.references = tuple(reference for reference, _ in prepared)
        self._index = make_index(
            [features for _, features in prepared],
            self.config.matcher,
            binary=self._extractor.is_binary,
            farthest=self._extractor.farthest,
            first=self.config.first_look,
        )
        self._search = FaceSearch(self.config.homography)
        for reference, features in prepared:
            self._search.add(reference, features)

    def _prepared(
        self, model: ObjectModel, library: ObjectLibrary | Iterable[ObjectModel]
    ) -> Iterator[tuple[FaceReference, ReferenceSet]]:
        """The faces of an object with their features, from a library's cache where there is one."""
        oblique = self.config.oblique
        if oblique is None:
            oblique = ObliqueConfig() if self._extractor.name in _OBLIQUE else FRONTAL
        cache = library.cache_dir(model.name) if isinstance(library, ObjectLibrary) else None
        for face in model.faces:
            yield prepare_face(
                model,
                face,
                self._extractor,
                oblique,
                pruning=self.config.pruning,
                longest_side=self.config.reference_side,
                same_place=self.config.same_place,
                cache=cache,
            )


def _is_sure(outcome: Outcome) -> bool:
    return outcome.is_evident or outcome.inliers >= _SURE


def _inliers(group: Sequence[Found]) -> int:
    return sum(face.inliers for _, face in group)


def _with_others(report: FaceReport, detections: Sequence[Detection]) -> FaceReport:
    """The report of a face; found, too, where only the object's other faces led to it."""
    if report.found:
        return report
    for detection in detections:
        for face in detection.faces:
            if (detection.name, face.name) == (report.object, report.face):
                figures = {
                    **{name: report.figures[name] for name in ("features", "matches")},
                    "inliers": float(face.inliers),
                    "coverage": face.coverage,
                    "agreement": face.agreement,
                }
                return replace(report, found=True, stage="found", reason="", figures=figures)
    return report
