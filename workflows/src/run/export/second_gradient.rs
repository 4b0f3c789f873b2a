//! The fields of a second gradient.

use solver_fem::{
    newton::MacroState, post, problem::Problem, second_gradient::SecondGradientState,
};

use super::fields::Owned;

/// At nodes: v. At cells: λ, the double stress, and how far grad u and v part.
pub fn over_mesh(problem: &Problem<2>, state: &MacroState<2>) -> (Vec<Owned>, Vec<Owned>) {
    let Some(fields) = &state.second_gradient else {
        return (Vec::new(), Vec::new());
    };
    let v = tensors(&post::gradient_at_nodes(problem, &fields.gradient));
    let per_element = problem.points_per_element();
    let norms = norms(fields);
    let mean = |chunk: &[f64]| chunk.iter().sum::<f64>() / chunk.len() as f64;
    let mut multipliers = tensors(&fields.multipliers).into_iter();
    let mut mismatches = fields.mismatch.iter().copied();
    // Plain elements have neither.
    let (mut multiplier, mut mismatch) = (Vec::new(), Vec::new());
    for element in 0..problem.mesh().element_count() {
        let carried = problem.layout().multiplier_dof(element).is_some();
        let of = carried.then(|| multipliers.next()).flatten();
        multiplier.push(of.unwrap_or([[f64::NAN; 2]; 2]));
        let of = carried.then(|| mismatches.next()).flatten();
        mismatch.push(of.unwrap_or(f64::NAN));
    }
    let at_cells = vec![
        Owned::tensor("multiplier", multiplier),
        Owned::scalar(
            "double_stress",
            norms.chunks(per_element).map(mean).collect(),
        ),
        Owned::scalar("gradient_mismatch", mismatch),
    ];
    (vec![Owned::tensor("gradient", v)], at_cells)
}

/// At Gauss points: the double stress.
pub fn at_points(state: &MacroState<2>) -> Vec<Owned> {
    let fields = state.second_gradient.as_ref();
    let norms = fields.map(|fields| Owned::scalar("double_stress", norms(fields)));
    norms.into_iter().collect()
}

/// √(χ_ijk χ_ijk) of every Gauss point.
fn norms(fields: &SecondGradientState) -> Vec<f64> {
    let (points, _) = fields.double_stress.as_chunks::<8>();
    let norm = |chi: &[f64; 8]| chi.iter().map(|x| x * x).sum::<f64>().sqrt();
    points.iter().map(norm).collect()
}

fn tensors(flat: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let (rows, _) = flat.as_chunks::<4>();
    rows.iter()
        .map(|[xx, xy, yx, yy]| [[*xx, *xy], [*yx, *yy]])
        .collect()
}
