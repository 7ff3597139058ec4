//! The search for faces in any candidates.
#![no_main]
#![allow(non_snake_case)]

use arbitrary::{Arbitrary, Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use nalgebra::Matrix3;
use planegrasp_core::Camera;
use planegrasp_core::face_search::{
    Evidence, ImageFeatures, SearchSettings, SearchedFace, View, find, look_where,
};
use planegrasp_core::matching::{Candidates, NONE};
use planegrasp_fuzz::{Homography, Number, Picture};

const FACES: u32 = 2;

#[derive(Debug, Arbitrary)]
struct Settings {
    min_matches: u8,
    max_ratio: Number,
    max_loose_ratio: Number,
    threshold: Number,
    iterations: u8,
    min_inliers: u8,
    min_coverage: Number,
    min_side: Number,
    max_stretch: Number,
    aspect_sigma: Number,
    min_agreement: Number,
    min_doubtful_tiles: Number,
}

impl Settings {
    fn core(&self) -> SearchSettings {
        SearchSettings {
            min_matches: self.min_matches.into(),
            max_ratio: self.max_ratio.0,
            max_loose_ratio: self.max_loose_ratio.0,
            threshold: self.threshold.0,
            iterations: self.iterations.into(),
            min_inliers: self.min_inliers.into(),
            min_coverage: self.min_coverage.0,
            min_side: self.min_side.0,
            max_stretch: self.max_stretch.0,
            aspect_sigma: self.aspect_sigma.0,
            min_agreement: self.min_agreement.0,
            min_doubtful_tiles: self.min_doubtful_tiles.0,
        }
    }
}

/// Settings that let many homographies through all checks.
const LENIENT: SearchSettings = SearchSettings {
    min_matches: 4,
    max_ratio: 1.0,
    max_loose_ratio: 1.0,
    threshold: 3.0,
    iterations: 200,
    min_inliers: 4,
    min_coverage: 0.0,
    min_side: 1.0,
    max_stretch: 20.0,
    aspect_sigma: 0.1,
    min_agreement: 0.0,
    min_doubtful_tiles: 0.0,
};

fuzz_target!(|bytes: &[u8]| {
    let _ = run(&mut Unstructured::new(bytes));
});

fn run(u: &mut Unstructured<'_>) -> Result<()> {
    let settings = match u.ratio(3, 4)? {
        true => LENIENT,
        false => u.arbitrary::<Settings>()?.core(),
    };
    let (width, height) = (u.int_in_range(1..=80)?, u.int_in_range(1..=60)?);
    let [fx, fy, cx, cy]: [Number; 4] = match u.ratio(3, 4)? {
        true => [60.0, 60.0, 39.5, 29.5].map(Number),
        false => u.arbitrary()?,
    };
    let Ok(camera) = Camera::new((width, height), (fx.0, fy.0), (cx.0, cy.0), [0.0; 5]) else {
        return Ok(());
    };
    let frame = Picture::of_size(u, width, height)?;
    let mut faces = Vec::new();
    for _ in 0..FACES {
        match face(u)? {
            Some(face) => faces.push(face),
            None => return Ok(()),
        }
    }
    let H = u.arbitrary::<Homography>()?.0;
    let (candidates, features) = candidates(u, &faces, &H)?;
    let Ok(evidence) = Evidence::new(&candidates, features, faces.len()) else {
        return Ok(());
    };
    let view = View {
        evidence: &evidence,
        gray: frame.gray(),
        camera: &camera,
    };
    for attempt in find(&faces, &[1, 0, 7], &view, &settings, 3) {
        if let Ok(found) = attempt.outcome {
            assert!(found.homography.iter().all(|v| v.is_finite()));
            assert!((0.0..=1.0).contains(&found.agreement));
        }
    }
    look_where(0, &faces[0], &H, &view, &settings);
    Ok(())
}

/// A face with up to 40 keypoints.
fn face(u: &mut Unstructured<'_>) -> Result<Option<SearchedFace>> {
    let picture: Picture = u.arbitrary()?;
    let gray = picture.gray();
    let metric = match u.ratio(3, 4)? {
        true => Matrix3::new(1e-3, 0.0, -0.03, 0.0, -1e-3, 0.03, 0.0, 0.0, 1.0),
        false => u.arbitrary::<Homography>()?.0,
    };
    let count = u.int_in_range(0..=40)?;
    let (mut points, mut frames) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let point: [f64; 2] = Number::pair(u.arbitrary()?);
        points.push(point.map(|v| v as f32));
        frames.push(match u.ratio(7, 8)? {
            true => [1.0, 0.0, 0.0, 1.0],
            false => u.arbitrary::<[Number; 4]>()?.map(|n| n.0 as f32),
        });
    }
    Ok(SearchedFace::new(gray, metric, points, frames).ok())
}

/// Features, most of which a homography explains.
fn candidates(
    u: &mut Unstructured<'_>,
    faces: &[SearchedFace],
    H: &Matrix3<f64>,
) -> Result<(Candidates, ImageFeatures)> {
    let k = u.int_in_range(0..=3)?;
    let mut candidates = Candidates {
        k,
        ..Candidates::default()
    };
    let mut features = ImageFeatures::default();
    for i in 0..u.int_in_range(0..=60_u32)? {
        for _ in 0..k {
            let plain = u.ratio(3, 4)?;
            candidates.face.push(match plain {
                true => i % FACES,
                false => *u.choose(&[0, 1, 2, NONE, NONE - 1])?,
            });
            candidates.reference.push(match plain {
                true => i / FACES,
                false => u.arbitrary()?,
            });
        }
        let face = &faces[(i % FACES) as usize];
        features.points.push(
            match u.ratio(3, 4)? && ((i / FACES) as usize) < face.len() {
                true => {
                    let mapped = H * face.point(i / FACES).push(1.0);
                    mapped.xy() / mapped.z
                }
                false => Number::pair(u.arbitrary()?),
            },
        );
        candidates.ratio.push(match u.ratio(7, 8)? {
            true => 0.5,
            false => u.arbitrary::<Number>()?.0 as f32,
        });
        features.scales.push(match u.ratio(7, 8)? {
            true => 1.0,
            false => u.arbitrary::<Number>()?.0 as f32,
        });
        features.angles.push(u.arbitrary::<Number>()?.0 as f32);
    }
    Ok((candidates, features))
}
