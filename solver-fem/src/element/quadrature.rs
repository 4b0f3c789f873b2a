//! Gauss–Legendre rules on [−1, 1] and their tensor products.

/// A point of a quadrature rule on the reference element.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct QuadraturePoint<const D: usize> {
    /// Reference coordinates, each in [−1, 1] for tensor-product elements.
    pub xi: [f64; D],
    /// Weight; the weights add up to the volume of the reference element.
    pub weight: f64,
}

/// Number of points per direction of a Gauss rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum GaussOrder {
    /// Two points, exact for cubics.
    Two,
    /// Three points, exact for quintics.
    Three,
}

/// One-dimensional Gauss–Legendre rule as (position, weight), positions ascending.
pub fn gauss(order: GaussOrder) -> Vec<(f64, f64)> {
    match order {
        GaussOrder::Two => {
            let x = 1.0 / 3.0_f64.sqrt();
            vec![(-x, 1.0), (x, 1.0)]
        }
        GaussOrder::Three => {
            let x = 0.6_f64.sqrt();
            vec![(-x, 5.0 / 9.0), (0.0, 8.0 / 9.0), (x, 5.0 / 9.0)]
        }
    }
}

/// Tensor-product rule on [−1, 1]^D, the first coordinate running fastest.
pub fn tensor_product<const D: usize>(order: GaussOrder) -> Vec<QuadraturePoint<D>> {
    let line = gauss(order);
    let count = line.len().pow(D as u32);
    (0..count)
        .map(|number| {
            let mut rest = number;
            let mut point = QuadraturePoint {
                xi: [0.0; D],
                weight: 1.0,
            };
            for coordinate in &mut point.xi {
                let (x, w) = line[rest % line.len()];
                *coordinate = x;
                point.weight *= w;
                rest /= line.len();
            }
            point
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_integrates_the_polynomials_it_promises() {
        for (order, degree) in [(GaussOrder::Two, 3), (GaussOrder::Three, 5)] {
            for p in 0..=degree {
                for q in 0..=degree {
                    let sum: f64 = tensor_product::<2>(order)
                        .iter()
                        .map(|point| point.weight * point.xi[0].powi(p) * point.xi[1].powi(q))
                        .sum();
                    let line = |n: i32| {
                        if n % 2 == 0 {
                            2.0 / f64::from(n + 1)
                        } else {
                            0.0
                        }
                    };
                    assert!((sum - line(p) * line(q)).abs() < 1e-14, "{order:?} {p} {q}");
                }
            }
        }
    }
}
