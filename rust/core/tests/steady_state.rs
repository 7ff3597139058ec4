//! After the first frames nothing is allocated any more, or what is allocated is given back.
#![allow(clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nalgebra::Matrix3;
use planegrasp_core::GrayImage;
use planegrasp_core::alignment::{AlignmentConfig, AlignmentReference, AlignmentWorkspace, align};
use planegrasp_core::matching::{Candidates, Metric, ReferenceIndex, ReferenceSet};
use planegrasp_core::random::SplitMix64;
use planegrasp_core::sift::{Sift, SiftConfig};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
/// Frames that may still need more memory.
const WARM_UP: usize = 24;
const FRAMES: usize = 200;
/// Different images that take turns.
const IMAGES: usize = 8;

/// Counts what the system's allocator is asked for.
struct Counting;

thread_local! {
    /// Bytes in use and number of allocations, of this thread: those of the test harness and of
    /// other tests do not count.
    static COUNTS: Cell<(isize, usize)> = const { Cell::new((0, 0)) };
}

fn count(bytes: isize, calls: usize) {
    let (live, before) = COUNTS.get();
    COUNTS.set((live + bytes, before + calls));
}

// SAFETY: every request is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize, 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize), 0);
        // SAFETY: the caller keeps the contract of `dealloc`; `alloc` got the pointer from the system.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Growth of the memory in use [bytes] and number of allocations of `frames` calls after the
/// warm-up.
fn growth(mut work: impl FnMut(usize)) -> (isize, usize) {
    (0..WARM_UP).for_each(&mut work);
    let before = COUNTS.get();
    (0..FRAMES).for_each(&mut work);
    let after = COUNTS.get();
    (after.0 - before.0, after.1 - before.1)
}

/// On a pool of one thread, which does all the work and so counts all of it.
fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.build().unwrap().install(work)
}

/// Images of bright and dark discs.
fn images() -> Vec<Vec<u8>> {
    let mut random = SplitMix64::new(5);
    let mut image = || {
        let mut pixels = vec![128u8; WIDTH * HEIGHT];
        for _ in 0..150 {
            let (x, y) = (random.index(WIDTH), random.index(HEIGHT));
            let (radius, level) = (3 + random.index(12), random.index(256) as u8);
            for row in y.saturating_sub(radius)..(y + radius).min(HEIGHT) {
                for column in x.saturating_sub(radius)..(x + radius).min(WIDTH) {
                    if row.abs_diff(y).pow(2) + column.abs_diff(x).pow(2) < radius * radius {
                        pixels[row * WIDTH + column] = level;
                    }
                }
            }
        }
        pixels
    };
    (0..IMAGES).map(|_| image()).collect()
}

fn gray(pixels: &[u8]) -> GrayImage<'_> {
    GrayImage::new(WIDTH, HEIGHT, pixels).unwrap()
}

#[test]
fn sift_needs_no_more_memory_with_every_frame() {
    let (growth, calls) = alone(|| {
        let images = images();
        let mut sift = Sift::new(SiftConfig::default()).unwrap();
        growth(|i| {
            let features = sift.extract(gray(&images[i % IMAGES])).unwrap();
            assert!(features.keypoints.len() > 100);
        })
    });
    assert_eq!((growth, calls), (0, 0));
}

#[cfg(feature = "surf")]
#[test]
fn surf_needs_no_more_memory_with_every_frame() {
    use planegrasp_core::surf::{Surf, SurfConfig};
    let (growth, calls) = alone(|| {
        let images = images();
        let mut surf = Surf::new(SurfConfig::default()).unwrap();
        growth(|i| assert!(surf.extract(gray(&images[i % IMAGES])).keypoints.len() > 50))
    });
    assert_eq!((growth, calls), (0, 0));
}

#[test]
fn the_index_needs_no_more_memory_with_every_frame() {
    let mut random = SplitMix64::new(2);
    let mut bytes =
        |count: usize| -> Vec<u8> { (0..128 * count).map(|_| random.index(128) as u8).collect() };
    let (growth, calls) = alone(|| {
        let mut index = ReferenceIndex::new(Metric::Euclidean, 128);
        for _ in 0..3 {
            let points = (0..500).map(|i| [i as f32, 0.0]).collect();
            let set = ReferenceSet::new(
                points,
                vec![[1.0, 0.0, 0.0, 1.0]; 500],
                bytes(500),
                128,
                10.0,
            );
            index.add(set.unwrap()).unwrap();
        }
        let queries: Vec<_> = [300, 100, 500, 1].into_iter().map(&mut bytes).collect();
        let mut found = Candidates::default();
        growth(|i| {
            let scope = [(0, usize::MAX), (2, usize::MAX)];
            let queries = &queries[i % queries.len()];
            index
                .candidates_into(queries, 8, &scope, &mut found)
                .unwrap();
        })
    });
    println!("{} allocations a frame, all given back", calls / FRAMES);
    assert_eq!(growth, 0);
}

#[test]
fn alignment_with_a_workspace_allocates_nothing() {
    let (growth, calls) = alone(|| {
        let images = images();
        let references: Vec<_> = images
            .iter()
            .map(|pixels| AlignmentReference::new(gray(pixels)).unwrap())
            .collect();
        let config = AlignmentConfig::default();
        let mut workspace = AlignmentWorkspace::new();
        growth(|i| {
            // Half a pixel between edge and pixel coordinates, and a shift to be found.
            let start = Matrix3::new(1.0, 0.0, -0.1, 0.0, 1.0, -0.9, 0.0, 0.0, 1.0);
            let (reference, frame) = (&references[i % IMAGES], gray(&images[i % IMAGES]));
            let found = align(reference, &frame, &start, &config, &mut workspace).unwrap();
            assert!(found.accepted);
        })
    });
    assert_eq!((growth, calls), (0, 0));
}
