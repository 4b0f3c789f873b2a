//! Gauss–Legendre rules on [−1, 1] and their tensor products; symmetric rules on the triangle.

/// A point of a quadrature rule on the reference element.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct QuadraturePoint<const D: usize> {
    /// Reference coordinates: each in [−1, 1] for tensor-product elements, not negative and with a sum of at most 1 for
    /// simplices.
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

/// Number of points of a triangle rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TriangleRule {
    /// Three inner points, exact for quadratics.
    Three,
    /// Six points, exact for quartics (Strang and Fix 1973; Dunavant 1985).
    Six,
}

/// Symmetric rule on the triangle (0,0), (1,0), (0,1): rings of three points with the area coordinates
/// (1−2a, a, a) and its permutations; point i of a ring is nearest to corner i where a < 1/3.
pub fn triangle(rule: TriangleRule) -> Vec<QuadraturePoint<2>> {
    let ring = |a: f64, weight: f64| {
        let b = 1.0 - 2.0 * a;
        [[a, a], [b, a], [a, b]].map(|xi| QuadraturePoint { xi, weight })
    };
    match rule {
        TriangleRule::Three => ring(1.0 / 6.0, 1.0 / 6.0).to_vec(),
        TriangleRule::Six => {
            // a = (8 − √10 ± √(38 − 44√(2/5)))/18, w = (620 ± √(213125 − 53320√10))/7440.
            let ten = 10.0_f64.sqrt();
            let spread = (38.0 - 44.0 * 0.4_f64.sqrt()).sqrt();
            let weight = (213_125.0 - 53_320.0 * ten).sqrt();
            let inner = ring((8.0 - ten + spread) / 18.0, (620.0 + weight) / 7440.0);
            let outer = ring((8.0 - ten - spread) / 18.0, (620.0 - weight) / 7440.0);
            outer.into_iter().chain(inner).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ ξ^p η^q over the triangle is p! q! / (p + q + 2)!.
    #[test]
    fn a_triangle_rule_integrates_the_polynomials_it_promises() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (rule, degree) in [(TriangleRule::Three, 2), (TriangleRule::Six, 4)] {
            for p in 0..=degree {
                for q in 0..=degree - p {
                    let sum: f64 = triangle(rule)
                        .iter()
                        .map(|point| point.weight * point.xi[0].powi(p) * point.xi[1].powi(q))
                        .sum();
                    let exact = factorial(p) * factorial(q) / factorial(p + q + 2);
                    assert!((sum - exact).abs() < 1e-15, "{rule:?} {p} {q}: {sum}");
                }
            }
        }
    }

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
