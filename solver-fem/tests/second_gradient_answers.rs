//! Second gradient on problems with a known solution.

mod common;

use std::sync::Arc;

use common::{at_rest, drive, elastic_step, hold, node_at};
use solver_fem::boundary::{Condition, Target, Tie, Value};
use solver_fem::elastic::Elastic;
use solver_fem::element::{PlaneElement, Q8};
use solver_fem::mesh::{Annulus, AnnulusExtent, Mesh, Rectangle};
use solver_fem::newton::{MacroState, Request, StepSettings, StepSolver};
use solver_fem::post;
use solver_fem::problem::{Problem, Setup};
use solver_fem::second_gradient::{SecondGradient, Side};
use solver_fem::tensor::{self, Tensor2};
use solver_fem::{ConstitutiveResponse, Smoothness};

/// Error of u_r at the inner wall under pressures, relative. Lamé's field is exact for every D: div
/// and rot are uniform in it.
fn lame_error(kind: PlaneElement, elements: usize, modulus: f64) -> f64 {
    // Small enough for the square of the strain not to show, large enough for the roundoff of positions.
    let (a, b, pressure) = (1.0, 3.0, 1e-7);
    let mesh = Mesh::annulus(&Annulus {
        inner_radius: a,
        outer_radius: b,
        circumferential: elements,
        radial: elements,
        growth: 1.0,
        extent: AnnulusExtent::Quarter,
    })
    .expect("sound");
    let mesh = match kind {
        PlaneElement::T6 => mesh.into_triangles(elements),
        _ => mesh,
    };
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
        Condition::pressure("outer", Value::load(1)),
    ];
    let mut second_gradient = SecondGradient::uniform(&mesh, modulus);
    for plane in ["symmetry_x", "symmetry_y"] {
        second_gradient.sides.insert(plane.into(), Side::Symmetry);
    }
    let setup = Setup {
        second_gradient,
        ..Setup::new(mesh, kind.element(), conditions, 2)
    };
    let problem = Arc::new(Problem::build(setup).expect("sound"));
    let law = Elastic::new(1.0, 0.25).expect("stable");
    let start = at_rest(&problem, &law, &[0.0, 0.0]);
    let outer = 0.4 * pressure;
    let outcome = elastic_step(&problem, &law, &start, &[pressure, outer], 1e-6)
        .unwrap_or_else(|failure| panic!("{failure}"));
    let big_a = (pressure * a * a - outer * b * b) / (b * b - a * a);
    let big_b = (pressure - outer) * a * a * b * b / (b * b - a * a);
    let exact = big_a * a / (2.0 * (law.lambda + law.shear)) + big_b / (2.0 * law.shear * a);
    let node = node_at(&problem, a, 0.0);
    (outcome.state.displacement_of(node)[0] / exact - 1.0).abs()
}

#[test]
fn lames_cylinder_converges_to_the_same_field_for_every_modulus() {
    // T6 has more multipliers than v can follow: it is stiffer, and converges all the same.
    for (kind, modulus, bound, order) in [
        (PlaneElement::Q8, 1e-8, 1e-4, 3.5),
        (PlaneElement::Q8, 1e-4, 1e-4, 3.5),
        (PlaneElement::Q8, 1e-2, 8e-4, 1.7),
        (PlaneElement::T6, 1e-4, 6e-3, 2.5),
        (PlaneElement::T6, 1e-2, 8e-3, 2.2),
    ] {
        let (coarse, fine) = (lame_error(kind, 8, modulus), lame_error(kind, 16, modulus));
        let found = format!("{kind:?}, D/E {modulus:.0e}: {coarse:.2e} to {fine:.2e}");
        assert!(coarse < bound && (coarse / fine).log2() > order, "{found}");
    }
}

/// Nodes of `boundary` that follow those of `to` across the body along `axis`.
fn across(mesh: &Mesh<2>, boundary: &str, to: &str, axis: usize) -> Vec<Tie> {
    let nodes = |name: &str| -> Vec<usize> {
        let mut nodes: Vec<usize> = mesh.boundaries[name]
            .iter()
            .flat_map(|facet| {
                let [a, b, c] = [[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]][facet.local];
                let element = mesh.element(facet.element);
                [element[a], element[b], element[c]]
            })
            .collect();
        nodes.sort_by(|&a, &b| mesh.nodes[a][1 - axis].total_cmp(&mesh.nodes[b][1 - axis]));
        nodes.dedup();
        nodes
    };
    let pairs = nodes(boundary).into_iter().zip(nodes(to));
    pairs.map(|(node, to)| Tie { node, to }).collect()
}

/// Largest error of v12 at the corners of a sheared layer, over the largest v12.
fn layer_error(elements: usize, length: f64) -> f64 {
    let law = Elastic::new(1.0, 0.25).expect("stable");
    let modulus = law.shear * length * length;
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0 / elements as f64, 1.0],
        elements: [1, elements],
    })
    .expect("sound");
    let conditions = vec![
        hold("bottom", 0),
        hold("bottom", 1),
        hold("top", 1),
        drive("top", 0, 0),
    ];
    let mut second_gradient = SecondGradient::uniform(&mesh, modulus);
    for face in ["bottom", "top"] {
        // Nothing but v12: in a tied strip the means of u_1,1 and u_2,1 vanish by themselves, and
        // holding v11 and v21 at both faces too would leave one λ too many.
        let side = Side::Held(vec![[0, 1]]);
        second_gradient.sides.insert(face.into(), side);
    }
    let ties = across(&mesh, "right", "left", 0);
    let setup = Setup {
        second_gradient,
        ties,
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, 1)
    };
    let problem = Arc::new(Problem::build(setup).expect("sound"));
    let start = at_rest(&problem, &law, &[0.0]);
    let shift = 1e-5;
    let state = elastic_step(&problem, &law, &start, &[shift], 1e-8)
        .unwrap_or_else(|failure| panic!("{failure}"))
        .state;
    // u' = C[1 − cosh((y − ½)/l)/cosh(½/l)], C = U/(1 − 2l tanh(½/l)).
    let c = shift / (1.0 - 2.0 * length * (0.5 / length).tanh());
    let exact = |y: f64| c * (1.0 - ((y - 0.5) / length).cosh() / (0.5 / length).cosh());
    let fields = state.second_gradient.expect("carried");
    let nodes = problem.layout().gradient_nodes();
    let mut worst: f64 = 0.0;
    for (node, v) in nodes.zip(fields.increment.chunks(4)) {
        worst = worst.max((v[1] - exact(problem.mesh().nodes[node][1])).abs());
    }
    worst / c
}

#[test]
fn a_sheared_layer_has_boundary_layers_of_the_internal_length() {
    let errors = [8, 16, 32].map(|elements| layer_error(elements, 0.1));
    assert!(errors[2] < 1.2e-2, "{errors:?}");
    assert!((errors[1] / errors[2]).log2() > 1.8, "order 2: {errors:?}");
}

/// σ11 = E ε up to the peak, then falling with slope −H (nonlinear elastic: unloading goes the same
/// way back); the other components are elastic without Poisson's effect.
struct Softening {
    peak: f64,
    slope: f64,
}

impl Softening {
    fn respond(&self, total: &Tensor2<2>, weakness: f64) -> ConstitutiveResponse<2> {
        let peak = self.peak * weakness;
        let strain = total[0][0] - 1.0;
        let (axial, modulus) = if strain <= peak {
            (strain, 1.0)
        } else {
            (peak - self.slope * (strain - peak), -self.slope)
        };
        let shear = 0.5 * (total[0][1] + total[1][0]);
        let mut tangent = tensor::zero4::<2>();
        tangent[0][0][0][0] = modulus;
        tangent[1][1][1][1] = 1.0;
        for (i, j) in [(0, 1), (1, 0)] {
            tangent[i][j][i][j] = 0.5;
            tangent[i][j][j][i] = 0.5;
        }
        ConstitutiveResponse {
            stress: [[axial, shear], [shear, total[1][1] - 1.0]],
            tangent,
            elastic_tangent: tangent,
            smooth: Smoothness::Smooth,
        }
    }
}

/// Width of the softening zone of a bar of length 2 (one half computed), E = 1, H = 0.1.
fn band_width(elements: usize, modulus: f64) -> f64 {
    let law = Softening {
        peak: 1e-4,
        slope: 0.1,
    };
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 1.0 / elements as f64],
        elements: [elements, 1],
    })
    .expect("sound");
    let conditions = vec![
        Condition::symmetry("left", 0),
        hold("bottom", 1),
        drive("right", 0, 0),
    ];
    let mut second_gradient = SecondGradient::uniform(&mesh, modulus);
    // In a tied strip the mean of u_1,2 vanishes by itself: v12 must not be held at both ends.
    for end in ["left", "right"] {
        second_gradient.sides.insert(end.into(), Side::Free);
    }
    let ties = across(&mesh, "top", "bottom", 1);
    let setup = Setup {
        second_gradient,
        ties,
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, 1)
    };
    let problem = Arc::new(Problem::build(setup).expect("sound"));
    let points = problem.gauss_point_count();
    let weakness = |element: usize| if element == 0 { 0.98 } else { 1.0 };
    let elastic = law.respond(&tensor::identity(), 1.0).tangent;
    let zero = [[0.0; 2]; 2];
    let mut state = MacroState::initial(
        &problem,
        &vec![zero; points],
        &vec![elastic; points],
        &[0.0],
    )
    .expect("fits");
    let settings = StepSettings::smooth(1e-7);
    // Coarse steps to the peak, fine ones past it, where the band forms.
    let fine = (0..60).map(|step| 0.9 + 0.01 * f64::from(step));
    let coarse = (0..15).map(|step| 1.5 + 0.1 * f64::from(step));
    for (step, part) in fine.chain(coarse).enumerate() {
        let loads = [law.peak * part];
        let before = post::deformation_gradients(&problem, &state.coordinates);
        let mut solver =
            StepSolver::begin(&problem, &state, &state.loads, &loads, &settings).expect("fits");
        state = loop {
            match solver.next() {
                Request::Evaluate(wave) => {
                    let answers: Vec<_> = wave
                        .points
                        .iter()
                        .map(|(point, f)| {
                            let total = tensor::product(f, &before[point.index()]);
                            law.respond(&total, weakness(problem.locate(*point).0))
                        })
                        .collect();
                    solver.advance(&answers);
                }
                Request::Converged(outcome) => break outcome.state,
                Request::Failed(failure) => panic!("step {step}: {failure}"),
            }
        };
    }
    // Where v11 along the bottom crosses the strain of the peak.
    let fields = state.second_gradient.expect("carried");
    let nodes = problem.layout().gradient_nodes();
    let mut along: Vec<(f64, f64)> = nodes
        .zip(fields.gradient.chunks(4))
        .filter(|(node, _)| problem.mesh().nodes[*node][1] == 0.0)
        .map(|(node, v)| (problem.mesh().nodes[node][0], v[0]))
        .collect();
    along.sort_by(|a, b| a.0.total_cmp(&b.0));
    let crossing = along.windows(2).find_map(|pair| {
        let [(x0, v0), (x1, v1)] = [pair[0], pair[1]];
        let within = v0 > law.peak && v1 <= law.peak;
        within.then(|| x0 + (x1 - x0) * (v0 - law.peak) / (v0 - v1))
    });
    2.0 * crossing.expect("a band that ends inside the bar")
}

#[test]
fn a_softening_bar_has_a_band_of_the_known_width_on_every_mesh() {
    // w = 2 (π − arctan √(H/E)) √(D/H).
    let (h, d) = (0.1_f64, 1e-3_f64);
    let exact = 2.0 * (std::f64::consts::PI - h.sqrt().atan()) * (d / h).sqrt();
    assert!((exact - 0.56706).abs() < 1e-5);
    for elements in [10, 20, 40] {
        let width = band_width(elements, d);
        assert!(
            (width - exact).abs() < 1.0 / elements as f64,
            "{elements}: {width:.4}"
        );
    }
}

/// The strips above rely on it.
#[test]
fn a_tied_strip_moves_as_one() {
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 1.0],
        elements: [2, 2],
    })
    .expect("sound");
    let ties = across(&mesh, "right", "left", 0);
    assert_eq!(ties.len(), 5);
    let pinned = Condition::displacement(Target::node_set("bottom_mid"), 0, Value::Constant(0.0));
    let conditions = vec![
        hold("bottom", 1),
        drive("top", 1, 0),
        pinned,
        hold("bottom", 0),
    ];
    let setup = Setup {
        ties: ties.clone(),
        ..Setup::new(mesh, Arc::new(Q8::default()), conditions, 1)
    };
    let problem = Arc::new(Problem::build(setup).expect("sound"));
    let law = Elastic::new(1.0, 0.25).expect("stable");
    let start = at_rest(&problem, &law, &[0.0]);
    let state = elastic_step(&problem, &law, &start, &[-0.1], 1e-10)
        .unwrap_or_else(|failure| panic!("{failure}"))
        .state;
    for tie in ties {
        let pair = [tie.node, tie.to].map(|node| state.displacement_of(node));
        for i in 0..2 {
            assert!((pair[0][i] - pair[1][i]).abs() < 1e-15);
        }
    }
    // Held against widening: no lateral strain, and the known axial stress at once.
    let stress = state.stress_at(solver_fem::GaussPointId(5));
    assert!(stress[0][0] < -1e-3 && stress[0][1].abs() < 1e-12);
}
