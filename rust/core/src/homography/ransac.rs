//! The robust loop.

use nalgebra::Matrix3;

use super::PointMatch;
use super::conditioning::Conditioning;
use super::minimal::through;
use super::progressive::ProgressiveSampler;
use super::refine::refine_conditioned;
use crate::error::InputError;
use crate::lm::Precision;

/// The chance that no better estimate was missed, for stopping early.
const CONFIDENCE: f64 = 0.9999;
/// Rounds of refinement on the matches that agree, for each new best sample.
const LOCAL_ROUNDS: usize = 2;
/// Cauchy's scale over the threshold, in refinement.
const LOSS_SCALE: f64 = 1.0 / 3.0;

/// Settings of [`estimate`].
#[derive(Debug, Clone, PartialEq)]
pub struct RansacConfig {
    /// Matches farther than this from where the homography puts them do not agree [target unit].
    pub threshold: f64,
    /// At least so many samples.
    pub min_iterations: usize,
    /// At most so many samples.
    pub max_iterations: usize,
    /// Of the sampling: the same matches and seed give the same homography.
    pub seed: u64,
}

impl Default for RansacConfig {
    fn default() -> Self {
        Self {
            threshold: 3.0,
            min_iterations: 100,
            max_iterations: 5000,
            seed: 0,
        }
    }
}

impl RansacConfig {
    fn check(&self) -> Result<(), InputError> {
        if self.threshold > 0.0 && self.threshold.is_finite() {
            return Ok(());
        }
        Err(InputError::OutOfRange {
            name: "threshold",
            value: self.threshold,
            valid: "> 0 and finite",
        })
    }
}

/// A homography and how many matches agree with it.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustHomography {
    /// From source to target.
    pub matrix: Matrix3<f64>,
    /// Matches within the threshold.
    pub inliers: usize,
    /// Samples that were drawn.
    pub iterations: usize,
}

/// The homography that most matches agree with; they must be ordered, the likeliest first.
///
/// Samples whose homography is not `possible` are passed over. `Ok(None)` where there are fewer than four matches or no sample gives a homography.
pub fn estimate(
    matches: &[PointMatch],
    config: &RansacConfig,
    possible: impl Fn(&Matrix3<f64>) -> bool,
) -> Result<Option<RobustHomography>, InputError> {
    config.check()?;
    let finite = |point: &PointMatch| {
        point
            .source
            .iter()
            .chain(&point.target)
            .all(|v| v.is_finite())
    };
    if !matches.iter().all(finite) {
        return Err(InputError::NotFinite { what: "matches" });
    }
    if matches.len() < 4 {
        return Ok(None);
    }
    let Some(conditioning) = Conditioning::of(matches) else {
        return Ok(None);
    };
    let conditioned: Vec<PointMatch> = matches
        .iter()
        .map(|point| conditioning.condition(point))
        .collect();
    let scorer = Scorer {
        matches: &conditioned,
        threshold: conditioning.target_length(config.threshold),
    };
    let possible = |H: &Matrix3<f64>| conditioning.original(H).is_some_and(|H| possible(&H));
    let found = search(&scorer, config, possible);
    Ok(found.and_then(|(best, iterations)| {
        Some(RobustHomography {
            matrix: conditioning.original(&best.matrix)?,
            inliers: best.inliers,
            iterations,
        })
    }))
}

fn search(
    scorer: &Scorer<'_>,
    config: &RansacConfig,
    possible: impl Fn(&Matrix3<f64>) -> bool,
) -> Option<(Scored, usize)> {
    let count = scorer.matches.len();
    let mut sampler = ProgressiveSampler::new(count, config.seed);
    let mut best_sample = f64::INFINITY;
    let mut best: Option<Scored> = None;
    let mut needed = config.max_iterations;
    let mut iterations = 0;
    while iterations < needed.max(config.min_iterations).min(config.max_iterations) {
        iterations += 1;
        let sampled = through(&sampler.draw().map(|i| scorer.matches[i]));
        let Some(matrix) = sampled.filter(&possible) else {
            continue;
        };
        let Some(sample) = scorer.score(&matrix, best_sample) else {
            continue;
        };
        best_sample = sample.cost;
        let local = scorer.optimised(sample);
        if best.as_ref().is_none_or(|known| local.cost < known.cost) {
            needed = iterations_needed(local.inliers as f64 / count as f64);
            best = Some(local);
        }
    }
    best.map(|best| (best, iterations))
}

/// Uniform samples after which four agreeing matches were drawn together with `CONFIDENCE`.
fn iterations_needed(share: f64) -> usize {
    let hit = share.powi(4);
    if hit >= 1.0 {
        return 1;
    }
    let needed = (1.0 - CONFIDENCE).ln() / (1.0 - hit).ln();
    if needed.is_finite() {
        needed.ceil() as usize
    } else {
        usize::MAX
    }
}

#[derive(Debug, Clone)]
struct Scored {
    matrix: Matrix3<f64>,
    cost: f64,
    inliers: usize,
}

struct Scorer<'a> {
    matches: &'a [PointMatch],
    threshold: f64,
}

impl Scorer<'_> {
    /// Truncated squared errors; `None` as soon as they reach `limit`.
    fn score(&self, matrix: &Matrix3<f64>, limit: f64) -> Option<Scored> {
        let cut = self.threshold * self.threshold;
        let (mut cost, mut inliers) = (0.0, 0);
        for point in self.matches {
            let squared = point.squared_error(matrix);
            if squared <= cut {
                inliers += 1;
            }
            cost += squared.min(cut);
            if cost >= limit {
                return None;
            }
        }
        Some(Scored {
            matrix: *matrix,
            cost,
            inliers,
        })
    }

    /// Refines on the matches that agree, as long as that improves the score.
    fn optimised(&self, sample: Scored) -> Scored {
        let mut best = sample;
        for _ in 0..LOCAL_ROUNDS {
            let near: Vec<PointMatch> = self
                .matches
                .iter()
                .filter(|point| point.squared_error(&best.matrix) <= (2.0 * self.threshold).powi(2))
                .copied()
                .collect();
            let scale = LOSS_SCALE * self.threshold;
            let improved = refine_conditioned(&near, &best.matrix, scale, None, Precision::Coarse)
                .and_then(|matrix| self.score(&matrix, best.cost));
            match improved {
                Some(better) => best = better,
                None => break,
            }
        }
        best
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::random::SplitMix64;

    const TRUTH: Matrix3<f64> = Matrix3::new(0.5, -0.1, 210.0, 0.1, 0.45, 160.0, 2e-4, -4e-4, 1.0);

    /// Right matches with noise among wrong ones; every `stride`-th is right.
    fn matches(count: usize, stride: usize, sigma: f64) -> Vec<PointMatch> {
        let mut random = SplitMix64::new(11);
        (0..count)
            .map(|i| {
                let source = Vector2::new(400.0 * random.uniform(), 300.0 * random.uniform());
                let mapped = TRUTH * source.push(1.0);
                let right =
                    mapped.xy() / mapped.z + Vector2::new(random.normal(), random.normal()) * sigma;
                let wrong = Vector2::new(640.0 * random.uniform(), 480.0 * random.uniform());
                PointMatch {
                    source,
                    target: if i % stride == 0 { right } else { wrong },
                }
            })
            .collect()
    }

    fn corner_error(H: &Matrix3<f64>) -> f64 {
        [[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0]]
            .map(|corner| {
                let source = Vector2::from(corner).push(1.0);
                let (a, b) = (H * source, TRUTH * source);
                (a.xy() / a.z - b.xy() / b.z).norm()
            })
            .into_iter()
            .fold(0.0, f64::max)
    }

    #[test]
    fn three_quarters_of_wrong_matches_do_not_matter() {
        let found = estimate(&matches(200, 4, 0.5), &RansacConfig::default(), |_| true)
            .unwrap()
            .unwrap();
        // 50 points of 0.5 px over eight parameters: 0.14 px inside, a few times that at corners.
        assert!(
            corner_error(&found.matrix) < 1.0,
            "{}",
            corner_error(&found.matrix)
        );
        assert!((48..=56).contains(&found.inliers), "{}", found.inliers);
    }

    #[test]
    fn good_matches_first_need_few_samples() {
        let all = matches(300, 10, 0.3);
        let right = all.iter().step_by(10);
        let wrong = all.iter().enumerate().filter(|(i, _)| i % 10 != 0);
        let ordered: Vec<PointMatch> = right
            .chain(wrong.map(|(_, point)| point))
            .copied()
            .collect();
        let found = estimate(&ordered, &RansacConfig::default(), |_| true)
            .unwrap()
            .unwrap();
        assert!(corner_error(&found.matrix) < 1.5);
        let hopeless = RansacConfig {
            min_iterations: 1,
            max_iterations: 30,
            ..RansacConfig::default()
        };
        let quick = estimate(&ordered, &hopeless, |_| true).unwrap().unwrap();
        assert!(corner_error(&quick.matrix) < 1.5);
    }

    #[test]
    fn the_same_seed_gives_the_same_homography() {
        let noisy = matches(120, 3, 0.5);
        let config = RansacConfig::default();
        assert_eq!(
            estimate(&noisy, &config, |_| true),
            estimate(&noisy, &config, |_| true)
        );
    }

    #[test]
    fn degenerate_matches_give_none_and_absurd_ones_an_error() {
        let config = RansacConfig::default();
        assert_eq!(estimate(&[], &config, |_| true), Ok(None));
        assert_eq!(estimate(&matches(3, 1, 0.0), &config, |_| true), Ok(None));
        let same = vec![matches(1, 1, 0.0)[0]; 20];
        assert_eq!(estimate(&same, &config, |_| true), Ok(None));
        let mut line = matches(20, 1, 0.0);
        line.iter_mut()
            .for_each(|point| point.source.y = 2.0 * point.source.x);
        assert_eq!(estimate(&line, &config, |_| true), Ok(None));
        let mut infinite = matches(20, 1, 0.0);
        infinite[3].target.x = f64::NAN;
        assert!(estimate(&infinite, &config, |_| true).is_err());
        let negative = RansacConfig {
            threshold: -1.0,
            ..config
        };
        assert!(estimate(&matches(20, 1, 0.0), &negative, |_| true).is_err());
    }

    #[test]
    fn more_agreement_needs_fewer_samples() {
        assert_eq!(iterations_needed(1.0), 1);
        assert!(iterations_needed(0.5) < iterations_needed(0.2));
        assert_eq!(iterations_needed(0.0), usize::MAX);
    }
}
