//! Small dense tensors as plain arrays, in any space dimension.

/// A vector, `v[i]`.
pub type Vector<const D: usize> = [f64; D];
/// A second-order tensor, `t[i][j]`.
pub type Tensor2<const D: usize> = [[f64; D]; D];
/// A fourth-order tensor, `c[i][j][k][l]`.
pub type Tensor4<const D: usize> = [[[[f64; D]; D]; D]; D];

/// δ_ij.
pub fn identity<const D: usize>() -> Tensor2<D> {
    let mut t = [[0.0; D]; D];
    for i in 0..D {
        t[i][i] = 1.0;
    }
    t
}

/// (A·B)_ij = A_ik B_kj.
pub fn product<const D: usize>(a: &Tensor2<D>, b: &Tensor2<D>) -> Tensor2<D> {
    let mut c = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    c
}

/// (A·v)_i = A_ij v_j.
#[inline]
pub fn apply<const D: usize>(a: &Tensor2<D>, v: &Vector<D>) -> Vector<D> {
    let mut w = [0.0; D];
    for i in 0..D {
        for j in 0..D {
            w[i] += a[i][j] * v[j];
        }
    }
    w
}

/// The determinant and the inverse of `a`, by elimination with partial pivoting; `None` for the
/// inverse of a singular or non-finite tensor (the determinant is then 0 or NaN).
pub fn invert<const D: usize>(a: &Tensor2<D>) -> (f64, Option<Tensor2<D>>) {
    let mut m = *a;
    let mut inverse = identity::<D>();
    let mut determinant = 1.0;
    for column in 0..D {
        let pivot = (column..D)
            .max_by(|&p, &q| m[p][column].abs().total_cmp(&m[q][column].abs()))
            .unwrap_or(column);
        if m[pivot][column] == 0.0 || !m[pivot][column].is_finite() {
            return (0.0 * m[pivot][column], None);
        }
        if pivot != column {
            m.swap(pivot, column);
            inverse.swap(pivot, column);
            determinant = -determinant;
        }
        let scale = 1.0 / m[column][column];
        determinant *= m[column][column];
        for k in 0..D {
            m[column][k] *= scale;
            inverse[column][k] *= scale;
        }
        for row in 0..D {
            if row != column {
                let factor = m[row][column];
                for k in 0..D {
                    m[row][k] -= factor * m[column][k];
                    inverse[row][k] -= factor * inverse[column][k];
                }
            }
        }
    }
    (determinant, Some(inverse))
}

/// The angle of the rotation R in the polar decomposition F = R·U of a plane deformation gradient.
///
/// tan φ = (F_21 − F_12)/(F_11 + F_22), counter-clockwise positive.
pub fn rotation_angle(f: &Tensor2<2>) -> f64 {
    libm::atan2(f[1][0] - f[0][1], f[0][0] + f[1][1])
}

/// The rotation by `angle`, counter-clockwise positive, radians.
pub fn rotation(angle: f64) -> Tensor2<2> {
    let (s, c) = libm::sincos(angle);
    [[c, -s], [s, c]]
}

/// R·t·Rᵀ.
pub fn rotated2<const D: usize>(r: &Tensor2<D>, t: &Tensor2<D>) -> Tensor2<D> {
    let mut turned = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                for l in 0..D {
                    turned[i][j] += r[i][k] * t[k][l] * r[j][l];
                }
            }
        }
    }
    turned
}

/// R_ia R_jb R_kc R_ld C_abcd.
pub fn rotated4<const D: usize>(r: &Tensor2<D>, c: &Tensor4<D>) -> Tensor4<D> {
    // The first pair of indices, then the second.
    let mut half = [[[[0.0; D]; D]; D]; D];
    for k in 0..D {
        for l in 0..D {
            let mut slice = [[0.0; D]; D];
            for i in 0..D {
                for j in 0..D {
                    slice[i][j] = c[i][j][k][l];
                }
            }
            let slice = rotated2(r, &slice);
            for i in 0..D {
                for j in 0..D {
                    half[i][j][k][l] = slice[i][j];
                }
            }
        }
    }
    half.map(|row| row.map(|slice| rotated2(r, &slice)))
}

/// tr(t)/D.
pub fn mean<const D: usize>(t: &Tensor2<D>) -> f64 {
    (0..D).map(|i| t[i][i]).sum::<f64>() / D as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_of_a_sheared_cell_is_not_its_transpose() {
        let a = [[0.0, 2.0, 1.0], [1.0, 0.5, 0.0], [0.3, 0.0, 4.0]];
        let (determinant, inverse) = invert(&a);
        let unit = product(&a, &inverse.unwrap());
        for i in 0..3 {
            for j in 0..3 {
                assert!((unit[i][j] - f64::from(u8::from(i == j))).abs() < 1e-15);
            }
        }
        assert!((determinant + 8.15).abs() < 1e-14, "{determinant}");
        assert!(invert(&[[1.0, 2.0], [2.0, 4.0]]).1.is_none());
        assert!(invert(&[[f64::NAN, 2.0], [2.0, 4.0]]).1.is_none());
    }
}
