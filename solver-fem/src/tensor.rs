//! Small dense tensors as plain arrays, and the few operations the elements need.
//!
//! Arrays rather than a matrix type: they are what the neighbouring crates exchange, and `D` stays
//! a plain const generic.

/// Second-order tensor, `t[i][j]`, in the fixed Cartesian frame.
pub type Tensor2<const D: usize> = [[f64; D]; D];

/// Third-order tensor, `t[i][j][k]`; as a gradient of v, ∂v_ij/∂x_k.
pub type Tensor3<const D: usize> = [[[f64; D]; D]; D];

/// Fourth-order tensor, `c[i][j][k][l]`; as a tangent, dσ_ij/dL_kl for F → (I + L)·F.
pub type Tensor4<const D: usize> = [[[[f64; D]; D]; D]; D];

/// The zero second-order tensor.
pub fn zero<const D: usize>() -> Tensor2<D> {
    [[0.0; D]; D]
}

/// The zero fourth-order tensor.
pub fn zero4<const D: usize>() -> Tensor4<D> {
    [[[[0.0; D]; D]; D]; D]
}

/// The identity δ_ij.
pub fn identity<const D: usize>() -> Tensor2<D> {
    let mut result = zero();
    for i in 0..D {
        result[i][i] = 1.0;
    }
    result
}

/// (a·b)_ij = a_ik b_kj.
pub fn product<const D: usize>(a: &Tensor2<D>, b: &Tensor2<D>) -> Tensor2<D> {
    let mut result = zero();
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                result[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    result
}

/// (aᵀ)_ij = a_ji.
pub fn transpose<const D: usize>(a: &Tensor2<D>) -> Tensor2<D> {
    let mut result = zero();
    for i in 0..D {
        for j in 0..D {
            result[i][j] = a[j][i];
        }
    }
    result
}

/// Trace a_ii.
pub fn trace<const D: usize>(a: &Tensor2<D>) -> f64 {
    (0..D).map(|i| a[i][i]).sum()
}

/// r·a·rᵀ: the tensor `a` carried along by the rotation `r`.
pub fn rotate<const D: usize>(r: &Tensor2<D>, a: &Tensor2<D>) -> Tensor2<D> {
    product(&product(r, a), &transpose(r))
}

/// r_ia r_jb r_kc a_abc: the tensor `a` carried along by the rotation `r`.
pub fn rotate3<const D: usize>(r: &Tensor2<D>, a: &Tensor3<D>) -> Tensor3<D> {
    let mut result = *a;
    // Turning the first index and cycling the three of them, three times over, turns them all.
    for _ in 0..3 {
        let mut turned = [[[0.0; D]; D]; D];
        for a in 0..D {
            for b in 0..D {
                for c in 0..D {
                    for i in 0..D {
                        turned[b][c][i] += r[i][a] * result[a][b][c];
                    }
                }
            }
        }
        result = turned;
    }
    result
}

/// Determinant, and the inverse where the determinant is neither zero nor non-finite.
///
/// Gauss–Jordan elimination with partial pivoting, one code for every `D`.
pub fn determinant_and_inverse<const D: usize>(a: &Tensor2<D>) -> (f64, Option<Tensor2<D>>) {
    let mut work = *a;
    let mut inverse = identity::<D>();
    let mut determinant = 1.0;
    for column in 0..D {
        let mut pivot = column;
        for row in column + 1..D {
            if work[row][column].abs() > work[pivot][column].abs() {
                pivot = row;
            }
        }
        if pivot != column {
            work.swap(pivot, column);
            inverse.swap(pivot, column);
            determinant = -determinant;
        }
        let diagonal = work[column][column];
        determinant *= diagonal;
        if diagonal == 0.0 || !diagonal.is_finite() {
            return (determinant, None);
        }
        for j in 0..D {
            work[column][j] /= diagonal;
            inverse[column][j] /= diagonal;
        }
        for row in 0..D {
            if row == column {
                continue;
            }
            let factor = work[row][column];
            for j in 0..D {
                work[row][j] -= factor * work[column][j];
                inverse[row][j] -= factor * inverse[column][j];
            }
        }
    }
    (determinant, Some(inverse))
}

/// Determinant.
pub fn determinant<const D: usize>(a: &Tensor2<D>) -> f64 {
    determinant_and_inverse(a).0
}

/// Eigenvalues and orthonormal eigenvectors of a symmetric tensor: `a = Σ λ_k v_k ⊗ v_k`, the
/// vector of `λ_k` in **column** `k`. In no particular order.
///
/// Cyclic Jacobi rotations: exact orthogonality to roundoff also for equal eigenvalues, which is
/// what the tensor logarithm needs, and the same operations on every machine.
pub fn symmetric_eigen<const D: usize>(a: &Tensor2<D>) -> ([f64; D], Tensor2<D>) {
    const SWEEPS: usize = 50;
    let mut work = *a;
    let mut vectors = identity::<D>();
    for _ in 0..SWEEPS {
        let mut off = 0.0;
        let mut on = 0.0;
        for i in 0..D {
            on += work[i][i] * work[i][i];
            for j in i + 1..D {
                off += work[i][j] * work[i][j];
            }
        }
        if off <= 1e-34 * on || !off.is_finite() {
            break;
        }
        for p in 0..D {
            for q in p + 1..D {
                if work[p][q] == 0.0 {
                    continue;
                }
                let theta = (work[q][q] - work[p][p]) / (2.0 * work[p][q]);
                let sign = if theta < 0.0 { -1.0 } else { 1.0 };
                let t = sign / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..D {
                    let (kp, kq) = (work[k][p], work[k][q]);
                    work[k][p] = c * kp - s * kq;
                    work[k][q] = s * kp + c * kq;
                }
                for k in 0..D {
                    let (pk, qk) = (work[p][k], work[q][k]);
                    work[p][k] = c * pk - s * qk;
                    work[q][k] = s * pk + c * qk;
                    let (vp, vq) = (vectors[k][p], vectors[k][q]);
                    vectors[k][p] = c * vp - s * vq;
                    vectors[k][q] = s * vp + c * vq;
                }
            }
        }
    }
    let mut values = [0.0; D];
    for i in 0..D {
        values[i] = work[i][i];
    }
    (values, vectors)
}

/// Σ_k f(λ_k) v_k ⊗ v_k from eigenvalues already mapped by `f`.
pub fn from_eigen<const D: usize>(values: &[f64; D], vectors: &Tensor2<D>) -> Tensor2<D> {
    let mut result = zero();
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                result[i][j] += values[k] * vectors[i][k] * vectors[j][k];
            }
        }
    }
    result
}

/// Tensor stored flat at index `index` of a list of second-order tensors, row by row.
pub(crate) fn load2<const D: usize>(flat: &[f64], index: usize) -> Tensor2<D> {
    let mut result = zero();
    let chunk = &flat[index * D * D..(index + 1) * D * D];
    for i in 0..D {
        result[i].copy_from_slice(&chunk[i * D..(i + 1) * D]);
    }
    result
}

/// Tensor stored flat at index `index` of a list of third-order tensors, last index fastest.
pub(crate) fn load3<const D: usize>(flat: &[f64], index: usize) -> Tensor3<D> {
    let mut result = [[[0.0; D]; D]; D];
    let size = D * D * D;
    let chunk = &flat[index * size..(index + 1) * size];
    for (place, value) in result.iter_mut().flatten().flatten().zip(chunk) {
        *place = *value;
    }
    result
}

/// Tensor stored flat at index `index` of a list of fourth-order tensors, last index fastest.
pub(crate) fn load4<const D: usize>(flat: &[f64], index: usize) -> Tensor4<D> {
    let mut result = zero4();
    let size = D * D * D * D;
    let mut values = flat[index * size..(index + 1) * size].iter();
    for plane in result.iter_mut().flatten().flatten().flatten() {
        *plane = *values.next().expect("the chunk holds D^4 values");
    }
    result
}

/// Second-order tensors one after another, row by row.
pub(crate) fn flatten2<'a, const D: usize>(
    tensors: impl IntoIterator<Item = &'a Tensor2<D>>,
) -> Vec<f64> {
    tensors.into_iter().flatten().flatten().copied().collect()
}

/// Fourth-order tensors one after another, last index fastest.
pub(crate) fn flatten4<'a, const D: usize>(
    tensors: impl IntoIterator<Item = &'a Tensor4<D>>,
) -> Vec<f64> {
    tensors
        .into_iter()
        .flatten()
        .flatten()
        .flatten()
        .flatten()
        .copied()
        .collect()
}

/// Euclidean norm, summed in the order of the slice.
pub(crate) fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_survives_a_zero_leading_pivot() {
        let a = [[0.0, 2.0, 1.0], [1.0, 0.5, 0.0], [0.0, 1.0, -1.0]];
        let (determinant, inverse) = determinant_and_inverse(&a);
        assert!((determinant - 3.0).abs() < 1e-15);
        let unit = product(&a, &inverse.expect("regular"));
        for i in 0..3 {
            for j in 0..3 {
                assert!((unit[i][j] - if i == j { 1.0 } else { 0.0 }).abs() < 1e-15);
            }
        }
        assert!(
            determinant_and_inverse(&[[1.0, 2.0], [2.0, 4.0]])
                .1
                .is_none()
        );
    }

    #[test]
    fn eigenvectors_stay_orthonormal_when_eigenvalues_coincide() {
        for a in [
            [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]],
            [[1.0, 1e-9, 0.3], [1e-9, 1.0, -0.2], [0.3, -0.2, 4.0]],
        ] {
            let (values, vectors) = symmetric_eigen(&a);
            let back = from_eigen(&values, &vectors);
            let unit = product(&transpose(&vectors), &vectors);
            for i in 0..3 {
                for j in 0..3 {
                    assert!((back[i][j] - a[i][j]).abs() < 1e-14);
                    assert!((unit[i][j] - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn flat_storage_gives_back_the_same_bits() {
        let mut c = zero4::<2>();
        let mut next = 0.1;
        for value in c.iter_mut().flatten().flatten().flatten() {
            next *= 1.37;
            *value = next;
        }
        let flat = flatten4(&[zero4::<2>(), c]);
        assert_eq!(load4::<2>(&flat, 1), c);
        let s = [[1.0, 2.0], [3.0, 4.0]];
        assert_eq!(load2::<2>(&flatten2(&[s, s]), 1), s);
    }
}
