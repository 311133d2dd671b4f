//! Covariance matrices in `f32`: square roots of those that are only just positive, and the repair of those that are not.
//!
//! A direction that is known exactly, as the position is after a re-base, has variance zero. Such a matrix is positive
//! semi-definite, and an ordinary Cholesky decomposition fails on it; the one here gives that direction a zero column.

use nalgebra::{SMatrix, SVector};

/// A pivot below this part of its diagonal element is rounding: the direction is known exactly.
const NOTHING: f32 = 1e-7;
/// A pivot below minus this part of it is more than the rounding of a matrix of some ten rows: the matrix is not positive.
const ROUNDING: f32 = 4e-6;
/// By such parts correlations are shrunk without calling it a repair.
const ROUNDINGS: [f32; 3] = [0.0, 1e-6, 1e-5];
/// What may be left in the column of a direction known exactly, as a correlation: the square root of [`NOTHING`] and more.
const LEFT_OVER: f32 = 1e-3;

/// Decomposes `m` with its correlations shrunk by `part`, in its own memory: the upper triangle becomes that of `L^T`, where
/// `L L^T` is that matrix, and its diagonal is returned. Nothing when it has a negative direction or a value that is not
/// finite. Only the diagonal and the lower triangle of `m` are read, and they stay.
///
/// A direction of variance zero gives a zero column.
///
/// # Source
/// The Cholesky decomposition that Foot, 4.39 and 4.43 ask for, for positive semi-definite matrices.
fn decompose<const N: usize>(m: &mut SMatrix<f32, N, N>, part: f32) -> Option<SVector<f32, N>> {
    let left = 1.0 - part;
    let mut diagonal = SVector::zeros();
    for j in 0..N {
        let mut pivot = m[(j, j)];
        for k in 0..j {
            pivot -= m[(k, j)] * m[(k, j)];
        }
        if pivot > NOTHING * m[(j, j)] && pivot.is_finite() {
            let root = libm::sqrtf(pivot);
            diagonal[j] = root;
            for i in j + 1..N {
                m[(j, i)] = rest(m, left, i, j) / root;
            }
        } else if pivot >= -ROUNDING * m[(j, j)] {
            let consistent = (j + 1..N).all(|i| {
                let rest = rest(m, left, i, j);
                rest * rest <= LEFT_OVER * LEFT_OVER * m[(i, i)] * m[(j, j)]
            });
            if !consistent {
                return None;
            }
            for i in j + 1..N {
                m[(j, i)] = 0.0;
            }
        } else {
            return None;
        }
    }
    Some(diagonal)
}

/// Element `(i, j)` of the lower triangle less what the columns before `j` account for.
fn rest<const N: usize>(m: &SMatrix<f32, N, N>, left: f32, i: usize, j: usize) -> f32 {
    let mut rest = m[(i, j)] * left;
    for k in 0..j {
        rest -= m[(k, i)] * m[(k, j)];
    }
    rest
}

/// The lower triangular `L` of what was [decomposed](decompose) here.
fn root_of<const N: usize>(decomposed: &SMatrix<f32, N, N>, diagonal: &SVector<f32, N>) -> SMatrix<f32, N, N> {
    let mut root = SMatrix::from_diagonal(diagonal);
    for j in 0..N {
        for i in j + 1..N {
            root[(i, j)] = decomposed[(j, i)];
        }
    }
    root
}

/// The lower triangular `L` with `L L^T = m`, or nothing when `m` has a negative direction or a value that is not finite.
///
/// Only the lower triangle of `m` is read. A direction of variance zero gives a zero column.
pub fn square_root<const N: usize>(m: &SMatrix<f32, N, N>) -> Option<SMatrix<f32, N, N>> {
    let mut decomposed = *m;
    let diagonal = decompose(&mut decomposed, 0.0)?;
    Some(root_of(&decomposed, &diagonal))
}

/// The square root of `m`, a symmetric matrix, repaired first if it has none. The second part tells whether it was.
///
/// Rounding alone makes a matrix with known directions negative by some 1e-6 of its variances. Correlations are shrunk by
/// that little without calling it a repair.
pub fn repaired_square_root<const N: usize>(m: &mut SMatrix<f32, N, N>) -> (SMatrix<f32, N, N>, bool) {
    if let Some(diagonal) = shrink(m, &ROUNDINGS) {
        let root = root_of(m, &diagonal);
        mirror(m);
        return (root, false);
    }
    repair(m);
    let root = square_root(m).unwrap_or_else(|| SMatrix::from_diagonal(&m.diagonal().map(libm::sqrtf)));
    (root, true)
}

/// Makes sure that `m`, a symmetric matrix, has a square root, as [`repaired_square_root`] does. Whether it was repaired.
pub fn repair_if_needed<const N: usize>(m: &mut SMatrix<f32, N, N>) -> bool {
    let good = shrink(m, &ROUNDINGS).is_some();
    mirror(m);
    if !good {
        repair(m);
    }
    !good
}

/// Shrinks all correlations by the first of `parts` that gives `m` a square root, which it then is [decomposed](decompose)
/// into, or by none. The lower triangle is right in any case; [`mirror`] completes the matrix.
fn shrink<const N: usize>(m: &mut SMatrix<f32, N, N>, parts: &[f32]) -> Option<SVector<f32, N>> {
    let (part, diagonal) = parts.iter().find_map(|&part| Some((part, decompose(m, part)?)))?;
    for j in 0..N {
        for i in j + 1..N {
            m[(i, j)] *= 1.0 - part;
        }
    }
    Some(diagonal)
}

/// Turns `m` into the nearest usable covariance along one line: the correlations are shrunk towards zero, by no more than is
/// needed, and the variances are kept.
///
/// A variance that is negative or not a number, with all that goes with it, becomes zero; other values that are not
/// finite become zero as well. The result is symmetric and positive semi-definite whatever came in.
pub fn repair<const N: usize>(m: &mut SMatrix<f32, N, N>) {
    symmetrise(m);
    for i in 0..N {
        if !(m[(i, i)] > 0.0 && m[(i, i)] < LARGEST) {
            let variance = if m[(i, i)] >= LARGEST { LARGEST } else { 0.0 };
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
            m[(i, i)] = variance;
        }
    }
    for i in 0..N {
        for j in 0..i {
            // No correlation is beyond 1; a value that is not a number is none at all.
            let bound = libm::sqrtf(m[(i, i)]) * libm::sqrtf(m[(j, j)]);
            let value = if m[(i, j)].is_nan() { 0.0 } else { m[(i, j)].clamp(-bound, bound) };
            m[(i, j)] = value;
            m[(j, i)] = value;
        }
    }
    if shrink(m, &[1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1]).is_none() {
        for j in 0..N {
            m.view_range_mut(j + 1.., j).fill(0.0);
        }
    }
    mirror(m);
}

/// Largest variance that is kept, whatever its unit: beyond it the format has no digits left for anything else.
pub const LARGEST: f32 = 1e10;

/// Holds the variance of direction `i` at or below `limit`; its correlations stay as they are, so the matrix stays
/// positive.
pub fn limit_variance<const N: usize>(m: &mut SMatrix<f32, N, N>, i: usize, limit: f32) {
    if m[(i, i)] > limit {
        let scale = libm::sqrtf(limit / m[(i, i)]);
        for j in 0..N {
            m[(i, j)] *= scale;
            m[(j, i)] *= scale;
        }
    }
}

/// Makes both triangles the mean of the two.
pub fn symmetrise<const N: usize>(m: &mut SMatrix<f32, N, N>) {
    for i in 0..N {
        for j in 0..i {
            let mean = 0.5 * (m[(i, j)] + m[(j, i)]);
            m[(i, j)] = mean;
            m[(j, i)] = mean;
        }
    }
}

/// Adds `weight d d^T` to the lower triangle; [`mirror`] completes the matrix.
pub fn add_outer<const N: usize>(m: &mut SMatrix<f32, N, N>, d: &SVector<f32, N>, weight: f32) {
    for j in 0..N {
        let scaled = weight * d[j];
        for i in j..N {
            m[(i, j)] += scaled * d[i];
        }
    }
}

/// Copies the lower triangle to the upper one.
pub fn mirror<const N: usize>(m: &mut SMatrix<f32, N, N>) {
    for j in 0..N {
        for i in j + 1..N {
            m[(j, i)] = m[(i, j)];
        }
    }
}

/// `b m^-1` for a symmetric positive definite `m` with the square root `l`, row by row. Directions of variance zero
/// count as not measured at all.
pub fn divide<const R: usize, const N: usize>(b: &SMatrix<f32, R, N>, l: &SMatrix<f32, N, N>) -> SMatrix<f32, R, N> {
    let over = |value: f32, pivot: f32| if pivot > 0.0 { value / pivot } else { 0.0 };
    let mut x = *b;
    for r in 0..R {
        for j in 0..N {
            let mut value = x[(r, j)];
            for k in 0..j {
                value -= x[(r, k)] * l[(j, k)];
            }
            x[(r, j)] = over(value, l[(j, j)]);
        }
        for j in (0..N).rev() {
            let mut value = x[(r, j)];
            for k in j + 1..N {
                value -= x[(r, k)] * l[(k, j)];
            }
            x[(r, j)] = over(value, l[(j, j)]);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SymmetricEigen;
    use proptest::prelude::*;

    type M = SMatrix<f32, 6, 6>;

    /// `A A^T` of the first `rank` columns of a random matrix, the rows scaled over `decades` decades.
    fn covariance(rank: usize, decades: f32) -> impl Strategy<Value = M> {
        (proptest::array::uniform32(-1.0_f32..1.0), proptest::array::uniform6(-1.0_f32..1.0)).prop_map(
            move |(entries, scales)| {
                let a = SMatrix::<f32, 6, 6>::from_fn(|i, j| {
                    let entry = entries[(6 * j + i) % 32];
                    if j < rank { entry * libm::powf(10.0, decades * scales[i]) } else { 0.0 }
                });
                a * a.transpose()
            },
        )
    }

    /// Largest difference of two covariances, as a correlation.
    fn difference(a: &M, b: &M) -> f32 {
        let mut largest = 0.0_f32;
        for i in 0..6 {
            for j in 0..6 {
                let scale = libm::sqrtf(a[(i, i)]) * libm::sqrtf(a[(j, j)]);
                largest = largest.max((a[(i, j)] - b[(i, j)]).abs() / scale.max(1e-30));
            }
        }
        largest
    }

    /// The smallest eigenvalue of the matrix of correlations, in f64.
    fn smallest_eigenvalue(m: &M) -> f64 {
        let m = m.cast::<f64>();
        let scale = m.diagonal().map(|v| if v > 0.0 { 1.0 / libm::sqrt(v) } else { 0.0 });
        let correlations =
            SMatrix::<f64, 6, 6>::from_diagonal(&scale) * m * SMatrix::<f64, 6, 6>::from_diagonal(&scale);
        SymmetricEigen::new(correlations).eigenvalues.min()
    }

    fn is_symmetric(m: &M) -> bool {
        *m == m.transpose()
    }

    proptest! {
        #[test]
        fn the_square_root_squared_is_the_matrix(m in covariance(6, 4.0)) {
            let mut m = m;
            let (l, _) = repaired_square_root(&mut m);
            // A zero column may leave out correlations of LEFT_OVER where the matrix is almost singular; a repair
            // works on m itself.
            prop_assert!(difference(&m, &(l * l.transpose())) < 2e-3);
        }

        #[test]
        fn a_matrix_with_known_directions_has_a_square_root(m in covariance(6, 1.0), gone in 0_usize..6, also in 0_usize..6) {
            let mut m = m + M::from_diagonal_element(1e-4);
            for i in [gone, also] {
                m.row_mut(i).fill(0.0);
                m.column_mut(i).fill(0.0);
            }
            let l = square_root(&m).expect("positive semi-definite");
            prop_assert!(l.column(gone).iter().all(|&x| x == 0.0));
            prop_assert!(l.row(gone).iter().all(|&x| x == 0.0));
            prop_assert!((l * l.transpose() - m).amax() < 1e-6 * m.amax());
        }

        #[test]
        fn a_projected_direction_is_no_failure(m in covariance(6, 0.0), x in -1.0_f32..1.0, y in -1.0_f32..1.0) {
            // What a re-base does to the heading: rounding leaves a direction that is zero to one part in ten million.
            let m = m + M::from_diagonal_element(0.1);
            let u = SVector::<f32, 6>::from([x, y, 1.0, 0.0, 0.0, 0.0]).normalize();
            let project = M::identity() - u * u.transpose();
            let mut known = project * m * project.transpose();
            symmetrise(&mut known);
            let (l, repaired) = repaired_square_root(&mut known);
            prop_assert!(!repaired);
            prop_assert!((l * l.transpose() - known).amax() < 2e-3 * known.amax());
        }

        #[test]
        fn a_repair_keeps_the_variances(m in covariance(6, 1.0), i in 0_usize..5, much in 1.1_f32..20.0) {
            let mut broken = m + M::from_diagonal_element(1e-3);
            let value = much * libm::sqrtf(broken[(i, i)] * broken[(5, 5)]);
            broken[(5, i)] = value;
            broken[(i, 5)] = value;
            prop_assert!(square_root(&broken).is_none());
            let variances = broken.diagonal();
            let (l, repaired) = repaired_square_root(&mut broken);
            prop_assert!(repaired && is_symmetric(&broken));
            prop_assert_eq!(broken.diagonal(), variances);
            prop_assert!(difference(&broken, &(l * l.transpose())) < 2e-3);
            // What a pivot of -ROUNDING lets through.
            prop_assert!(smallest_eigenvalue(&broken) > -1e-5);
        }

        #[test]
        fn a_repair_of_anything_is_a_covariance(
            bits in proptest::array::uniform32(any::<u32>()),
            more in proptest::array::uniform4(any::<u32>()),
        ) {
            let mut m = M::from_fn(|i, j| f32::from_bits(*bits.get(6 * i + j).unwrap_or(&more[(6 * i + j) % 4])));
            repair(&mut m);
            let (l, _) = repaired_square_root(&mut m);
            prop_assert!(m.iter().chain(l.iter()).all(|x| x.is_finite()));
            prop_assert!(is_symmetric(&m));
            prop_assert!(m.diagonal().iter().all(|&v| (0.0..=LARGEST).contains(&v)));
            prop_assert!(smallest_eigenvalue(&m) > -1e-5);
        }

        #[test]
        fn dividing_undoes_multiplying(m in covariance(6, 0.5), b in proptest::array::uniform6(-1.0_f32..1.0)) {
            let m = m + M::from_diagonal_element(0.1);
            let l = square_root(&m).expect("positive");
            let b = SMatrix::<f32, 1, 6>::from(b);
            // The condition number is at most some 1e3: 6e-8 times that, six times over.
            prop_assert!((divide(&b, &l) * m - b).amax() < 1e-3);
        }
    }

    #[test]
    fn a_matrix_with_a_negative_direction_has_no_square_root() {
        assert!(square_root(&SMatrix::<f32, 2, 2>::new(1.0, 2.0, 2.0, 1.0)).is_none());
        assert!(square_root(&SMatrix::<f32, 2, 2>::new(-1e-9, 0.0, 0.0, 1.0)).is_none());
        assert!(square_root(&SMatrix::<f32, 2, 2>::new(0.0, 0.5, 0.5, 1.0)).is_none());
        assert!(square_root(&SMatrix::<f32, 2, 2>::new(f32::NAN, 0.0, 0.0, 1.0)).is_none());
        assert!(square_root(&SMatrix::<f32, 2, 2>::new(1.0, f32::NAN, f32::NAN, 1.0)).is_none());
    }

    #[test]
    fn a_limit_keeps_the_correlations() {
        let mut m = SMatrix::<f32, 2, 2>::new(16.0, 2.0, 2.0, 1.0);
        limit_variance(&mut m, 0, 4.0);
        assert_eq!(m, SMatrix::<f32, 2, 2>::new(4.0, 1.0, 1.0, 1.0));
    }
}
