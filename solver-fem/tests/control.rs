//! Steps that follow a volume or a length instead of a load.

mod common;

use std::sync::Arc;

use common::{at_rest, column, drive, elastic_answers, elastic_step, hold, node_at};
use solver_fem::boundary::{CavityProblem, Condition, Value};
use solver_fem::elastic::Elastic;
use solver_fem::mesh::{Annulus, AnnulusExtent, Mesh, Rectangle};
use solver_fem::newton::{
    BeginError, Control, FailureReason, MacroState, Path, Request, StepFailure, StepOutcome,
    StepSettings, StepSolver,
};
use solver_fem::problem::Problem;
use solver_fem::tensor::{Tensor2, product};
use solver_fem::{ConstitutiveResponse, GaussPointId, Smoothness};

fn ring(extent: AnnulusExtent, elements: usize, conditions: Vec<Condition>) -> Arc<Problem<2>> {
    let mesh = Mesh::annulus(&Annulus {
        inner_radius: 1.0,
        outer_radius: 3.0,
        circumferential: elements,
        radial: elements,
        growth: 1.2,
        extent,
    });
    Arc::new(Problem::plane_strain(mesh.expect("sound"), conditions, 1).expect("sound"))
}

fn quarter(elements: usize) -> Arc<Problem<2>> {
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::pressure("inner", Value::load(0)),
    ];
    ring(AnnulusExtent::Quarter, elements, conditions)
}

fn pins() -> Vec<Condition> {
    let hold = |set: &str, component| {
        let target = solver_fem::boundary::Target::node_set(set);
        Condition::displacement(target, component, Value::Constant(0.0))
    };
    vec![hold("axis_x", 1), hold("axis_y", 0)]
}

#[test]
fn the_volume_of_a_cavity_is_that_of_the_circle() {
    let pi = std::f64::consts::PI;
    let whole = ring(AnnulusExtent::Full, 16, pins());
    let inner = whole.cavity("inner").expect("closed").initial_volume();
    let outer = whole.cavity("outer").expect("closed").initial_volume();
    // A quadratic arc of 22.5° misses the circle by 1.6e-5.
    assert!((inner / pi - 1.0).abs() < 1e-4, "{inner}");
    assert!((outer / (9.0 * pi) - 1.0).abs() < 1e-4, "{outer}");
    let part = quarter(4)
        .cavity("inner")
        .expect("ends on the axes")
        .initial_volume();
    assert!((4.0 * part / inner - 1.0).abs() < 1e-12);
}

#[test]
fn the_gradient_of_the_expansion_is_exact() {
    for (problem, boundary) in [
        (quarter(3), "inner"),
        (quarter(3), "outer"),
        (ring(AnnulusExtent::Full, 8, pins()), "inner"),
    ] {
        let cavity = problem.cavity(boundary).expect("measurable");
        let mut seed = 7_u64;
        let mut noise = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let x: Vec<f64> = problem
            .initial()
            .iter()
            .map(|x| x + 0.05 * noise())
            .collect();
        let gradient = cavity.expansion_gradient(&x);
        let mut worst = 0.0_f64;
        for dof in 0..x.len() {
            let at = |h: f64| {
                let mut x = x.clone();
                x[dof] += h;
                cavity.expansion(&x)
            };
            let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
            worst = worst.max((difference - gradient[dof]).abs());
        }
        assert!(worst < 1e-9, "{boundary}: {worst:e}");
        assert!(gradient.iter().any(|g| g.abs() > 1e-3));
    }
}

#[test]
fn a_boundary_without_a_volume_of_its_own_says_why() {
    let problem = quarter(2);
    assert!(matches!(
        problem.cavity("symmetry_x"),
        Err(CavityProblem::Flat(_))
    ));
    assert!(matches!(
        problem.cavity("wall"),
        Err(CavityProblem::Unknown(_))
    ));
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [2, 2],
    })
    .expect("sound");
    let held = vec![hold("bottom", 1), hold("left", 0), drive("top", 1, 0)];
    let block = Problem::plane_strain(mesh, held, 1).expect("sound");
    assert!(matches!(
        block.cavity("right"),
        Err(CavityProblem::Open { .. })
    ));
    let mesh = Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements: [2, 2],
    })
    .expect("sound");
    let held = vec![hold("bottom", 1), hold("left", 0), hold("right", 0)];
    let trough = Problem::plane_strain(mesh, held, 0).expect("sound");
    assert_eq!(
        trough.cavity("top"),
        Err(CavityProblem::Parallel {
            boundary: "top".into(),
            planes: [0.0, 1.0]
        })
    );
}

/// A mesh drawn with its corner at the origin has its cavity somewhere else, and the same volume.
#[test]
fn a_cavity_has_the_same_volume_wherever_its_planes_of_symmetry_meet() {
    let quarter = vec![hold("symmetry_x", 1), hold("symmetry_y", 0)];
    let half = vec![hold("symmetry_x", 1), pins().remove(1)];
    let parts = [
        (AnnulusExtent::Quarter, quarter),
        (AnnulusExtent::Half, half),
        (AnnulusExtent::Full, pins()),
    ];
    for (extent, held) in parts {
        let moved = |by: [f64; 2]| {
            let mesh = Mesh::annulus(&Annulus {
                inner_radius: 1.0,
                outer_radius: 3.0,
                circumferential: 4,
                radial: 2,
                growth: 1.0,
                extent,
            });
            let mut mesh = mesh.expect("sound");
            for node in &mut mesh.nodes {
                *node = [node[0] + by[0], node[1] + by[1]];
            }
            Problem::plane_strain(mesh, held.clone(), 0).expect("sound")
        };
        let (here, there) = (moved([0.0, 0.0]), moved([-7.0, 40.0]));
        for boundary in ["inner", "outer"] {
            let [a, b] =
                [&here, &there].map(|problem| problem.cavity(boundary).expect("ends on planes"));
            let ratio = b.initial_volume() / a.initial_volume();
            assert!((ratio - 1.0).abs() < 1e-13, "{boundary}: {ratio}");
            // Any motion that leaves the planes where they are.
            let move_on = |problem: &Problem<2>| -> Vec<f64> {
                let mut x = problem.initial().to_vec();
                for &dof in &problem.constraints().free {
                    x[dof] += 0.02 * here.initial()[dof] + 0.01 * (dof as f64).sin();
                }
                x
            };
            let (x, y) = (move_on(&here), move_on(&there));
            let (e, f) = (a.expansion(&x), b.expansion(&y));
            assert!(e > 0.02 && (e - f).abs() < 1e-12, "{boundary}: {e} {f}");
            let (g, h) = (a.expansion_gradient(&x), b.expansion_gradient(&y));
            for &dof in &here.constraints().free {
                assert!(
                    (g[dof] - h[dof]).abs() < 1e-12,
                    "{boundary}: {} {}",
                    g[dof],
                    h[dof]
                );
            }
        }
    }
}

fn follow(
    problem: &Arc<Problem<2>>,
    state: &MacroState<2>,
    control: &Control,
    settings: &StepSettings,
    mut answers: impl FnMut(&[(GaussPointId, Tensor2<2>)]) -> Vec<ConstitutiveResponse<2>>,
) -> Result<StepOutcome<2>, StepFailure> {
    let loads = (&state.loads[..], &state.loads[..], Some(control));
    let mut step = StepSolver::begin_controlled(problem, state, loads, settings).expect("fits");
    let mut request = step.next();
    loop {
        request = match request {
            Request::Evaluate(wave) => {
                let next = step.advance(&answers(&wave.points));
                // Stored and restored at every wave: nothing may get lost on the way.
                let stored = rmp_serde::to_vec(step.state()).expect("plain data");
                let read = rmp_serde::from_slice(&stored).expect("reads back");
                step = StepSolver::restore(problem, read).expect("fits");
                assert_eq!(step.next(), next);
                next
            }
            Request::Converged(outcome) => return Ok(*outcome),
            Request::Failed(failure) => return Err(*failure),
        };
    }
}

/// Lamé: an expansion of the cavity by 2u/a takes p = 2G (u/a) · (b² − a²)/(b² + a² G/(λ+G)).
#[test]
fn an_inflated_cylinder_finds_the_pressure_that_belongs_to_the_volume() {
    let problem = quarter(8);
    let law = Elastic::new(1000.0, 0.25).expect("stable");
    let state = at_rest(&problem, &law, &[0.0]);
    let inflate = |to| Control {
        load: 0,
        path: Path::Expansion {
            boundary: "inner".into(),
            to,
        },
    };
    let settings = StepSettings::smooth(1e-11);
    let answers = |points: &[_]| elastic_answers(&law, &state, points);
    // Positions are rounded: the forces of so small a deformation have no more digits.
    let rough = StepSettings::smooth(1e-6);
    let small = follow(&problem, &state, &inflate(1e-6), &rough, answers).expect("elastic");
    let (a2, b2): (f64, f64) = (1.0, 9.0);
    let u = 0.5e-6;
    let a_part = a2 / (b2 - a2) / (2.0 * (law.lambda + law.shear));
    let b_part = b2 / (b2 - a2) / (2.0 * law.shear);
    let exact = u / (a_part + b_part);
    let found = small.state.loads[0];
    assert!(
        (found / exact - 1.0).abs() < 1e-4,
        "{found} against {exact}"
    );

    // A large expansion: the same state as under the pressure it found.
    let large = follow(&problem, &state, &inflate(0.1), &settings, answers).expect("elastic");
    let cavity = problem.cavity("inner").expect("measurable");
    let reached = cavity.expansion(&large.state.coordinates);
    assert!((reached - 0.1).abs() < 1e-9, "{reached}");
    let again = elastic_step(&problem, &law, &state, &large.state.loads, 1e-11).expect("elastic");
    let node = node_at(&problem, 1.0, 0.0);
    let [one, other] = [&large, &again].map(|outcome| outcome.state.displacement_of(node)[0]);
    assert!((one - other).abs() < 1e-9, "{one} {other}");
    assert!(
        large.sweeps.len() <= again.sweeps.len() + 2,
        "the control costs few sweeps"
    );
}

#[test]
fn a_load_that_cannot_move_what_is_followed_is_told() {
    let conditions = vec![
        Condition::symmetry("symmetry_x", 1),
        Condition::symmetry("symmetry_y", 0),
        Condition::symmetry("inner", 0),
        Condition::symmetry("inner", 1),
        Condition::pressure("outer", Value::load(0)),
    ];
    let problem = ring(AnnulusExtent::Quarter, 2, conditions);
    let law = Elastic::new(1.0, 0.0).expect("stable");
    let state = at_rest(&problem, &law, &[0.0]);
    let control = |load, boundary: &str| Control {
        load,
        path: Path::Expansion {
            boundary: boundary.into(),
            to: 0.1,
        },
    };
    let settings = StepSettings::smooth(1e-9);
    let answers = |points: &[_]| elastic_answers(&law, &state, points);
    let failure = follow(&problem, &state, &control(0, "inner"), &settings, answers);
    let failure = failure.expect_err("the inner wall is held");
    assert_eq!(failure.reason, FailureReason::NoControl { load: 0 });
    let begin = |control| {
        let loads = (&[0.0][..], &[0.0][..], Some(&control));
        StepSolver::begin_controlled(&problem, &state, loads, &settings).map(|_| ())
    };
    assert_eq!(
        begin(control(1, "inner")),
        Err(BeginError::Control { load: 1 })
    );
    assert!(matches!(
        begin(control(0, "wall")),
        Err(BeginError::Cavity(_))
    ));
}

const YOUNG: f64 = 100.0;
const STRENGTH: f64 = 1.0;
/// Shortening of the soft element at its strength.
const AT_STRENGTH: f64 = 0.01;
const SOFT_ELEMENT: u32 = 2;

/// A column of five elements between rollers, whose compressive stress follows the shortening e = 1 − λ of the element at
/// hand: E e, and in the soft one s e/e_p exp(1 − e/e_p), which rises to the strength s at e_p and falls behind it.
struct Column {
    problem: Arc<Problem<2>>,
    state: MacroState<2>,
    /// Total deformation gradient of every point.
    gradients: Vec<Tensor2<2>>,
}

impl Column {
    fn new() -> Self {
        let problem = column(5);
        let law = Elastic::new(YOUNG, 0.0).expect("stable");
        Column {
            state: at_rest(&problem, &law, &[0.0]),
            gradients: vec![[[1.0, 0.0], [0.0, 1.0]]; problem.gauss_point_count()],
            problem,
        }
    }

    /// Compressive stress and its slope.
    fn law(id: GaussPointId, e: f64) -> (f64, f64) {
        if id.0 / 4 != SOFT_ELEMENT {
            return (YOUNG * e, YOUNG);
        }
        let (ratio, scale) = (e / AT_STRENGTH, STRENGTH * libm::exp(1.0 - e / AT_STRENGTH));
        (scale * ratio, scale * (1.0 - ratio) / AT_STRENGTH)
    }

    /// σ follows H = F − 1 by σ_xx = E H_xx, σ_xy = E (H_xy + H_yx)/2 and the law along y; dF = L F.
    fn respond(id: GaussPointId, total: &Tensor2<2>) -> ConstitutiveResponse<2> {
        let (stress, slope) = Self::law(id, 1.0 - total[1][1]);
        let shear = 0.5 * YOUNG;
        let stiffness = [
            [(0, 0, 0, 0), (1, 1, 1, 1)].map(|at| (at, if at.0 == 0 { YOUNG } else { slope })),
            [(0, 1, 0, 1), (0, 1, 1, 0)].map(|at| (at, shear)),
            [(1, 0, 0, 1), (1, 0, 1, 0)].map(|at| (at, shear)),
        ];
        let mut tangent = [[[[0.0; 2]; 2]; 2]; 2];
        for ((i, j, m, n), value) in stiffness.into_iter().flatten() {
            for k in 0..2 {
                tangent[i][j][m][k] += value * total[k][n];
            }
        }
        let sheared = shear * (total[0][1] + total[1][0]);
        ConstitutiveResponse {
            stress: [[YOUNG * (total[0][0] - 1.0), sheared], [sheared, -stress]],
            tangent,
            elastic_tangent: Elastic::new(YOUNG, 0.0).expect("stable").tangent(),
            smooth: Smoothness::Smooth,
        }
    }

    fn step(&mut self, control: &Control) -> Result<StepOutcome<2>, StepFailure> {
        let mut last = Vec::new();
        let before = &self.gradients;
        let settings = StepSettings::smooth(1e-8);
        let outcome = follow(&self.problem, &self.state, control, &settings, |points| {
            let total = |(id, f): &(GaussPointId, Tensor2<2>)| product(f, &before[id.index()]);
            last = points.iter().map(total).collect();
            let pairs = points.iter().zip(&last);
            pairs
                .map(|((id, _), total)| Self::respond(*id, total))
                .collect()
        })?;
        self.gradients = last;
        self.state = outcome.state.clone();
        Ok(outcome)
    }
}

/// The soft element falls faster (slope up to s/(e e_p) = 37) than the four others spring back (E/4 = 25): the column
/// snaps back. In series, the shortening of the whole is 4 stress/E + e, e being that of the soft element.
#[test]
fn the_arc_length_follows_a_column_that_snaps_back() {
    let length = 1e-3;
    let mut column = Column::new();
    let control = |sense| Control {
        load: 0,
        path: Path::ArcLength { length, sense },
    };
    let mut shortenings = Vec::new();
    let mut stress = 0.0;
    for step in 0..60 {
        let sense = (step == 0).then_some(-1.0);
        let outcome = column.step(&control(sense)).expect("on the path");
        stress = -outcome.state.stress_at(GaussPointId(0))[1][1];
        let soft = GaussPointId(4 * SOFT_ELEMENT);
        let e = 1.0 - column.gradients[soft.index()][1][1];
        let shortening = -outcome.state.loads[0];
        assert!(
            (stress - Column::law(soft, e).0).abs() < 1e-7,
            "{stress} {e}"
        );
        let expected = 4.0 * stress / YOUNG + e;
        assert!(
            (shortening - expected).abs() < 1e-7,
            "{shortening} {expected}"
        );
        let moved = outcome.state.increment.expect("kept");
        let nodes = moved.len() as f64 / 2.0;
        let gone = (moved.iter().map(|u| u * u).sum::<f64>() / nodes).sqrt();
        assert!((gone / length - 1.0).abs() < 1e-2, "{gone}");
        shortenings.push(shortening);
    }
    assert!(stress < 0.2 * STRENGTH, "well behind the peak: {stress}");
    let turn = shortenings
        .windows(2)
        .position(|w| w[1] < w[0])
        .expect("it snaps back");
    let back = shortenings[turn..].windows(2).position(|w| w[1] > w[0]);
    let again = turn + back.expect("and goes on");
    assert!(shortenings[turn] - shortenings[again] > 1e-3);
    // Told to, it goes back the way it came.
    let outcome = column.step(&control(Some(1.0))).expect("back");
    let last = shortenings.last().expect("steps");
    assert!(-outcome.state.loads[0] < *last - 1e-4);
}
