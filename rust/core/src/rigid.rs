//! Rigid transforms: validation, local perturbation.

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3, Vector6};

use crate::error::InputError;

const TOLERANCE: f64 = 1e-4;

/// Makes an isometry of a 4×4 matrix; `what` names it in the error.
pub fn from_matrix(
    matrix: &Matrix4<f64>,
    what: &'static str,
) -> Result<Isometry3<f64>, InputError> {
    if !matrix.iter().all(|value| value.is_finite()) {
        return Err(InputError::NotFinite { what });
    }
    let R: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let row_error = (matrix.row(3) - nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0)).amax();
    let deviation = (R * R.transpose() - Matrix3::identity())
        .amax()
        .max(row_error);
    let determinant = R.determinant();
    if deviation > TOLERANCE || determinant < 0.0 {
        return Err(InputError::NotRigid {
            what,
            deviation,
            determinant,
        });
    }
    let translation: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    Ok(from_parts(R, translation))
}

/// Isometry of a matrix that is a rotation up to rounding, and a translation.
pub fn from_parts(R: Matrix3<f64>, translation: Vector3<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(R);
    Isometry3::from_parts(
        translation.into(),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// T · (ρ, Exp ω) for δ = (ρ, ω): a small motion in the transform's own (right-hand) frame. Equal
/// to SE(3)'s exponential to first order, which is all that steps and covariances use.
pub fn perturbed(T: &Isometry3<f64>, delta: &Vector6<f64>) -> Isometry3<f64> {
    let rho = Vector3::new(delta[0], delta[1], delta[2]);
    let omega = Vector3::new(delta[3], delta[4], delta[5]);
    let mut moved = T * Isometry3::new(rho, omega);
    moved.rotation.renormalize();
    moved
}

/// The matrix of the cross product: skew(a) · b = a × b.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    a.cross_matrix()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_rigid_matrix_round_trips() {
        let T = Isometry3::new(Vector3::new(0.1, -0.2, 0.7), Vector3::new(0.3, 2.0, -0.5));
        let back = from_matrix(&T.to_homogeneous(), "T").unwrap();
        assert!((back.to_homogeneous() - T.to_homogeneous()).amax() < 1e-12);
    }

    #[test]
    fn what_is_not_rigid_is_refused() {
        let mirrored = Matrix4::from_diagonal(&nalgebra::Vector4::new(1.0, 1.0, -1.0, 1.0));
        assert!(matches!(
            from_matrix(&mirrored, "T"),
            Err(InputError::NotRigid { .. })
        ));
        let scaled = Matrix4::identity() * 1.01;
        assert!(matches!(
            from_matrix(&scaled, "T"),
            Err(InputError::NotRigid { .. })
        ));
        let nan = Matrix4::identity() * f64::NAN;
        assert_eq!(
            from_matrix(&nan, "T"),
            Err(InputError::NotFinite { what: "T" })
        );
    }

    #[test]
    fn a_perturbation_acts_in_the_moving_frame() {
        let T = Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_2);
        let moved = perturbed(&T, &Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0));
        assert!((moved.translation.vector - Vector3::y()).norm() < 1e-12);
        let turned = perturbed(&T, &Vector6::new(0.0, 0.0, 0.0, 0.1, 0.0, 0.0));
        let axis = T.rotation.inverse() * turned.rotation;
        assert!((axis.scaled_axis() - Vector3::new(0.1, 0.0, 0.0)).norm() < 1e-12);
    }
}
