//! Typed errors: what was wrong, with what value, and what would be right.

use thiserror::Error;

/// An argument that cannot be worked with.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum InputError {
    /// A value is NaN or infinite.
    #[error("{what} must be finite")]
    NotFinite {
        /// Which argument.
        what: &'static str,
    },
    /// A parameter lies outside of its range.
    #[error("{name} must be {valid}, got {value}")]
    OutOfRange {
        /// Name of the parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would be right.
        valid: &'static str,
    },
    /// A 4×4 matrix is not a rigid transform.
    #[error(
        "{what} must be a rigid transform: R·Rᵀ or the last row deviates by {deviation:.3e}, \
         determinant {determinant:.3}"
    )]
    NotRigid {
        /// Which argument.
        what: &'static str,
        /// Largest deviation from a rigid transform.
        deviation: f64,
        /// Determinant of the upper left 3×3.
        determinant: f64,
    },
    /// Face points and image points do not pair up.
    #[error("face points and image points must pair up, got {face} and {image}")]
    PointCount {
        /// Number of face points.
        face: usize,
        /// Number of image points.
        image: usize,
    },
    /// The depth image does not have the camera's size.
    #[error(
        "depth must be {expected_width}×{expected_height} like the camera, got {width}×{height} \
         ({values} values)"
    )]
    DepthSize {
        /// Width of the depth image [px].
        width: usize,
        /// Height of the depth image [px].
        height: usize,
        /// Number of values given.
        values: usize,
        /// Width of the camera's image [px].
        expected_width: usize,
        /// Height of the camera's image [px].
        expected_height: usize,
    },
    /// No face was given.
    #[error("a pose needs at least one face, got none")]
    NoFaces,
    /// There is not one frame for each keypoint.
    #[error("each keypoint needs a frame, got {points} and {frames}")]
    FrameCount {
        /// Number of keypoints.
        points: usize,
        /// Number of frames.
        frames: usize,
    },
    /// There is not one sign for each descriptor.
    #[error("each descriptor needs a sign, got {descriptors} descriptors and {signs} signs")]
    SignCount {
        /// Number of descriptors.
        descriptors: usize,
        /// Number of signs.
        signs: usize,
    },
    /// Candidates do not fit the features that they are of.
    #[error(
        "{features} features need {k} candidates (at least one) and a ratio, a scale and an angle \
         each, got {candidates} candidates in all"
    )]
    CandidateCount {
        /// Number of features.
        features: usize,
        /// Candidates a feature.
        k: usize,
        /// Candidates given.
        candidates: usize,
    },
    /// A matrix has no inverse.
    #[error("{what} has no inverse")]
    NotInvertible {
        /// Which argument.
        what: &'static str,
    },
    /// An image has not as many pixels as its size says.
    #[error("an image of {width}×{height} has {} pixels, got {pixels}", width * height)]
    ImageSize {
        /// Width [px].
        width: usize,
        /// Height [px].
        height: usize,
        /// Number of pixels given.
        pixels: usize,
    },
    /// A face's descriptors are not as long as the index's.
    #[error("the index holds descriptors of {expected} bytes, got some of {length}")]
    DescriptorLength {
        /// Bytes of each descriptor given.
        length: usize,
        /// Bytes of the index's descriptors.
        expected: usize,
    },
    /// No face of an index has this number.
    #[error("face {face} is not in the index, to which {count} faces were added")]
    NoSuchFace {
        /// The number given.
        face: usize,
        /// How many faces were added.
        count: usize,
    },
    /// Descriptors do not fill whole rows, or there is not one for each point.
    #[error(
        "{points} keypoints need {points} descriptors of {length} bytes, got {bytes} bytes in all"
    )]
    DescriptorCount {
        /// Number of keypoints.
        points: usize,
        /// Bytes of one descriptor.
        length: usize,
        /// Bytes given.
        bytes: usize,
    },
    /// A filter was asked for the past.
    #[error("a pose filter only goes forward in time: it is at {state:?} s, got {time:?} s")]
    BackInTime {
        /// Time of its state [s].
        state: f64,
        /// Time asked for [s].
        time: f64,
    },
    /// One predicted pose an object.
    #[error("there must be one predicted pose an object, got {poses} for {objects}")]
    PoseCount {
        /// Objects given.
        objects: usize,
        /// Poses given.
        poses: usize,
    },
}

/// Why there is no pose.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PoseError {
    /// An argument cannot be worked with.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Fewer correspondences than a pose needs.
    #[error("a pose needs at least {needed} correspondences on one face, got {found}")]
    TooFewPoints {
        /// How many there are.
        found: usize,
        /// How many there must be.
        needed: usize,
    },
    /// The correspondences lie on a line, about which the pose is undetermined.
    #[error(
        "the correspondences lie on a line: they spread {narrow:.3e} m across and {wide:.3e} m \
         along it"
    )]
    Collinear {
        /// Standard deviation of the face points across their main direction [m].
        narrow: f64,
        /// Standard deviation along it [m].
        wide: f64,
    },
    /// The homography shows the face from behind.
    #[error("the homography mirrors the face (determinant {determinant:.3e}): seen from behind")]
    Mirrored {
        /// Determinant of the homography, scaled so that the face's centre has positive depth.
        determinant: f64,
    },
    /// The homography puts part of the face behind the camera.
    #[error("the homography puts a corner of the face behind the camera")]
    BehindCamera,
    /// A point that the method looks up lies outside of the image.
    #[error("the {point} projects to ({u:.1}, {v:.1}), outside of the {width}×{height} image")]
    OutsideImage {
        /// "centre", "right edge" or "top edge".
        point: &'static str,
        /// Observed pixel column.
        u: f64,
        /// Observed pixel row.
        v: f64,
        /// Image width [px].
        width: usize,
        /// Image height [px].
        height: usize,
    },
    /// A point that the method looks up has no depth.
    #[error("no depth at the {point}, pixel ({u}, {v})")]
    NoDepth {
        /// "centre", "right edge" or "top edge".
        point: &'static str,
        /// Pixel column.
        u: usize,
        /// Pixel row.
        v: usize,
    },
    /// The three looked-up points lie on a line.
    #[error("the three looked-up points lie on a line, which spans no plane")]
    DegenerateTriangle,
    /// The frame has no depth image, and the method needs one.
    #[error("the frame has no depth image, which the three-point method needs")]
    DepthRequired,
    /// Refinement found no well-determined minimum.
    #[error("the correspondences do not determine a pose: refinement found no minimum")]
    Undetermined,
}
