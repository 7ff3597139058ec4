//! The one helper that checks analytic Jacobians, for tests.

use nalgebra::SMatrix;

const STEP: f64 = 1e-6;
/// Relative to the largest entry: central differences at this step are good to about 1e-9.
const TOLERANCE: f64 = 1e-7;

/// Asserts that `jacobian` is the derivative of `function` at `at`, by central differences.
pub fn assert_jacobian<const ROWS: usize, const COLUMNS: usize>(
    function: impl Fn(&[f64; COLUMNS]) -> [f64; ROWS],
    at: &[f64; COLUMNS],
    jacobian: SMatrix<f64, ROWS, COLUMNS>,
) {
    let mut numeric = SMatrix::<f64, ROWS, COLUMNS>::zeros();
    for column in 0..COLUMNS {
        let shifted = |sign: f64| {
            let mut x = *at;
            x[column] += sign * STEP;
            function(&x)
        };
        let (plus, minus) = (shifted(1.0), shifted(-1.0));
        for row in 0..ROWS {
            numeric[(row, column)] = (plus[row] - minus[row]) / (2.0 * STEP);
        }
    }
    let error = (jacobian - numeric).amax();
    let limit = TOLERANCE * (1.0 + numeric.amax());
    assert!(
        error < limit,
        "off by {error:e}\nanalytic {jacobian}\nnumeric {numeric}"
    );
}

#[test]
#[should_panic(expected = "off by")]
fn a_wrong_jacobian_is_noticed() {
    assert_jacobian(
        |x: &[f64; 1]| [x[0] * x[0]],
        &[3.0],
        SMatrix::<f64, 1, 1>::new(6.001),
    );
}
