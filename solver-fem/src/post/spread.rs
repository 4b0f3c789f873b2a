//! How far a field parts inside elements, against how far it changes from element to element.
//!
//! A multiplier that is constant in an element regularises the mean of grad u there, not its linear part: under
//! softening the Gauss points of one element may part ways while the means stay smooth.

use std::collections::BTreeMap;

use crate::problem::Problem;

/// Root mean squares of a scalar field at Gauss points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spread {
    /// Deviation of a Gauss point from the mean of its element.
    pub inside: f64,
    /// Difference of the means of two elements that share a side.
    pub between: f64,
    /// The element whose points part most.
    pub worst: usize,
    /// Their root mean square deviation there.
    pub worst_inside: f64,
}

/// The spread of `values`, one per Gauss point; `None` where no two elements share a side.
///
/// # Panics
/// When `values` is not one per Gauss point.
pub fn spread<const D: usize>(problem: &Problem<D>, values: &[f64]) -> Option<Spread> {
    assert_eq!(
        values.len(),
        problem.gauss_point_count(),
        "one value per Gauss point"
    );
    let (mesh, per_element) = (problem.mesh(), problem.points_per_element());
    let means: Vec<f64> = values
        .chunks(per_element)
        .map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64)
        .collect();
    let inside: Vec<f64> = values
        .chunks(per_element)
        .zip(&means)
        .map(|(chunk, mean)| {
            let squares = chunk.iter().map(|x| (x - mean) * (x - mean));
            squares.sum::<f64>() / chunk.len() as f64
        })
        .collect();
    let mut sides: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
    let (mut sum, mut pairs) = (0.0, 0usize);
    for element in 0..mesh.element_count() {
        let nodes = mesh.element(element);
        for facet in 0..problem.element().facet_count() {
            let local = problem.element().facet_nodes(facet).iter();
            let mut side: Vec<usize> = local.map(|&a| nodes[a]).collect();
            side.sort_unstable();
            if let Some(other) = sides.insert(side, element) {
                sum += (means[element] - means[other]) * (means[element] - means[other]);
                pairs += 1;
            }
        }
    }
    // The first of equals, so that the answer does not hang on the order of comparison.
    let largest =
        (0..inside.len()).max_by(|&a, &b| inside[a].total_cmp(&inside[b]).then(b.cmp(&a)));
    let worst = largest.filter(|_| pairs > 0)?;
    Some(Spread {
        inside: (inside.iter().sum::<f64>() / inside.len() as f64).sqrt(),
        between: (sum / pairs as f64).sqrt(),
        worst,
        worst_inside: inside[worst].sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::Condition;
    use crate::mesh::{Mesh, Rectangle};

    #[test]
    fn points_that_part_inside_an_element_are_told_from_a_gradient() {
        let mesh = Mesh::rectangle(&Rectangle {
            size: [3.0, 1.0],
            elements: [3, 1],
        });
        let conditions = Condition::pin::<2>("corners");
        let problem = Problem::plane_strain(mesh.expect("sound"), conditions, 0).expect("sound");
        let mut values: Vec<f64> = (0..12).map(|point| f64::from(point / 4)).collect();
        let smooth = spread(&problem, &values).expect("neighbours");
        assert_eq!((smooth.inside, smooth.between), (0.0, 1.0));
        for (point, value) in values[4..8].iter_mut().enumerate() {
            *value += if point % 2 == 0 { -3.0 } else { 3.0 };
        }
        let parted = spread(&problem, &values).expect("neighbours");
        assert_eq!((parted.worst, parted.worst_inside), (1, 3.0));
        assert_eq!((parted.inside, parted.between), (3.0_f64.sqrt(), 1.0));
    }
}
