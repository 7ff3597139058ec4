//! Which few of many descriptors serve best.
//!
//! Each trial feature can be served by some descriptors. Greedy maximum coverage: the descriptor
//! that adds most is taken next, again and again. What a feature adds is halved for each descriptor
//! that already serves it, and shared by the served features of its view: a view with few features
//! counts as much as one with many. Both make gains fall and never rise, so that a gain computed
//! earlier is an upper bound (lazy greedy: Minoux, Optimization Techniques 1978).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::InputError;

/// What a feature still adds with each further descriptor that serves it.
const REPEATED: f64 = 0.4;

/// Descriptors in the order of their use, the most useful first; those that serve nothing are left
/// out.
///
/// `serves`: pairs of a descriptor (`< descriptors`) and a feature. `view`: of each feature.
///
/// # Errors
/// [`InputError::OutOfRange`] where a pair names a descriptor or a feature that does not exist.
pub fn by_usefulness(
    descriptors: usize,
    serves: &[(u32, u32)],
    view: &[u32],
) -> Result<Vec<u32>, InputError> {
    let lists = lists(descriptors, serves, view.len())?;
    let views = view.iter().max().map_or(0, |last| *last as usize + 1);
    let mut state = State {
        view,
        repeats: vec![0; view.len()],
        served: vec![0; views],
    };
    let mut heap: BinaryHeap<Gain> = (0..descriptors as u32)
        .filter(|d| !lists[*d as usize].is_empty())
        .map(|descriptor| Gain {
            gain: state.gain(&lists[descriptor as usize]),
            descriptor,
        })
        .collect();
    let mut order = Vec::with_capacity(heap.len());
    while let Some(mut best) = heap.pop() {
        best.gain = state.gain(&lists[best.descriptor as usize]);
        if heap.peek().is_some_and(|next| best < *next) {
            heap.push(best);
            continue;
        }
        state.take(&lists[best.descriptor as usize]);
        order.push(best.descriptor);
    }
    Ok(order)
}

/// The features that each descriptor serves.
fn lists(
    descriptors: usize,
    serves: &[(u32, u32)],
    features: usize,
) -> Result<Vec<Vec<u32>>, InputError> {
    let mut lists = vec![Vec::new(); descriptors];
    for (descriptor, feature) in serves {
        let list = lists.get_mut(*descriptor as usize);
        match list {
            Some(list) if (*feature as usize) < features => list.push(*feature),
            _ => {
                return Err(InputError::OutOfRange {
                    name: "served descriptors and features",
                    value: f64::from(*descriptor.max(feature)),
                    valid: "of those that there are",
                });
            }
        }
    }
    Ok(lists)
}

struct State<'a> {
    view: &'a [u32],
    /// How many taken descriptors serve each feature.
    repeats: Vec<i32>,
    /// How many features of each view are served.
    served: Vec<u32>,
}

impl State<'_> {
    fn gain(&self, features: &[u32]) -> f64 {
        features
            .iter()
            .map(|feature| {
                let feature = *feature as usize;
                let served = self.served[self.view[feature] as usize];
                REPEATED.powi(self.repeats[feature]) / (1.0 + f64::from(served))
            })
            .sum()
    }

    fn take(&mut self, features: &[u32]) {
        for feature in features {
            let feature = *feature as usize;
            if self.repeats[feature] == 0 {
                self.served[self.view[feature] as usize] += 1;
            }
            self.repeats[feature] += 1;
        }
    }
}

#[derive(Debug, PartialEq)]
struct Gain {
    gain: f64,
    descriptor: u32,
}

impl Eq for Gain {}

impl PartialOrd for Gain {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Gain {
    /// By gain; of equal ones the lower number is the greater.
    fn cmp(&self, other: &Self) -> Ordering {
        self.gain
            .total_cmp(&other.gain)
            .then(other.descriptor.cmp(&self.descriptor))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    #[test]
    fn the_one_that_serves_most_comes_first_and_repeats_come_last() {
        // 1 serves three features of one view, 0 two of these, 2 one of its own.
        let serves = [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 3)];
        let order = by_usefulness(4, &serves, &[0, 0, 0, 0]).unwrap();
        assert_eq!(order, [1, 2, 0]);
    }

    #[test]
    fn a_view_with_few_features_counts_as_much_as_one_with_many() {
        // Nine descriptors each serve one feature of the rich view, the last that of the poor one.
        let serves: Vec<(u32, u32)> = (0..10).map(|i| (i, i)).collect();
        let view = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1];
        let order = by_usefulness(10, &serves, &view).unwrap();
        assert_eq!(order[..2], [0, 9]);
    }

    #[test]
    fn lazily_or_not_the_order_is_the_same() {
        let mut random = SplitMix64::new(3);
        let (descriptors, features) = (40, 120);
        let view: Vec<u32> = (0..features).map(|i| i / 12).collect();
        let mut draw = |n: u32| (random.uniform() * f64::from(n)) as u32;
        let serves: Vec<(u32, u32)> = (0..400)
            .map(|_| (draw(descriptors), draw(features)))
            .collect();
        let lists = lists(descriptors as usize, &serves, view.len()).unwrap();
        let mut state = State {
            view: &view,
            repeats: vec![0; view.len()],
            served: vec![0; 10],
        };
        let mut left: Vec<u32> = (0..descriptors).collect();
        left.retain(|d| !lists[*d as usize].is_empty());
        let mut plain = Vec::new();
        while !left.is_empty() {
            let gain = |d: &u32| Gain {
                gain: state.gain(&lists[*d as usize]),
                descriptor: *d,
            };
            let best = left.iter().max_by_key(|d| gain(d)).copied().unwrap();
            state.take(&lists[best as usize]);
            plain.push(best);
            left.retain(|d| *d != best);
        }
        assert_eq!(
            by_usefulness(descriptors as usize, &serves, &view).unwrap(),
            plain
        );
    }

    #[test]
    fn nothing_serves_nothing() {
        assert!(by_usefulness(0, &[], &[]).unwrap().is_empty());
        assert!(by_usefulness(5, &[], &[0, 1]).unwrap().is_empty());
    }

    #[test]
    fn pairs_beyond_the_lists_are_refused() {
        assert!(by_usefulness(2, &[(2, 0)], &[0]).is_err());
        assert!(by_usefulness(2, &[(0, 1)], &[0]).is_err());
    }
}
