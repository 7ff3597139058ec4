//! From a predicted pose to the pose that the frame shows.

use nalgebra::{Isometry3, Matrix3, Vector2};
use rayon::prelude::*;

use super::{Lost, Sight, TrackedFace, TrackedObject, TrackingConfig};
use crate::alignment::{Alignment, AlignmentWorkspace, align, align_from_afar, apply};
use crate::convex_hull::hull_area;
use crate::face::{Correspondence, Face};
use crate::fused;
use crate::{PoseError, PoseEstimate};

/// An alignment that agrees so well needs no second attempt from afar.
const GOOD_SCORE: f64 = 0.85;
/// Over at least this share of the tiles.
const GOOD_SHARE: f64 = 0.6;

/// A prediction may be off by so many pixels of the coarsest frame, each four of the frame's.
const SHIFT: u32 = 10;

/// One face where it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedFace {
    /// Its number among the object's faces.
    pub face: usize,
    /// From edge coordinates of the reference to undistorted pixels, scaled to H[2, 2] = 1.
    pub homography: Matrix3<f64>,
    /// Centres of the tiles that agree, in edge coordinates of the reference.
    pub points: Vec<Vector2<f64>>,
    /// Tiles of the face in the image.
    pub compared: usize,
    /// Mean correlation of those that agree.
    pub score: f64,
}

impl FollowedFace {
    /// Area of the convex hull of the tiles' centres [reference px²].
    pub fn hull_area(&self) -> f64 {
        hull_area(self.points.clone())
    }
}

/// An object where it is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// Its pose.
    pub estimate: PoseEstimate,
    /// The faces that it follows from, at least one.
    pub faces: Vec<FollowedFace>,
}

/// Follows several objects, which do not know of each other, from their predicted poses.
pub fn follow_each(
    objects: &[(&TrackedObject, Isometry3<f64>)],
    sight: &Sight<'_>,
    config: &TrackingConfig,
) -> Vec<Result<Followed, Lost>> {
    objects
        .par_iter()
        .map_init(AlignmentWorkspace::new, |workspace, (object, predicted)| {
            follow(object, predicted, sight, config, workspace)
        })
        .collect()
}

/// Follows one object from its predicted pose T_camera_object.
///
/// # Errors
/// Why it is not seen there: what its best face says.
pub fn follow(
    object: &TrackedObject,
    predicted: &Isometry3<f64>,
    sight: &Sight<'_>,
    config: &TrackingConfig,
    workspace: &mut AlignmentWorkspace,
) -> Result<Followed, Lost> {
    let mut seen = Vec::new();
    let mut reason = Lost::TurnedAway;
    let mut best_cosine = config.max_view_angle.cos();
    let least_cosine = best_cosine;
    for (number, face) in object.faces.iter().enumerate() {
        let cosine = face.cosine(predicted);
        if cosine.is_nan() || cosine < least_cosine {
            continue;
        }
        match look(number, face, predicted, sight, config, workspace) {
            Ok(found) => seen.push(found),
            Err(why) if cosine >= best_cosine => (reason, best_cosine) = (why, cosine),
            Err(_) => {}
        }
    }
    if seen.is_empty() {
        return Err(reason);
    }
    let estimate = pose(object, &seen, sight, config)?;
    Ok(Followed {
        estimate,
        faces: seen,
    })
}

/// Aligns one face and judges what is seen.
fn look(
    number: usize,
    face: &TrackedFace,
    predicted: &Isometry3<f64>,
    sight: &Sight<'_>,
    config: &TrackingConfig,
    workspace: &mut AlignmentWorkspace,
) -> Result<FollowedFace, Lost> {
    let start = face.homography(predicted, sight.camera);
    let side = shortest_side(face, &start).ok_or(Lost::TurnedAway)?;
    if side < config.min_side {
        let least = config.min_side;
        return Err(Lost::TooSmall { side, least });
    }
    let settings = &config.alignment;
    let reference = &face.alignment;
    let judged = |found: Option<Alignment>, workspace: &AlignmentWorkspace| {
        let points = workspace.agreeing().to_vec();
        found.map(|alignment| seen(number, alignment, points))
    };
    let direct = align(reference, &sight.gray, &start, settings, workspace);
    let mut best = judged(direct, workspace);
    if !best.as_ref().is_some_and(is_good) {
        let afar = align_from_afar(
            reference,
            &sight.gray,
            sight.coarse(),
            &start,
            SHIFT,
            settings,
            workspace,
        );
        let afar = judged(afar, workspace);
        if evidence(afar.as_ref()) > evidence(best.as_ref()) {
            best = afar;
        }
    }
    let least = config.min_tiles;
    let found = best.ok_or(Lost::Unlike {
        tiles: 0,
        compared: workspace.compared(),
        least,
    })?;
    check(&found, face, sight, config)?;
    Ok(found)
}

/// What an alignment says of a face.
fn seen(face: usize, alignment: Alignment, points: Vec<Vector2<f64>>) -> FollowedFace {
    let score = match alignment.accepted {
        true => alignment.score_after,
        false => alignment.score_before,
    };
    FollowedFace {
        face,
        homography: alignment.homography,
        points,
        compared: alignment.compared,
        score,
    }
}

fn share(found: &FollowedFace) -> f64 {
    found.points.len() as f64 / found.compared.max(1) as f64
}

fn is_good(found: &FollowedFace) -> bool {
    found.score >= GOOD_SCORE && share(found) >= GOOD_SHARE
}

/// What speaks for an alignment: how many tiles agree, and how well.
fn evidence(found: Option<&FollowedFace>) -> f64 {
    found.map_or(-1.0, |found| found.points.len() as f64 * found.score)
}

fn check(
    found: &FollowedFace,
    face: &TrackedFace,
    sight: &Sight<'_>,
    config: &TrackingConfig,
) -> Result<(), Lost> {
    let (tiles, compared) = (found.points.len(), found.compared);
    if compared < config.min_tiles {
        return Err(Lost::OutsideImage {
            tiles: compared,
            least: config.min_tiles,
        });
    }
    let needed = (config.min_share * compared as f64).ceil() as usize;
    let least = needed.max(config.min_tiles);
    if tiles < least {
        return Err(Lost::Unlike {
            tiles,
            compared,
            least,
        });
    }
    if found.score < config.min_score {
        return Err(Lost::Faint {
            score: found.score,
            least: config.min_score,
        });
    }
    let stretch = face.stretch(&found.homography, sight.camera);
    if stretch > config.max_stretch {
        return Err(Lost::Bent {
            stretch,
            most: config.max_stretch,
        });
    }
    Ok(())
}

/// The pose that all faces agree with.
fn pose(
    object: &TrackedObject,
    seen: &[FollowedFace],
    sight: &Sight<'_>,
    config: &TrackingConfig,
) -> Result<PoseEstimate, PoseError> {
    let faces = seen
        .iter()
        .map(|found| observed(&object.faces[found.face], found))
        .collect::<Result<Vec<Face>, PoseError>>()?;
    fused::estimate(&faces, sight.camera, sight.depth.as_ref(), &config.pose)
}

/// The tiles that agree as correspondences, where the alignment puts them.
fn observed(face: &TrackedFace, found: &FollowedFace) -> Result<Face, PoseError> {
    let points = found
        .points
        .iter()
        .map(|&edge| Correspondence {
            face: apply(&face.face_from_edge, edge),
            image: apply(&found.homography, edge),
        })
        .collect();
    let edge_from_face = face
        .face_from_edge
        .try_inverse()
        .ok_or(PoseError::Undetermined)?;
    Face::new(
        face.T_object_face,
        face.size,
        points,
        found.homography * edge_from_face,
    )
}

/// Shortest side of the outline [px]; `None` where a corner lies behind the camera.
fn shortest_side(face: &TrackedFace, H: &Matrix3<f64>) -> Option<f64> {
    let (w, h) = (face.alignment.width(), face.alignment.height());
    let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
    let mapped = corners.map(|[x, y]| H * Vector2::new(x, y).push(1.0));
    if !mapped.iter().all(|p| p.z > 0.0) {
        return None;
    }
    let outline = mapped.map(|p| p.xy() / p.z);
    let sides = (0..4).map(|i| (outline[(i + 1) % 4] - outline[i]).norm());
    Some(sides.fold(f64::INFINITY, f64::min))
}
