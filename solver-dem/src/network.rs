//! The linear response of the contact network: the tangent of a REV.
//!
//! With r(q, F) the unbalanced forces and moments, q the positions and rotations of the grains
//! relative to the motion of the cell, C = ∂σ/∂L − ∂σ/∂q · (∂r/∂q)⁻¹ · ∂r/∂L.

mod block_lu;
mod elimination;

use pulp::NullaryFnOnce;

use crate::{
    contact::Status,
    dynamics::{Assembly, Geometry, Link},
    simd::Simd,
    tensor::{Tensor4, Vector},
};
use block_lu::BlockLu;
use elimination::Elimination;

/// Two displacements and a rotation, in rows of four.
type Stiffness<'a> = BlockLu<'a, 3, 4>;

/// Which response of the contacts is linearised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Linearisation {
    /// Statuses of the return mapping over the whole increment from the reference state.
    Algorithmic,
    /// All closed contacts stick, from the current state.
    Elastic,
}

/// A small motion of a contact: dδ, t·d(branch), and the rotations of both grains.
#[derive(Clone, Copy)]
struct Motion {
    overlap: f64,
    tangential: f64,
    rotations: [f64; 2],
}

/// The answer: force on j, and the moments on i and j.
struct Rate {
    force: Vector<2>,
    moments: [f64; 2],
}

/// A closed contact ready to be differentiated.
struct Linear {
    geometry: Geometry,
    i: usize,
    j: usize,
    normal: f64,
    tangential: f64,
    kn: f64,
    kt: f64,
    friction: f64,
}

impl Linear {
    #[inline(always)]
    fn new(assembly: &Assembly<'_>, link: &Link, kind: Linearisation) -> Self {
        let mut geometry = assembly.geometry(link);
        if kind == Linearisation::Elastic {
            geometry.status = Status::Sticking;
            geometry.turns = [0.0; 2];
            geometry.slip = 0.0;
            geometry.share = 1.0;
            geometry.share_rate = 0.0;
        }
        let law = assembly.law();
        Self {
            geometry,
            i: link.i as usize,
            j: link.j as usize,
            normal: link.normal,
            tangential: link.tangential,
            kn: law.normal_stiffness,
            kt: law.tangential_stiffness,
            friction: law.friction,
        }
    }

    /// The motion that belongs to a change `du` of the branch vector.
    #[inline(always)]
    fn motion(&self, du: &Vector<2>, rotations: [f64; 2]) -> Motion {
        let n = &self.geometry.n;
        Motion {
            overlap: -(n[0] * du[0] + n[1] * du[1]),
            tangential: -n[1] * du[0] + n[0] * du[1],
            rotations,
        }
    }

    /// d(f_n n − f_t t) and d((R − δ/2) f_t), with dn = t dα, dt = −n dα, dα = t·du/d.
    #[inline(always)]
    fn rate(&self, m: &Motion) -> Rate {
        let g = &self.geometry;
        let [ai, aj] = g.arms;
        let dalpha = m.tangential / g.distance;
        let dnormal = self.kn * m.overlap;
        let dtangential = match g.status {
            Status::Sliding => self.tangential.signum() * self.friction * self.kn * m.overlap,
            Status::Sticking => {
                let dslip = (ai + aj) * dalpha
                    - ai * m.rotations[0]
                    - aj * m.rotations[1]
                    - 0.5 * m.overlap * (g.turns[0] + g.turns[1]);
                self.kt * (g.share * dslip + g.share_rate * m.overlap * g.slip)
            }
        };
        let along = dnormal + self.tangential * dalpha;
        let across = self.normal * dalpha - dtangential;
        let half = -0.5 * m.overlap * self.tangential;
        Rate {
            force: [
                along * g.n[0] - across * g.n[1],
                along * g.n[1] + across * g.n[0],
            ],
            moments: [half + ai * dtangential, half + aj * dtangential],
        }
    }

    /// The force on j.
    #[inline(always)]
    fn force(&self) -> Vector<2> {
        let n = &self.geometry.n;
        [
            self.normal * n[0] + self.tangential * n[1],
            self.normal * n[1] - self.tangential * n[0],
        ]
    }
}

/// The tangent C_ijkl = ∂σ_ij/∂L_kl at the assembly's current configuration (forces computed).
/// `network` is that of its contacts; `regularisation` is a stiffness on each grain's diagonal over kn. `None` when the network has
/// no contacts or its stiffness is singular to working precision.
pub(crate) fn tangent(
    assembly: &Assembly<'_>,
    network: &mut Network<'_>,
    kind: Linearisation,
    regularisation: f64,
) -> Option<Tensor4<2>> {
    let response = LinearResponse {
        assembly,
        network,
        kind,
        regularisation,
    };
    Simd::run(response)
}

struct LinearResponse<'n, 'p, 'a> {
    assembly: &'n Assembly<'a>,
    network: &'n mut Network<'p>,
    kind: Linearisation,
    regularisation: f64,
}

impl NullaryFnOnce for LinearResponse<'_, '_, '_> {
    type Output = Option<Tensor4<2>>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        linear_response(self.assembly, self.network, self.kind, self.regularisation)
    }
}

#[inline(always)]
fn linear_response(
    assembly: &Assembly<'_>,
    network: &mut Network<'_>,
    kind: Linearisation,
    regularisation: f64,
) -> Option<Tensor4<2>> {
    let contacts: Vec<Linear> = assembly
        .closed()
        .map(|link| Linear::new(assembly, &link, kind))
        .collect();
    let n = assembly.len();
    if contacts.is_empty() || contacts.len() != network.pattern.edges() {
        return None;
    }
    let length = typical_arm(&contacts);
    let matrix = &mut network.stiffness;
    matrix.clear();
    let mut loads = vec![[[0.0; 4]; 3]; n];
    for (edge, contact) in contacts.iter().enumerate() {
        add_stiffness(matrix, edge, contact, length);
        for (case, du) in stretches(&contact.geometry.branch).into_iter().enumerate() {
            let rate = contact.rate(&contact.motion(&du, [0.0; 2]));
            for k in 0..2 {
                loads[contact.i][k][case] -= rate.force[k];
                loads[contact.j][k][case] += rate.force[k];
            }
            loads[contact.i][2][case] += rate.moments[0] / length;
            loads[contact.j][2][case] += rate.moments[1] / length;
        }
    }
    steady(matrix, &contacts, n, regularisation);
    // −(∂r/∂q) dq = ∂r/∂L.
    if !matrix.factorise() {
        return None;
    }
    matrix.solve(&mut loads);

    let stress = assembly.stress();
    let volume = assembly.cell.volume();
    let mut c = [[[[0.0; 2]; 2]; 2]; 2];
    for contact in &contacts {
        let f = contact.force();
        let branch = contact.geometry.branch;
        for (case, du) in stretches(&branch).into_iter().enumerate() {
            let (qi, qj) = (&loads[contact.i], &loads[contact.j]);
            let total = [
                du[0] + qj[0][case] - qi[0][case],
                du[1] + qj[1][case] - qi[1][case],
            ];
            let rotations = [qi[2][case] / length, qj[2][case] / length];
            let rate = contact.rate(&contact.motion(&total, rotations));
            let (k, l) = (case / 2, case % 2);
            for a in 0..2 {
                for b in 0..2 {
                    c[a][b][k][l] -= (rate.force[a] * branch[b] + f[a] * total[b]) / volume;
                }
            }
        }
    }
    for k in 0..2 {
        for l in 0..2 {
            let shear = 0.5 * (c[0][1][k][l] + c[1][0][k][l]);
            c[0][1][k][l] = shear;
            c[1][0][k][l] = shear;
        }
        // The volume grows with tr L.
        for a in 0..2 {
            for b in 0..2 {
                c[a][b][k][k] -= stress[a][b];
            }
        }
    }
    c.iter()
        .flatten()
        .flatten()
        .flatten()
        .all(|x| x.is_finite())
        .then_some(c)
}

/// The elimination of the contacts of an assembly. Assemblies at the same configuration share it.
pub(crate) fn pattern_of(assembly: &Assembly<'_>) -> Elimination {
    let edges: Vec<_> = assembly
        .closed()
        .map(|c| (c.i as usize, c.j as usize))
        .collect();
    Elimination::new(assembly.len(), &edges)
}

/// Room for the stiffness of a network with a given pattern.
pub(crate) struct Network<'a> {
    pattern: &'a Elimination,
    stiffness: Stiffness<'a>,
}

impl<'a> Network<'a> {
    pub fn new(pattern: &'a Elimination) -> Self {
        Self {
            pattern,
            stiffness: Stiffness::new(pattern),
        }
    }
}

/// Half the mean branch length: it scales rotations so that all unknowns are displacements.
fn typical_arm(contacts: &[Linear]) -> f64 {
    0.5 * contacts.iter().map(|c| c.geometry.distance).sum::<f64>() / contacts.len() as f64
}

/// The change of a branch vector with each component of L: du_a = δ_ak l_l, in the order kl =
/// 11, 12, 21, 22.
fn stretches(branch: &Vector<2>) -> [Vector<2>; 4] {
    [
        [branch[0], 0.0],
        [branch[1], 0.0],
        [0.0, branch[0]],
        [0.0, branch[1]],
    ]
}

/// Adds −∂r/∂q of one contact.
#[inline(always)]
fn add_stiffness(matrix: &mut Stiffness<'_>, edge: usize, contact: &Linear, length: f64) {
    // Column of the contact's six unknowns: x_i, y_i, θ_i, x_j, y_j, θ_j.
    let mut columns = [[0.0; 6]; 6];
    for (unknown, column) in columns.iter_mut().enumerate() {
        let (mut du, mut rotations) = ([0.0; 2], [0.0; 2]);
        let side = unknown / 3;
        match unknown % 3 {
            2 => rotations[side] = 1.0 / length,
            k => du[k] = if side == 0 { -1.0 } else { 1.0 },
        }
        let rate = contact.rate(&contact.motion(&du, rotations));
        *column = [
            rate.force[0],
            rate.force[1],
            -rate.moments[0] / length,
            -rate.force[0],
            -rate.force[1],
            -rate.moments[1] / length,
        ];
    }
    add_part(matrix.diagonal(contact.i), &columns, 0, 0);
    add_part(matrix.diagonal(contact.j), &columns, 3, 3);
    let [upper, lower] = matrix.coupling(edge);
    add_part(upper, &columns, 0, 3);
    add_part(lower, &columns, 3, 0);
}

/// Adds the 3×3 part of a contact's stiffness that begins at the given row and column.
fn add_part(block: &mut [[f64; 4]; 3], columns: &[[f64; 6]; 6], row: usize, column: usize) {
    for a in 0..3 {
        for b in 0..3 {
            block[a][b] += columns[column + b][row + a];
        }
    }
}

/// Removes the rigid translations and the freedom of rattlers. A spring on one grain that carries
/// load is exact, since nothing pulls it; rattlers get just enough to be regular.
fn steady(matrix: &mut Stiffness<'_>, contacts: &[Linear], n: usize, regularisation: f64) {
    let kn = contacts[0].kn;
    let mut degree = vec![0u32; n];
    for contact in contacts {
        degree[contact.i] += 1;
        degree[contact.j] += 1;
    }
    let mut held = 0;
    for grain in 0..n {
        if degree[grain] > degree[held] {
            held = grain;
        }
        let spring = match degree[grain] {
            0 => kn,
            // A grain with one contact follows its partner: anything stiffer would carry load.
            _ => 1e-7 * kn,
        };
        for k in 0..3 {
            matrix.diagonal(grain)[k][k] += spring + regularisation * kn;
        }
    }
    for k in 0..2 {
        matrix.diagonal(held)[k][k] += kn;
    }
}

/// The affine (Kruyt) operator (1/V) Σ (kn n l n l + kt t l t l), an upper bound of the stiffness; it
/// stands in where a network cannot be linearised. Zero without contacts.
pub(crate) fn affine(assembly: &Assembly<'_>) -> Tensor4<2> {
    let volume = assembly.cell.volume();
    let law = assembly.law();
    let mut c = [[[[0.0; 2]; 2]; 2]; 2];
    for link in assembly.closed() {
        let Geometry { n, branch, .. } = assembly.geometry(&link);
        let t = [-n[1], n[0]];
        // Symmetrised in each pair of indices: v = ½(n ⊗ l + l ⊗ n).
        let pair = |a: &Vector<2>, i: usize, j: usize| 0.5 * (a[i] * branch[j] + a[j] * branch[i]);
        for i in 0..2 {
            for j in 0..2 {
                for k in 0..2 {
                    for l in 0..2 {
                        c[i][j][k][l] += (law.normal_stiffness * pair(&n, i, j) * pair(&n, k, l)
                            + law.tangential_stiffness * pair(&t, i, j) * pair(&t, k, l))
                            / volume;
                    }
                }
            }
        }
    }
    c
}
