//! Damped dynamics of the assembly: the one kernel behind both solvers.
//!
//! All grains have the mass 1; the time step is 0.3 √(m/k) with k the largest contact stiffness.
//! Damping is local and proportional to the unbalanced force (Cundall 1971): F ← F − α |F| sgn(v),
//! so that it vanishes in equilibrium. Friction comes in two forms:
//!
//! - *return mapping*: tangential forces are a function of the current configuration and of one
//!   reference state, so the end state hardly depends on the way;
//! - *path*: the reference state moves along with every cycle, friction is integrated over time.

use crate::{
    Cell, Contact, ContactLaw, Rev, RevState,
    contact::Status,
    homogenise::symmetric,
    neighbours::pairs,
    tensor::{Tensor2, Vector, invert, product},
};

/// Fraction of √(m/k) per cycle.
const TIME_STEP: f64 = 0.3;
/// Cundall's α in a load step.
const DAMPING: f64 = 0.7;
/// Margin of the pair list over the mean diameter.
const LIST_MARGIN: f64 = 0.1;
/// Cycles between two looks at the pair list.
const LIST_CHECK: u32 = 16;
/// Cycles between two looks at the residual.
pub(crate) const RESIDUAL_CHECK: u32 = 20;

/// How friction is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Friction {
    ReturnMapping,
    Path,
}

/// A pair of near grains, its history and its present force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub i: u32,
    pub j: u32,
    /// Whole cell vectors between the images.
    shift: Vector<2>,
    /// H·shift.
    image: Vector<2>,
    /// R_i + R_j.
    reach: f64,
    /// Branch vector in the reference state.
    branch0: Vector<2>,
    /// Overlap in the reference state; < 0 for a gap.
    overlap0: f64,
    /// Tangential force in the reference state.
    tangential0: f64,
    /// kn δ − f_c now; 0 when open.
    pub normal: f64,
    /// Tangential force now, of j on i along (−n_y, n_x).
    pub tangential: f64,
    /// δ now; ≤ 0 when open.
    pub overlap: f64,
}

/// The geometry of a closed contact, as the linearisation needs it.
pub(crate) struct Geometry {
    pub branch: Vector<2>,
    pub distance: f64,
    pub n: Vector<2>,
    /// R − δ/2 of both grains.
    pub arms: [f64; 2],
    /// Rotation of the branch minus that of each grain since the reference state.
    pub turns: [f64; 2],
    /// u_t and the factor by which a contact made since the reference state counts it.
    pub slip: f64,
    pub share: f64,
    /// d(share)/dδ.
    pub share_rate: f64,
    pub status: Status,
}

/// The state from which return mapping counts displacements.
struct Reference {
    cell: Cell<2>,
    positions: Vec<Vector<2>>,
    contacts: Vec<Contact<1>>,
}

/// The working set of one REV solve.
pub(crate) struct Assembly<'a> {
    radii: &'a [f64],
    law: ContactLaw,
    dt: f64,
    margin: f64,
    /// Cundall's α.
    pub damping: f64,
    pub cell: Cell<2>,
    pub positions: Vec<Vector<2>>,
    velocities: Vec<Vector<2>>,
    /// Rotations since the start of the increment.
    pub rotations: Vec<f64>,
    /// Rotations of the reference state.
    rotations0: Vec<f64>,
    spins: Vec<f64>,
    forces: Vec<Vector<2>>,
    torques: Vec<f64>,
    degree: Vec<u32>,
    pub links: Vec<Link>,
    reference: Reference,
    listed: Vec<Vector<2>>,
    listed_inverse: Tensor2<2>,
    /// Σ f_i l_j over contacts, f the force on j, l from i to j.
    virial: Tensor2<2>,
    pub list_builds: u32,
}

impl<'a> Assembly<'a> {
    /// The assembly at the given configuration, with `base` as the reference state. `None` when
    /// the cell is degenerate or too small for its grains.
    pub fn new(
        base: &'a Rev<2, 1>,
        cell: Cell<2>,
        positions: Vec<Vector<2>>,
        rotations: Vec<f64>,
    ) -> Option<Self> {
        let n = positions.len();
        let stiffness = base.law.largest_stiffness();
        let mut assembly = Self {
            radii: &base.grains.radii,
            law: base.law,
            dt: TIME_STEP / stiffness.sqrt(),
            margin: LIST_MARGIN * base.grains.mean_diameter(),
            damping: DAMPING,
            cell,
            positions,
            velocities: vec![[0.0; 2]; n],
            rotations,
            rotations0: vec![0.0; n],
            spins: vec![0.0; n],
            forces: vec![[0.0; 2]; n],
            torques: vec![0.0; n],
            degree: vec![0; n],
            links: Vec::new(),
            reference: Reference {
                cell: base.state.cell,
                positions: base.state.positions.clone(),
                contacts: base.state.contacts.clone(),
            },
            listed: Vec::new(),
            listed_inverse: [[0.0; 2]; 2],
            virial: [[0.0; 2]; 2],
            list_builds: 0,
        };
        assembly
            .build_list(Friction::ReturnMapping)
            .then_some(assembly)
    }

    pub fn time_step(&self) -> f64 {
        self.dt
    }

    pub fn law(&self) -> &ContactLaw {
        &self.law
    }

    /// Moves cell and grains by the small gradient `l` (F_k+1 = (1 + l) F_k), grains turning with
    /// the mean spin.
    pub fn carry_along(&mut self, l: &Tensor2<2>) {
        let spin = 0.5 * (l[1][0] - l[0][1]);
        for (x, theta) in self.positions.iter_mut().zip(&mut self.rotations) {
            let [a, b] = *x;
            x[0] = a + (l[0][0] * a + l[0][1] * b);
            x[1] = b + (l[1][0] * a + l[1][1] * b);
            *theta += spin;
        }
        let mut f = *l;
        f[0][0] += 1.0;
        f[1][1] += 1.0;
        self.cell = self.cell.deformed(&f);
        for link in &mut self.links {
            if link.shift != [0.0; 2] {
                link.image = self.cell.translation(&link.shift);
            }
        }
    }

    /// Contact forces at the current configuration.
    ///
    /// With α the rotation of the branch and θ that of the grains since the reference state,
    /// u_t = (R_i − δ/2)(α − θ_i) + (R_j − δ/2)(α − θ_j), counted by the share δ/(δ − δ_0) in a contact
    /// made since; the force on j is f_n n − f_t t, both grains get the moment (R − δ/2) f_t.
    pub fn compute_forces(&mut self, friction: Friction) {
        match friction {
            Friction::ReturnMapping => self.forces_of::<false>(),
            Friction::Path => {
                self.forces_of::<true>();
                self.rotations0.copy_from_slice(&self.rotations);
            }
        }
    }

    fn forces_of<const PATH: bool>(&mut self) {
        self.forces.fill([0.0; 2]);
        self.torques.fill(0.0);
        self.degree.fill(0);
        let mut virial = [[0.0; 2]; 2];
        let law = self.law;
        for link in &mut self.links {
            let (i, j) = (link.i as usize, link.j as usize);
            let branch = branch_of(link, &self.positions);
            let distance2 = branch[0] * branch[0] + branch[1] * branch[1];
            if distance2 >= link.reach * link.reach {
                link.overlap = 0.0;
                link.normal = 0.0;
                link.tangential = 0.0;
                if PATH {
                    // Nothing is remembered of an open contact; a new one starts without slip.
                    link.tangential0 = 0.0;
                    link.overlap0 = f64::NEG_INFINITY;
                    link.branch0 = branch;
                }
                continue;
            }
            let distance = distance2.sqrt();
            let inverse = 1.0 / distance;
            let n = [branch[0] * inverse, branch[1] * inverse];
            let overlap = link.reach - distance;
            let arm_i = self.radii[i] - 0.5 * overlap;
            let arm_j = self.radii[j] - 0.5 * overlap;
            let alpha = turn(&link.branch0, &branch);
            let slip = arm_i * (alpha - (self.rotations[i] - self.rotations0[i]))
                + arm_j * (alpha - (self.rotations[j] - self.rotations0[j]));
            let share = share_of(overlap, link.overlap0);
            let trial = link.tangential0 + law.tangential_stiffness * (share * slip);
            let (tangential, _) = law.return_to_bound(trial, overlap);
            let normal = law.normal_stiffness * overlap - law.cohesion;
            link.overlap = overlap;
            link.normal = normal;
            link.tangential = tangential;
            if PATH {
                link.tangential0 = tangential;
                link.overlap0 = overlap;
                link.branch0 = branch;
            }
            let f = [
                normal * n[0] + tangential * n[1],
                normal * n[1] - tangential * n[0],
            ];
            self.forces[i][0] -= f[0];
            self.forces[i][1] -= f[1];
            self.forces[j][0] += f[0];
            self.forces[j][1] += f[1];
            self.torques[i] += arm_i * tangential;
            self.torques[j] += arm_j * tangential;
            self.degree[i] += 1;
            self.degree[j] += 1;
            for a in 0..2 {
                for b in 0..2 {
                    virial[a][b] += f[a] * branch[b];
                }
            }
        }
        self.virial = virial;
    }

    /// σ = −(1/V) Σ f ⊗ l (Love–Weber), tension positive, not symmetrised.
    pub fn raw_stress(&self) -> Tensor2<2> {
        let scale = -1.0 / self.cell.volume();
        self.virial
            .map(|row| row.map(|component| scale * component))
    }

    /// The symmetrised stress.
    pub fn stress(&self) -> Tensor2<2> {
        symmetric(&self.raw_stress())
    }

    /// One cycle of damped motion under the forces last computed.
    pub fn integrate(&mut self) {
        let dt = self.dt;
        for i in 0..self.positions.len() {
            // A grain without force stands still: a free flight would only wear out the pair list.
            if self.degree[i] == 0 {
                self.velocities[i] = [0.0; 2];
                self.spins[i] = 0.0;
                continue;
            }
            for k in 0..2 {
                let v = &mut self.velocities[i][k];
                *v += dt * damped(self.forces[i][k], *v, self.damping);
                self.positions[i][k] += dt * *v;
            }
            let inertia = 0.5 * self.radii[i] * self.radii[i];
            let spin = &mut self.spins[i];
            *spin += dt * damped(self.torques[i], *spin, self.damping) / inertia;
            self.rotations[i] += dt * *spin;
        }
    }

    /// Largest unbalanced force or moment/radius of a grain over the mean contact force, for the
    /// forces last computed; 0 without contacts, infinite when a force is not finite.
    pub fn residual(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for link in self.links.iter().filter(|link| link.overlap > 0.0) {
            sum += (link.normal * link.normal + link.tangential * link.tangential).sqrt();
            count += 1;
        }
        if count == 0 {
            return 0.0;
        }
        let mean = sum / count as f64;
        let mut worst: f64 = 0.0;
        for i in 0..self.forces.len() {
            let [fx, fy] = self.forces[i];
            let force = (fx * fx + fy * fy).sqrt();
            // `max` would hide a NaN.
            let unbalanced = [force, self.torques[i].abs() / self.radii[i]];
            if unbalanced.iter().any(|value| !value.is_finite()) {
                return f64::INFINITY;
            }
            worst = worst.max(unbalanced[0]).max(unbalanced[1]);
        }
        if worst == 0.0 { 0.0 } else { worst / mean }
    }

    /// Takes the current configuration as the reference state of return mapping.
    pub fn rebase(&mut self) {
        self.reference.cell = self.cell;
        self.reference.positions.clone_from(&self.positions);
        self.reference.contacts = self.contacts();
        self.rotations0.copy_from_slice(&self.rotations);
        for link in &mut self.links {
            let branch = branch_of(link, &self.positions);
            link.branch0 = branch;
            link.overlap0 = link.reach - (branch[0] * branch[0] + branch[1] * branch[1]).sqrt();
            link.tangential0 = link.tangential;
        }
    }

    /// Builds the pair list anew when it is no longer certain to hold all contacts. `false` when
    /// the cell has become too small for its grains.
    pub fn refresh_list(&mut self, cycle: u32, friction: Friction) -> bool {
        if !cycle.is_multiple_of(LIST_CHECK) {
            return true;
        }
        // Displacement relative to the motion of the cell: x − H·H_listed⁻¹·x_listed.
        let carried = product(&self.cell.h, &self.listed_inverse);
        let mut largest2: f64 = 0.0;
        for (x, old) in self.positions.iter().zip(&self.listed) {
            let dx = x[0] - (carried[0][0] * old[0] + carried[0][1] * old[1]);
            let dy = x[1] - (carried[1][0] * old[0] + carried[1][1] * old[1]);
            largest2 = largest2.max(dx * dx + dy * dy);
        }
        let stretch = (0..4)
            .map(|k| (carried[k / 2][k % 2] - f64::from(u8::from(k / 2 == k % 2))).abs())
            .fold(0.0, f64::max);
        let longest = 2.0 * self.radii.iter().copied().fold(0.0, f64::max) + self.margin;
        // Two grains approach each other by at most twice the largest displacement; the rest of the
        // margin covers the motion until the next check.
        if 2.0 * largest2.sqrt() + 2.0 * stretch * longest < 0.7 * self.margin {
            return true;
        }
        self.build_list(friction)
    }

    fn build_list(&mut self, friction: Friction) -> bool {
        let (volume, inverse) = invert(&self.cell.h);
        let Some(inverse) = inverse else { return false };
        let cutoff = 2.0 * self.radii.iter().copied().fold(0.0, f64::max) + self.margin;
        let finite = self.positions.iter().flatten().all(|x| x.is_finite());
        if volume.is_nan() || volume <= 0.0 || !finite || self.cell.smallest_height() < 2.0 * cutoff
        {
            return false;
        }
        let old = std::mem::take(&mut self.links);
        self.links = pairs(
            &self.cell,
            &inverse,
            &self.positions,
            self.radii,
            self.margin,
        )
        .into_iter()
        .map(|pair| Link {
            i: pair.i,
            j: pair.j,
            shift: pair.shift,
            image: self.cell.translation(&pair.shift),
            reach: self.radii[pair.i as usize] + self.radii[pair.j as usize],
            branch0: [0.0; 2],
            overlap0: f64::NEG_INFINITY,
            tangential0: 0.0,
            normal: 0.0,
            tangential: 0.0,
            overlap: 0.0,
        })
        .collect();
        match friction {
            Friction::ReturnMapping => self.recall_reference(),
            Friction::Path => self.carry_history(&old),
        }
        self.listed.clone_from(&self.positions);
        self.listed_inverse = inverse;
        self.list_builds += 1;
        true
    }

    /// History of every listed pair from the reference state.
    fn recall_reference(&mut self) {
        let reference = &self.reference;
        let mut contacts = reference.contacts.iter().peekable();
        for link in &mut self.links {
            let image = reference.cell.translation(&link.shift);
            let (a, b) = (
                reference.positions[link.i as usize],
                reference.positions[link.j as usize],
            );
            link.branch0 = [b[0] - a[0] + image[0], b[1] - a[1] + image[1]];
            link.overlap0 = link.reach
                - (link.branch0[0] * link.branch0[0] + link.branch0[1] * link.branch0[1]).sqrt();
            while contacts
                .next_if(|c| (c.i, c.j) < (link.i, link.j))
                .is_some()
            {}
            if let Some(contact) = contacts.next_if(|c| (c.i, c.j) == (link.i, link.j)) {
                link.tangential0 = contact.tangential[0];
            }
        }
    }

    /// History of pairs that stay listed, from the old list.
    fn carry_history(&mut self, old: &[Link]) {
        let mut old = old.iter().peekable();
        for link in &mut self.links {
            while old.next_if(|o| (o.i, o.j) < (link.i, link.j)).is_some() {}
            if let Some(known) = old.next_if(|o| (o.i, o.j) == (link.i, link.j)) {
                link.branch0 = known.branch0;
                link.overlap0 = known.overlap0;
                link.tangential0 = known.tangential0;
                link.normal = known.normal;
                link.tangential = known.tangential;
                link.overlap = known.overlap;
            } else {
                link.branch0 = branch_of(link, &self.positions);
            }
        }
    }

    /// The closed contacts with the forces last computed.
    pub fn contacts(&self) -> Vec<Contact<1>> {
        let closed = self.links.iter().filter(|link| link.overlap > 0.0);
        closed
            .map(|link| Contact {
                i: link.i,
                j: link.j,
                tangential: [link.tangential],
            })
            .collect()
    }

    /// The state with the forces last computed, its cell reduced when it has become slender.
    pub fn state(&self) -> RevState<2, 1> {
        RevState {
            cell: self.cell.reduced(),
            positions: self.positions.clone(),
            contacts: self.contacts(),
        }
    }

    /// The geometry of a closed contact in the current configuration.
    pub fn geometry(&self, link: &Link) -> Geometry {
        let (i, j) = (link.i as usize, link.j as usize);
        let branch = branch_of(link, &self.positions);
        let distance = (branch[0] * branch[0] + branch[1] * branch[1]).sqrt();
        let overlap = link.reach - distance;
        let arms = [self.radii[i] - 0.5 * overlap, self.radii[j] - 0.5 * overlap];
        let alpha = turn(&link.branch0, &branch);
        let turns = [
            alpha - (self.rotations[i] - self.rotations0[i]),
            alpha - (self.rotations[j] - self.rotations0[j]),
        ];
        let slip = arms[0] * turns[0] + arms[1] * turns[1];
        let share = share_of(overlap, link.overlap0);
        let trial = link.tangential0 + self.law.tangential_stiffness * (share * slip);
        let made_since = link.overlap0 < 0.0;
        Geometry {
            branch,
            distance,
            n: [branch[0] / distance, branch[1] / distance],
            arms,
            turns,
            slip,
            share,
            share_rate: if made_since {
                -link.overlap0 / (overlap - link.overlap0).powi(2)
            } else {
                0.0
            },
            status: self.law.return_to_bound(trial, overlap).1,
        }
    }
}

/// F − α |F| sgn(v).
#[inline]
pub(crate) fn damped(force: f64, velocity: f64, damping: f64) -> f64 {
    if velocity == 0.0 {
        force
    } else {
        force - damping * force.abs() * velocity.signum()
    }
}

#[inline]
fn branch_of(link: &Link, positions: &[Vector<2>]) -> Vector<2> {
    let (a, b) = (&positions[link.i as usize], &positions[link.j as usize]);
    [b[0] - a[0] + link.image[0], b[1] - a[1] + link.image[1]]
}

/// The part of the relative displacement that happened while the contact was closed.
#[inline]
fn share_of(overlap: f64, overlap0: f64) -> f64 {
    if overlap0 >= 0.0 {
        1.0
    } else {
        overlap / (overlap - overlap0)
    }
}

/// The angle from `a` to `b`. The series is exact to the last bit where it is used: its first
/// neglected term is r⁹/9 < 2e-19 for r < 0.01.
#[inline]
fn turn(a: &Vector<2>, b: &Vector<2>) -> f64 {
    let cross = a[0] * b[1] - a[1] * b[0];
    let dot = a[0] * b[0] + a[1] * b[1];
    if cross.abs() < 0.01 * dot {
        let r = cross / dot;
        let r2 = r * r;
        r * (1.0 - r2 * (1.0 / 3.0 - r2 * (1.0 / 5.0 - r2 * (1.0 / 7.0))))
    } else {
        libm::atan2(cross, dot)
    }
}
