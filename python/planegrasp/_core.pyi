"""The compiled arithmetic. Arrays are float64 and C-contiguous unless said otherwise.

Functions raise `planegrasp.errors.InvalidInputError` for arguments that cannot be worked with and
`planegrasp.errors.PoseError` where there is no pose, and release the interpreter's lock.
"""

from collections.abc import Callable, Sequence
from typing import TypedDict, final

import numpy as np
from numpy.typing import NDArray

from planegrasp.errors import PoseError

__version__: str

@final
class AlignmentSettings:
    """Checked settings of alignment, as in `planegrasp.alignment.AlignmentConfig`."""

    def __new__(
        cls,
        *,
        max_tiles: int,
        min_tiles: int,
        min_correlation: float,
        max_motion: float,
        start_sigma: float,
        displacement_floor: float,
        max_iterations: int,
    ) -> AlignmentSettings: ...
    @staticmethod
    def defaults() -> dict[str, float]: ...

@final
class AlignmentReference:
    """A reference image (H×W uint8, at least 8 px a side) prepared for alignment."""

    def __new__(cls, gray: NDArray[np.uint8]) -> AlignmentReference: ...
    @property
    def bytes(self) -> int: ...
    def align(
        self, frame: NDArray[np.uint8], start: NDArray[np.float64], settings: AlignmentSettings
    ) -> Alignment | None:
        """Refine a homography (3×3, reference edges to pixels) on an undistorted H×W frame.

        Returns:
            None where the start shows no front of the reference, or too little of its texture.
        """

@final
class Alignment:
    """Where an alignment ended, as in `planegrasp.alignment.Alignment`."""

    @property
    def homography(self) -> NDArray[np.float64]: ...
    @property
    def score_before(self) -> float: ...
    @property
    def score_after(self) -> float: ...
    @property
    def accepted(self) -> bool: ...
    @property
    def iterations(self) -> int: ...
    @property
    def tiles(self) -> int: ...
    @property
    def compared(self) -> int: ...
    @property
    def information(self) -> NDArray[np.float64]: ...

@final
class Camera:
    """Intrinsics [px]; `distortion` is (k1, k2, p1, p2, k3)."""

    def __new__(
        cls,
        width: int,
        height: int,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        distortion: Sequence[float],
    ) -> Camera: ...

@final
class Face:
    """The evidence for one face, as in `planegrasp.pose.FaceObservation`."""

    def __new__(
        cls,
        T_object_face: NDArray[np.float64],
        width: float,
        height: float,
        face_points: NDArray[np.float64],
        image_points: NDArray[np.float64],
        homography: NDArray[np.float64],
    ) -> Face: ...

@final
class Estimate:
    """A pose with its quality, as in `planegrasp.pose.PoseEstimate`; transforms are 4×4."""

    @property
    def T_camera_object(self) -> NDArray[np.float64]: ...
    @property
    def covariance(self) -> NDArray[np.float64] | None: ...
    @property
    def noise_covariance(self) -> NDArray[np.float64] | None: ...
    @property
    def ambiguous(self) -> bool: ...
    @property
    def alternative(self) -> NDArray[np.float64] | None: ...
    @property
    def reprojection_rms(self) -> float: ...
    @property
    def depth_pixels(self) -> int: ...

@final
class PnPSettings:
    """Checked settings of `pnp`, as in `planegrasp.pose.PnPConfig`."""

    def __new__(
        cls,
        *,
        pixel_sigma: float | None,
        pixel_sigma_floor: float,
        size_sigma: float,
        ambiguity_odds: float,
    ) -> PnPSettings: ...
    @staticmethod
    def defaults() -> dict[str, float | None]: ...

@final
class FusedSettings:
    """Checked settings of `fused`, as in `planegrasp.pose.FusedConfig`."""

    def __new__(
        cls,
        *,
        pixel_sigma: float | None,
        pixel_sigma_floor: float,
        size_sigma: float,
        ambiguity_odds: float,
        depth_sigma: float | None,
        depth_sigma_floor: float,
        depth_bias_sigma: float,
        correlation_area: float,
        depth_gate: float,
        erosion: float,
        max_depth_pixels: int,
        min_depth_pixels: int,
        max_view_angle: float,
    ) -> FusedSettings: ...
    @staticmethod
    def defaults() -> dict[str, float | None]: ...

@final
class SearchSettings:
    """Settings of `FaceSearch`, as in `planegrasp.homography.HomographyConfig`."""

    def __new__(
        cls,
        *,
        min_matches: int,
        max_ratio: float,
        max_loose_ratio: float,
        threshold: float,
        iterations: int,
        min_inliers: int,
        min_coverage: float,
        min_side: float,
        max_stretch: float,
        aspect_sigma: float,
        min_agreement: float,
        min_doubtful_tiles: float,
    ) -> SearchSettings: ...

@final
class Appearance:
    """What a face looks like (h×w uint8 reference image), for comparison with a frame."""

    def __new__(cls, gray: NDArray[np.uint8]) -> Appearance: ...
    def agreement(self, frame: NDArray[np.uint8], homography: NDArray[np.float64]) -> float:
        """Share of the reference's textured cells that the frame shows, 0 … 1.

        Cells are compared by normalised cross-correlation, so lighting does not matter; a cell
        that is hidden or outside of the image counts as not seen.

        Args:
            frame: H×W undistorted frame.
            homography: reference edge coordinates to undistorted pixels.
        """

@final
class Evidence:
    """The candidates of one frame, sorted by face; made by `FaceSearch.evidence`."""

    def __len__(self) -> int:
        """Number of features of the frame."""

@final
class Matches:
    """n matches of a frame's features with one face.

    Attributes:
        query: n indices into the frame's features.
        reference_points: n×2, reference image in edge coordinates.
        image_points: n×2, frame in undistorted pixels.
        ratio: n, distance over the distance of the nearest descriptor elsewhere; small is good.
    """

    def __len__(self) -> int: ...
    @property
    def query(self) -> NDArray[np.uint32]: ...
    @property
    def reference_points(self) -> NDArray[np.float64]: ...
    @property
    def image_points(self) -> NDArray[np.float64]: ...
    @property
    def ratio(self) -> NDArray[np.float64]: ...

@final
class HomographyEstimate:
    """A 3×3 homography from reference edge coordinates to undistorted pixels, not verified."""

    @property
    def matrix(self) -> NDArray[np.float64]: ...
    @property
    def inliers(self) -> Matches: ...

@final
class FoundFace:
    """A verified face; `outline` is 4×2 undistorted pixels, top-left first, then clockwise."""

    @property
    def homography(self) -> NDArray[np.float64]: ...
    @property
    def matched_homography(self) -> NDArray[np.float64]: ...
    @property
    def is_aligned(self) -> bool: ...
    @property
    def outline(self) -> NDArray[np.float64]: ...
    @property
    def inliers(self) -> Matches: ...
    @property
    def coverage(self) -> float: ...
    @property
    def agreement(self) -> float: ...
    @property
    def is_evident(self) -> bool: ...

@final
class Attempt:
    """One attempt at one face, as in `planegrasp.detection.FaceReport`."""

    @property
    def face(self) -> int: ...
    @property
    def instance(self) -> int: ...
    @property
    def stage(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def found(self) -> FoundFace | None: ...
    @property
    def figures(self) -> dict[str, float]: ...

@final
class FaceSearch:
    """Finds the faces that were added to it, see `planegrasp.search.FaceSearch`."""

    def __new__(cls, settings: SearchSettings) -> FaceSearch: ...
    def __len__(self) -> int: ...
    @property
    def nbytes(self) -> int:
        """Bytes that the faces occupy."""

    def add(
        self,
        face_from_edge: NDArray[np.float64],
        points: NDArray[np.float32],
        frames: NDArray[np.float32],
        gray: NDArray[np.uint8],
    ) -> None:
        """Add a face, which gets the next number.

        Args:
            face_from_edge: 3×3, edge coordinates of the reference image to metres on the face.
            points: M×2 keypoints in edge coordinates, in the order of the index.
            frames: M×2×2, from each keypoint's own frame to the reference image.
            gray: h×w reference image.
        """

    def evidence(
        self,
        face: NDArray[np.int32],
        reference: NDArray[np.int32],
        ratio: NDArray[np.float32],
        image_points: NDArray[np.float64],
        scales: NDArray[np.float32],
        angles: NDArray[np.float32],
    ) -> Evidence:
        """Sort the candidates (N×k, -1 = none) of a frame's N features by face."""

    def find(
        self,
        evidence: Evidence,
        gray: NDArray[np.uint8],
        camera: Camera,
        *,
        among: NDArray[np.uint32],
        max_instances: int,
        refused: bool = True,
    ) -> list[Attempt]:
        """Find every instance of the faces numbered in `among`.

        `refused` asks for the failed attempts, too.
        """

    def look_where(
        self,
        number: int,
        predicted: NDArray[np.float64],
        evidence: Evidence,
        gray: NDArray[np.uint8],
        camera: Camera,
    ) -> FoundFace | None:
        """Verify one face where a homography predicts it."""

    def matches(self, evidence: Evidence, number: int, max_ratio: float) -> Matches:
        """Matches with one face that pass a ratio test."""

    def hypotheses(
        self, evidence: Evidence, number: int, camera: Camera
    ) -> list[HomographyEstimate]:
        """Homographies of one face that would be verified, in their order."""

    def refine(
        self, start: NDArray[np.float64], evidence: Evidence, number: int, camera: Camera
    ) -> HomographyEstimate | None:
        """A homography refined over all matches that agree with it, or None."""

def three_point(
    faces: Sequence[Face], camera: Camera, depth: NDArray[np.float32] | None
) -> Estimate:
    """Pose of the first face from three depth look-ups; `depth` is H×W float32 metres."""

def pnp(faces: Sequence[Face], camera: Camera, settings: PnPSettings) -> Estimate:
    """Pose from the correspondences of all faces."""

def fused(
    objects: Sequence[Sequence[Face]],
    camera: Camera,
    depth: NDArray[np.float32] | None,
    settings: FusedSettings,
) -> list[Estimate | PoseError]:
    """Pose of each object from the correspondences and the depth (H×W float32 metres) of its faces.

    Returns:
        An estimate each, or the error that says why there is none.
    """

@final
class ReferenceIndex:
    """One index over the descriptors of all faces; grows and shrinks by a face at a time.

    Args:
        length: bytes of a descriptor.
        is_binary: compare bit strings by the number of differing bits, not bytes by L2.
        farthest: only references nearer than this are neighbours; infinite = all.
    """

    def __new__(cls, length: int, *, is_binary: bool, farthest: float = ...) -> ReferenceIndex: ...
    def __len__(self) -> int:
        """Number of faces that were added, those that were removed too."""

    @property
    def nbytes(self) -> int:
        """Bytes that it occupies."""

    def add(
        self,
        points: NDArray[np.float32],
        frames: NDArray[np.float32],
        descriptors: NDArray[np.uint8],
        radius: float,
        signs: NDArray[np.int8] | None = None,
    ) -> int:
        """Add a face (N×2, N×2×2, N×length, N; see `planegrasp.matching.ReferenceSet`).

        Returns:
            Its number: the next one, counting those that were removed.
        """

    def remove(self, face: int) -> None:
        """Remove a face. The others keep their numbers."""

    def propose(
        self,
        descriptors: NDArray[np.uint8],
        points: NDArray[np.float32],
        scales: NDArray[np.float32],
        angles: NDArray[np.float32],
        *,
        among: NDArray[np.uint32] | None = None,
    ) -> NDArray[np.uint32]:
        """Numbers of the faces worth looking at for these descriptors, ascending.

        Those are all where they are few. Of many they are those that several descriptors put at the
        same place, perhaps none.

        Args:
            descriptors: N×length.
            points: N×2, their keypoints [px]; lens distortion does not matter.
            scales: N, of the keypoints.
            angles: N, likewise [rad].
            among: numbers of the faces that are asked for; None = all.
        """

    def candidates(
        self,
        descriptors: NDArray[np.uint8],
        k: int,
        *,
        among: NDArray[np.uint32],
        first: NDArray[np.uint32] | None = None,
        signs: NDArray[np.int8] | None = None,
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
        """The k nearest references of each descriptor (N×length), nearest first.

        Args:
            descriptors: N×length.
            k: at least 1.
            among: numbers of the faces to look at.
            first: how many descriptors of each of them to look at, those of a sign rounded up to
                whole blocks of 32; None = all.
            signs: N, -1, 0 or 1; only references of a query's sign are looked at. None = all 0.

        Returns:
            N×k numbers of faces and N×k numbers within the face, -1 for none; N×k distances (L2
            of bytes, or differing bits), infinite for none; and N ratios: nearest distance over
            that of the nearest elsewhere, 0 where nothing is elsewhere, infinite without any;
            where the nearest elsewhere is beyond the farthest distance, the nearest over that.

        Raises:
            InvalidInputError: for another length or number, k = 0, another sign, or `first` that
                is not as long as `among`.
        """

def by_usefulness(
    descriptors: int,
    descriptor: NDArray[np.uint32],
    feature: NDArray[np.uint32],
    view: NDArray[np.uint32],
) -> NDArray[np.uint32]:
    """Order descriptors by greedy maximum coverage of the features that they serve.

    Args:
        descriptors: how many there are.
        descriptor: P, of each pair of a descriptor with a feature that it serves.
        feature: P, of each pair.
        view: of each feature; a view with few features counts as much as one with many.

    Returns:
        Descriptors, the most useful first; those that serve nothing are left out.
    """

def planar_poses(face: Face, camera: Camera) -> list[NDArray[np.float64]]:
    """Both planar solutions T_camera_face (4×4) before refinement, the better one first."""

def fit_plane(
    rays: NDArray[np.float64], inverse_depth: NDArray[np.float64]
) -> tuple[tuple[float, float, float], float] | None:
    """Robust plane (a, b, c), 1/z = (a, b, c) · ray, and its residuals' standard deviation [1/m].

    Least median of squares, then Tukey's biweight: up to half of the pixels may show something
    else.

    Args:
        rays: N×3, viewing rays with z = 1.
        inverse_depth: N, [1/m].

    Returns:
        The plane and the deviation, or None where the pixels span no plane.

    Raises:
        InvalidInputError: for other shapes.
    """

def estimate_homography(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    *,
    threshold: float,
    max_iterations: int,
    seed: int = 0,
) -> tuple[NDArray[np.float64], int] | None:
    """Homography (3×3, source to target) that most matches agree with, and how many do.

    Args:
        source: N×2, the likeliest matches first: they are sampled first.
        target: N×2.
        threshold: largest distance from where the homography puts a point [target unit].
        max_iterations: of the random sampling.
        seed: of the random sampling.

    Returns:
        The homography and the number of inliers, or None where no four matches give one.

    Raises:
        InvalidInputError: for other shapes, values that are not finite, or a threshold ≤ 0.
    """

def refine_homography(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    start: NDArray[np.float64],
    scale: float,
) -> NDArray[np.float64] | None:
    """A homography refined on all matches (N×2 each) under Cauchy's loss of this scale.

    Returns:
        3×3, or None where the matches determine none.

    Raises:
        InvalidInputError: for other shapes, or a scale ≤ 0.
    """

class SiftSettings(TypedDict):
    """Settings of `Sift` by name."""

    max_features: int
    octave_layers: int
    contrast_threshold: float
    edge_threshold: float
    sigma: float
    double_first_octave: bool

@final
class Sift:
    """Extractor behind `planegrasp.features.SIFT`; `threads` = 0 takes all of the machine."""

    def __new__(
        cls,
        *,
        max_features: int,
        octave_layers: int,
        contrast_threshold: float,
        edge_threshold: float,
        sigma: float,
        double_first_octave: bool,
        threads: int,
    ) -> Sift: ...
    @staticmethod
    def defaults() -> SiftSettings: ...
    def extract(
        self, image: NDArray[np.uint8]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.uint8],
        NDArray[np.int8],
    ]:
        """Points N×2, scales, angles, responses, descriptors N×128 and signs of an H×W image."""

@final
class Surf:
    """SURF with its working memory, settings as in `planegrasp.features.SURFConfig`.

    Raises InvalidInputError for a setting outside of its range.
    """

    def __new__(
        cls,
        *,
        hessian_threshold: float,
        octaves: int,
        octave_layers: int,
        extended: bool,
        upright: bool,
        max_features: int,
    ) -> Surf: ...
    def extract(
        self, image: NDArray[np.uint8]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.uint8],
    ]:
        """Points (N×2), scales, angles, responses (N each), descriptors (N×D) of an H×W image."""

@final
class FollowSettings:
    """Checked settings of `Follower`, as in `planegrasp.tracking.FollowConfig`."""

    def __new__(
        cls,
        *,
        min_tiles: int,
        min_share: float,
        min_score: float,
        max_stretch: float,
        min_side: float,
        max_view_angle: float,
        alignment: AlignmentSettings,
        pose: FusedSettings,
    ) -> FollowSettings: ...

@final
class TrackedObject:
    """What is kept of an object to follow it; without faces at first."""

    def __new__(cls) -> TrackedObject: ...
    def add(
        self,
        gray: NDArray[np.uint8],
        face_from_edge: NDArray[np.float64],
        T_object_face: NDArray[np.float64],
        width: float,
        height: float,
    ) -> None:
        """Add a face: its H×W reference, and where it is; it gets the next number."""

@final
class FollowedFace:
    """A face where it is seen: N tiles that agree with the reference, in both images."""

    @property
    def face(self) -> int: ...
    @property
    def homography(self) -> NDArray[np.float64]: ...
    @property
    def reference_points(self) -> NDArray[np.float64]: ...
    @property
    def image_points(self) -> NDArray[np.float64]: ...
    @property
    def hull_area(self) -> float: ...
    @property
    def compared(self) -> int: ...
    @property
    def score(self) -> float: ...

@final
class Followed:
    """An object where it is seen."""

    @property
    def estimate(self) -> Estimate: ...
    @property
    def faces(self) -> list[FollowedFace]: ...

@final
class Follower:
    """Follows objects from frame to frame, on threads of its own."""

    def __new__(cls, settings: FollowSettings) -> Follower: ...
    def follow(
        self,
        objects: Sequence[TrackedObject],
        predicted: Sequence[NDArray[np.float64]],
        gray: NDArray[np.uint8],
        depth: NDArray[np.float32] | None,
        camera: Camera,
    ) -> list[Followed | str]:
        """Follow objects from their predicted T_camera_object (4×4) into an undistorted frame.

        Returns:
            For each of them where it is seen, or in words why it is not.
        """

@final
class PoseFilterSettings:
    """Checked settings, as in `planegrasp.pose_filter.PoseFilterConfig`."""

    def __new__(
        cls,
        *,
        linear_acceleration: float,
        angular_acceleration: float,
        linear_speed: float,
        angular_speed: float,
        tremor: float,
        angular_tremor: float,
        gate: float,
    ) -> PoseFilterSettings: ...

@final
class FilteredPose:
    """Pose and velocity at one time, as in `planegrasp.pose_filter.FilteredPose`."""

    def __new__(
        cls,
        time: float,
        T_base_object: NDArray[np.float64],
        linear_velocity: NDArray[np.float64],
        angular_velocity: NDArray[np.float64],
        covariance: NDArray[np.float64],
    ) -> FilteredPose: ...
    @staticmethod
    def first(
        time: float,
        T_base_object: NDArray[np.float64],
        covariance: NDArray[np.float64],
        settings: PoseFilterSettings,
    ) -> FilteredPose: ...
    def predicted(self, time: float, settings: PoseFilterSettings) -> FilteredPose: ...
    def corrected(
        self,
        T_base_object: NDArray[np.float64],
        covariance: NDArray[np.float64],
        settings: PoseFilterSettings,
    ) -> FilteredPose | None: ...
    @property
    def time(self) -> float: ...
    @property
    def T_base_object(self) -> NDArray[np.float64]: ...
    @property
    def linear_velocity(self) -> NDArray[np.float64]: ...
    @property
    def angular_velocity(self) -> NDArray[np.float64]: ...
    @property
    def covariance(self) -> NDArray[np.float64]: ...

@final
class MotionSettings:
    """Checked settings, as in `planegrasp.tracking.MotionFilterConfig`."""

    def __new__(
        cls,
        *,
        moving: PoseFilterSettings,
        creep: float,
        angular_creep: float,
        still_for: float,
        moving_for: float,
    ) -> MotionSettings: ...

@final
class MotionState:
    """Something that stands still or moves, at one time: both hypotheses with their probability."""

    @staticmethod
    def first(
        time: float,
        T_base_object: NDArray[np.float64],
        covariance: NDArray[np.float64],
        settings: MotionSettings,
    ) -> MotionState: ...
    def predicted(self, time: float, settings: MotionSettings) -> MotionState: ...
    def measured(
        self,
        time: float,
        T_base_object: NDArray[np.float64],
        covariance: NDArray[np.float64],
        settings: MotionSettings,
    ) -> MotionState | None: ...
    @property
    def time(self) -> float: ...
    @property
    def moves(self) -> float: ...
    @property
    def pose(self) -> FilteredPose: ...

class ThreadPool:
    """Threads apart from those of others, for the thread that makes it.

    What that thread starts in parallel is done by these, and by itself. They end with the object.

    Raises:
        RuntimeError: the thread has some already, as the one that imported planegrasp has.
    """

    def __init__(self, begin: Callable[[], object]) -> None:
        """As many as the machine has, the calling one included; `begin` is called in each."""
