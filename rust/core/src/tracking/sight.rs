//! One frame, as following looks at it.

use std::sync::OnceLock;

use crate::alignment::CoarseFrames;
use crate::{Camera, DepthImage, GrayImage};

/// What a camera sees at one time.
#[derive(Debug)]
pub struct Sight<'a> {
    /// The image without lens distortion.
    pub gray: GrayImage<'a>,
    /// Depth, where there is any.
    pub depth: Option<DepthImage<'a>>,
    /// The camera.
    pub camera: &'a Camera,
    coarse: OnceLock<CoarseFrames>,
}

impl<'a> Sight<'a> {
    /// A frame.
    pub fn new(gray: GrayImage<'a>, depth: Option<DepthImage<'a>>, camera: &'a Camera) -> Self {
        Self {
            gray,
            depth,
            camera,
            coarse: OnceLock::new(),
        }
    }

    /// The image on coarser levels, made when the first object needs them.
    pub fn coarse(&self) -> &CoarseFrames {
        self.coarse.get_or_init(|| CoarseFrames::new(&self.gray))
    }
}
