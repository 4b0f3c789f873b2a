//! Linear systems as elements make them, for tests and benchmarks of the solvers: plain Q8, and the saddle point of a
//! second gradient with u on 8 nodes, its gradient v on 4 corners and a multiplier λ per element.

#![allow(dead_code, reason = "each user takes its own part")]

use std::sync::Arc;

use solver_fem::assembly::Pattern;
use solver_fem::element::{Element, Q8};
use solver_fem::layout::Field;
use solver_fem::mesh::{Mesh, Rectangle};

/// A matrix with what the solvers want to know of it.
pub struct System<const D: usize> {
    pub pattern: Arc<Pattern>,
    pub fields: Vec<Field>,
    pub centres: Vec<[f64; D]>,
    pub values: Vec<f64>,
}

/// What is solved for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Unknowns {
    Displacement,
    /// With the modulus D of the second gradient, for an elastic modulus of 1.
    SecondGradient(f64),
}

/// Numbers in −1…1 that look like chance.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A 1×2 specimen.
pub fn specimen(elements: [usize; 2]) -> Mesh<2> {
    Mesh::rectangle(&Rectangle {
        size: [1.0, 2.0],
        elements,
    })
    .expect("sound")
}

/// The system of the elements that are kept, held in both directions where y = 0. Every Gauss point has its own
/// unsymmetric tangent, an isotropic one plus chance.
pub fn assemble(mesh: &Mesh<2>, keep: &[usize], unknowns: Unknowns, seed: u64) -> System<2> {
    let mut noise = Noise(seed);
    let local_size = match unknowns {
        Unknowns::Displacement => 16,
        Unknowns::SecondGradient(_) => 36,
    };
    // Numbers of u, v and λ, in this order; node by node, element by element.
    let mut number = vec![None; 6 * mesh.nodes.len() + 4 * mesh.element_count()];
    let places: Vec<Vec<usize>> = keep
        .iter()
        .map(|&element| {
            let nodes = mesh.element(element);
            let u = nodes.iter().flat_map(|n| [2 * n, 2 * n + 1]);
            let first = 2 * mesh.nodes.len();
            let v = nodes[..4]
                .iter()
                .flat_map(|n| (0..4).map(move |i| first + 4 * n + i));
            let first = 6 * mesh.nodes.len();
            let lambda = (0..4).map(|i| first + 4 * element + i);
            u.chain(v).chain(lambda).take(local_size).collect()
        })
        .collect();
    for &place in places.iter().flatten() {
        let held = place < 2 * mesh.nodes.len() && mesh.nodes[place / 2][1] == 0.0;
        if !held {
            number[place] = Some(0);
        }
    }
    let mut size = 0;
    let mut fields = Vec::new();
    for (place, number) in number.iter_mut().enumerate() {
        if number.is_some() {
            *number = Some(size);
            size += 1;
            fields.push(if place < 2 * mesh.nodes.len() {
                Field::Displacement
            } else if place < 6 * mesh.nodes.len() {
                Field::Gradient
            } else {
                Field::Multiplier
            });
        }
    }
    let equations: Vec<Vec<Option<usize>>> = places
        .iter()
        .map(|places| places.iter().map(|&place| number[place]).collect())
        .collect();
    let pattern = Pattern::of_elements(size, &equations);
    let mut values = vec![0.0; pattern.entry_count()];
    for (local, &element) in keep.iter().enumerate() {
        let stiffness = element_matrix(mesh, element, unknowns, &mut noise);
        for (row, stiffness) in stiffness.iter().enumerate().take(local_size) {
            for column in 0..local_size {
                if let Some(entry) = pattern.entry(local, row, column) {
                    values[entry] += stiffness[column];
                }
            }
        }
    }
    System {
        fields,
        centres: keep
            .iter()
            .map(|&element| mesh.element_centre(element))
            .collect(),
        pattern: Arc::new(pattern),
        values,
    }
}

/// ∫ grad u*·C·grad u + D grad v*·grad v + λ*·(grad u − v) + λ·(grad u* − v*).
fn element_matrix(
    mesh: &Mesh<2>,
    element: usize,
    unknowns: Unknowns,
    noise: &mut Noise,
) -> [[f64; 36]; 36] {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let q8 = Q8::default();
    let nodes = mesh.element(element);
    let mut k = [[0.0; 36]; 36];
    for point in q8.quadrature() {
        let [x, y] = point.xi;
        let mut reference = [[0.0; 2]; 8];
        q8.shape_gradients(&point.xi, &mut reference);
        let mut j = [[0.0; 2]; 2];
        for (&node, gradient) in nodes.iter().zip(&reference) {
            for a in 0..2 {
                for b in 0..2 {
                    j[a][b] += mesh.nodes[node][a] * gradient[b];
                }
            }
        }
        let determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let volume = determinant * point.weight;
        let inverse = [
            [j[1][1] / determinant, -j[0][1] / determinant],
            [-j[1][0] / determinant, j[0][0] / determinant],
        ];
        let push = |g: [f64; 2]| {
            [
                g[0] * inverse[0][0] + g[1] * inverse[1][0],
                g[0] * inverse[0][1] + g[1] * inverse[1][1],
            ]
        };
        let mut c = [[[[0.0; 2]; 2]; 2]; 2];
        for i in 0..2 {
            for j in 0..2 {
                c[i][i][j][j] += 0.6;
                c[i][j][i][j] += 0.4;
                c[i][j][j][i] += 0.4;
            }
        }
        for value in c.iter_mut().flatten().flatten().flatten() {
            *value += 0.1 * noise.next();
        }
        let gradients = reference.map(push);
        for (a, ga) in gradients.iter().enumerate() {
            for (b, gb) in gradients.iter().enumerate() {
                for (i, j, m, l) in (0..16).map(|n| (n / 8, n / 4 % 2, n / 2 % 2, n % 2)) {
                    k[2 * a + i][2 * b + m] += volume * ga[j] * c[i][j][m][l] * gb[l];
                }
            }
        }
        let Unknowns::SecondGradient(modulus) = unknowns else {
            continue;
        };
        let bilinear = CORNERS.map(|[a, b]| 0.25 * (1.0 + x * a) * (1.0 + y * b));
        let slopes =
            CORNERS.map(|[a, b]| push([0.25 * a * (1.0 + y * b), 0.25 * b * (1.0 + x * a)]));
        for ij in 0..4 {
            let lambda = 32 + ij;
            for (a, g) in gradients.iter().enumerate() {
                let u = 2 * a + ij / 2;
                k[u][lambda] += volume * g[ij % 2];
                k[lambda][u] += volume * g[ij % 2];
            }
            for a in 0..4 {
                let v = 16 + 4 * a + ij;
                k[v][lambda] -= volume * bilinear[a];
                k[lambda][v] -= volume * bilinear[a];
                for b in 0..4 {
                    let product = slopes[a][0] * slopes[b][0] + slopes[a][1] * slopes[b][1];
                    k[v][16 + 4 * b + ij] += volume * modulus * product;
                }
            }
        }
    }
    k
}

impl<const D: usize> System<D> {
    /// A right-hand side and the solution it belongs to.
    pub fn known(&self) -> (Vec<f64>, Vec<f64>) {
        let exact: Vec<f64> = (0..self.pattern.size)
            .map(|i| (0.37 * i as f64).sin())
            .collect();
        (self.pattern.multiply(&self.values, &exact), exact)
    }
}
