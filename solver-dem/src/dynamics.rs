//! Damped dynamics of the assembly: the one kernel behind both solvers.
//!
//! Only the equilibrium counts, so masses are free: m = max(z, 3)/4 and I = m R² for a grain with z
//! contacts. With k the largest contact stiffness, the rows of M⁻¹K then add up to at most 13.2 k whatever
//! the grain (Gershgorin: 3.3 z k/m), which allows Δt = 2/√(13.2 k) = 0.55/√k; 0.45 is used. While
//! a packing is compressed the masses are equal, as inertia takes part in what comes out.
//! Damping is local and proportional to the unbalanced force (Cundall 1971): F ← F − α |F| sgn(v),
//! so that it vanishes in equilibrium. Friction comes in two forms:
//!
//! - *return mapping*: tangential forces are a function of the current configuration and of one
//!   reference state, so the end state hardly depends on the way;
//! - *path*: the reference state moves along with every cycle, friction is integrated over time.

mod kernel;
mod link;
mod list;
mod quad;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod two_grains;

use crate::{
    Cell, Contact, ContactLaw, Rev, RevState,
    homogenise::symmetric,
    simd::Simd,
    tensor::{Tensor2, Vector},
};
pub(crate) use kernel::damped;
use kernel::{Block, Field, Forces, Inertia, LANES, Load, Motion, Pose, Velocity};
pub(crate) use link::{Geometry, Link};
use link::{History, length, share_of};

/// Δt √k with masses after the contacts.
const TIME_STEP: f64 = 0.45;
/// Contacts below which a grain gets no lighter, and contacts of a grain of mass 1.
const LEAST_CONTACTS: f64 = 3.0;
const UNIT_CONTACTS: f64 = 4.0;
/// Δt √k with all masses 1 and I = R²/2.
const EQUAL_MASS_TIME_STEP: f64 = 0.3;
/// Cundall's α in a load step.
const DAMPING: f64 = 0.7;
/// Margin of the pair list over the mean diameter in a load step.
const LIST_MARGIN: f64 = 0.03;
/// The same where grains move far.
const WIDE_LIST_MARGIN: f64 = 0.1;
/// Mean force of the contacts below which they carry nothing, over kn times the mean diameter: an overlap of 1e-9 of
/// a grain, a millionth of one at κ = 1000.
const FAINT: f64 = 1e-9;
/// Cycles between two looks at the residual.
pub(crate) const RESIDUAL_CHECK: u32 = 20;

/// What inertia the grains get.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Masses {
    /// After the number of contacts, for the longest time step.
    ByContacts,
    /// All 1, discs of equal mass.
    Equal,
}

/// How friction is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Friction {
    ReturnMapping,
    Path,
}

/// What a look at all pairs writes down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Record {
    Nothing,
    All,
}

/// The state from which return mapping counts displacements.
struct Reference {
    cell: Cell<2>,
    positions: Vec<Vector<2>>,
    contacts: Vec<Contact<1>>,
}

/// The working set of one REV solve.
pub(crate) struct Assembly<'a> {
    simd: Simd,
    radii: &'a [f64],
    law: ContactLaw,
    dt: f64,
    margin: f64,
    masses: Masses,
    /// Cundall's α.
    pub damping: f64,
    pub cell: Cell<2>,
    /// One more than there are grains: the last is nobody's, for lanes without a pair.
    poses: Vec<Pose>,
    velocities: Vec<Velocity>,
    /// Rotations of the reference state since the start of the increment.
    rotations0: Vec<f64>,
    inertia: Vec<Inertia>,
    loads: Vec<Load>,
    blocks: Vec<Block>,
    /// Of the pairs in `blocks`, as last recorded.
    forces: Vec<Forces>,
    /// Where in the blocks each pair lies, by grain numbers.
    slots: Vec<u32>,
    /// Whole cell vectors between the images of each pair, by grain numbers.
    shifts: Vec<Vector<2>>,
    reference: Reference,
    listed: Vec<Vector<2>>,
    listed_inverse: Tensor2<2>,
    /// Σ f_i l_j over contacts, f the force on j, l from i to j.
    virial: Tensor2<2>,
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
        let radii = &base.grains.radii;
        let mut poses: Vec<Pose> = positions
            .iter()
            .zip(&rotations)
            .zip(radii)
            .map(|((x, theta), radius)| [x[0], x[1], *theta, radius * theta])
            .collect();
        poses.push([0.0; 4]);
        let dt = TIME_STEP / base.law.largest_stiffness().sqrt();
        let mut assembly = Self {
            simd: Simd::of_this_processor(),
            radii,
            law: base.law,
            dt,
            margin: LIST_MARGIN * base.grains.mean_diameter(),
            masses: Masses::ByContacts,
            damping: DAMPING,
            cell,
            poses,
            velocities: vec![[0.0; 4]; n],
            rotations0: vec![0.0; n],
            inertia: vec![[0.0; 4]; n],
            loads: vec![[0.0; 4]; n + 1],
            blocks: Vec::new(),
            forces: Vec::new(),
            slots: Vec::new(),
            shifts: Vec::new(),
            reference: Reference {
                cell: base.state.cell,
                positions: base.state.positions.clone(),
                contacts: base.state.contacts.clone(),
            },
            listed: Vec::new(),
            listed_inverse: [[0.0; 2]; 2],
            virial: [[0.0; 2]; 2],
        };
        assembly
            .build_list(Friction::ReturnMapping)
            .then_some(assembly)
    }

    /// For large rearrangements: equal masses, other damping, and a list that lasts longer.
    pub fn make_brisk(&mut self, damping: f64) {
        self.masses = Masses::Equal;
        self.dt *= EQUAL_MASS_TIME_STEP / TIME_STEP;
        self.damping = damping;
        self.margin *= WIDE_LIST_MARGIN / LIST_MARGIN;
    }

    /// Gives the grains their inertia, after the contacts last recorded.
    pub fn set_masses(&mut self) {
        let mut contacts = vec![0.0; self.len()];
        for link in self.closed() {
            contacts[link.i as usize] += 1.0;
            contacts[link.j as usize] += 1.0;
        }
        for ((inertia, contacts), radius) in self.inertia.iter_mut().zip(&contacts).zip(self.radii)
        {
            let (mass, moment) = match self.masses {
                Masses::ByContacts => {
                    let mass = f64::max(*contacts, LEAST_CONTACTS) / UNIT_CONTACTS;
                    (mass, mass * radius * radius)
                }
                Masses::Equal => (1.0, 0.5 * radius * radius),
            };
            *inertia = [self.dt / mass, self.dt / mass, self.dt / moment, *radius];
        }
    }

    pub fn time_step(&self) -> f64 {
        self.dt
    }

    pub fn law(&self) -> &ContactLaw {
        &self.law
    }

    /// f_c/a: the stress that cohesion stands for, 0 without.
    pub fn bond_stress(&self) -> f64 {
        let diameters: f64 = self.radii.iter().map(|radius| 2.0 * radius).sum();
        self.law.cohesion * self.radii.len() as f64 / diameters
    }

    pub fn len(&self) -> usize {
        self.velocities.len()
    }

    pub fn positions(&self) -> Vec<Vector<2>> {
        let grains = &self.poses[..self.len()];
        grains.iter().map(|pose| [pose[0], pose[1]]).collect()
    }

    /// Rotations since the start of the increment.
    pub fn rotations(&self) -> Vec<f64> {
        let turned = self.rotations0.iter().zip(&self.poses);
        turned.map(|(theta0, pose)| theta0 + pose[2]).collect()
    }

    /// The block and the lane of pair k by grain numbers.
    fn place(&self, k: usize) -> (usize, usize) {
        let slot = self.slots[k] as usize;
        (slot / LANES, slot % LANES)
    }

    fn link(&self, k: usize) -> Link {
        let (b, l) = self.place(k);
        let (block, forces) = (&self.blocks[b], &self.forces[b]);
        Link {
            i: block.i[l],
            j: block.j[l],
            image: [block.image[0][l], block.image[1][l]],
            history: block.history(l),
            normal: forces.normal[l],
            tangential: forces.tangential[l],
            overlap: forces.overlap[l],
        }
    }

    /// The listed pairs, by grain numbers.
    fn links(&self) -> impl Iterator<Item = Link> {
        (0..self.slots.len()).map(|k| self.link(k))
    }

    /// How many pairs are listed.
    pub fn listed_pairs(&self) -> usize {
        self.slots.len()
    }

    /// The pairs in contact, by grain numbers, with the forces last recorded.
    pub fn closed(&self) -> impl Iterator<Item = Link> {
        self.links().filter(Link::is_closed)
    }

    /// Moves cell and grains by the small gradient `l` (F_k+1 = (1 + l) F_k), grains turning with
    /// the mean spin.
    pub fn carry_along(&mut self, l: &Tensor2<2>) {
        let spin = 0.5 * (l[1][0] - l[0][1]);
        let n = self.len();
        for (k, pose) in self.poses[..n].iter_mut().enumerate() {
            let [a, b, ..] = *pose;
            pose[0] = a + (l[0][0] * a + l[0][1] * b);
            pose[1] = b + (l[1][0] * a + l[1][1] * b);
            pose[2] += spin;
            pose[3] = self.radii[k] * pose[2];
        }
        let mut f = *l;
        f[0][0] += 1.0;
        f[1][1] += 1.0;
        self.cell = self.cell.deformed(&f);
        for k in 0..self.shifts.len() {
            if self.shifts[k] != [0.0; 2] {
                let image = self.cell.translation(&self.shifts[k]);
                let (b, l) = self.place(k);
                self.blocks[b].image[0][l] = image[0];
                self.blocks[b].image[1][l] = image[1];
            }
        }
    }

    /// Contact forces at the current configuration; with `Record::All` every pair's force and the stress are
    /// known afterwards, else only what moves the grains.
    pub fn compute_forces(&mut self, friction: Friction, record: Record) {
        let field = Field {
            blocks: &mut self.blocks,
            forces: &mut self.forces,
            poses: &self.poses,
            law: &self.law,
            loads: &mut self.loads,
        };
        let forces = match (friction, record) {
            (Friction::ReturnMapping, Record::Nothing) => kernel::forces::<false, false>,
            (Friction::ReturnMapping, Record::All) => kernel::forces::<false, true>,
            (Friction::Path, Record::Nothing) => kernel::forces::<true, false>,
            (Friction::Path, Record::All) => kernel::forces::<true, true>,
        };
        self.virial = forces(self.simd, field);
        if friction == Friction::Path {
            self.forget_turns();
        }
    }

    /// Counts rotations from here.
    fn forget_turns(&mut self) {
        for (theta0, pose) in self.rotations0.iter_mut().zip(&mut self.poses) {
            *theta0 += pose[2];
            pose[2] = 0.0;
            pose[3] = 0.0;
        }
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
        let n = self.len();
        let motion = Motion {
            poses: &mut self.poses[..n],
            velocities: &mut self.velocities,
            loads: &self.loads,
            inertia: &self.inertia,
            dt: self.dt,
            damping: self.damping,
        };
        kernel::integrate(self.simd, motion);
    }

    /// Largest unbalanced force or moment/radius of a grain over the mean contact force, for the
    /// forces last computed; 0 without contacts, infinite when a force is not finite. Bonded grains that nothing
    /// presses together have no force but their bond's to be measured by, so no mean counts less than f_c.
    pub fn residual(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for link in self.closed() {
            sum += (link.normal * link.normal + link.tangential * link.tangential).sqrt();
            count += 1;
        }
        if count == 0 {
            return 0.0;
        }
        let mean = (sum / count as f64).max(self.law.cohesion);
        let mut worst: f64 = 0.0;
        for (load, radius) in self.loads.iter().zip(self.radii) {
            let force = (load[0] * load[0] + load[1] * load[1]).sqrt();
            // `max` would hide a NaN.
            let moment = kernel::moment(load, *radius);
            let unbalanced = [force, moment.abs() / radius];
            if unbalanced.iter().any(|value| !value.is_finite()) {
                return f64::INFINITY;
            }
            worst = worst.max(unbalanced[0]).max(unbalanced[1]);
        }
        if worst == 0.0 { 0.0 } else { worst / mean }
    }

    /// Whether the contacts carry nothing any more: their mean force is below [`FAINT`] kn times the mean diameter.
    /// What is left of an assembly that has given way under a fixed cell are overlaps that die out down to rounding, and
    /// no force among them is a scale of equilibrium. Never so with cohesion, whose bonds keep their force.
    pub fn gave_way(&self) -> bool {
        let (mut sum, mut count) = (0.0, 0usize);
        for link in self.closed() {
            sum += link.normal.abs();
            count += 1;
        }
        let diameters: f64 = self.radii.iter().map(|radius| 2.0 * radius).sum();
        let scale = self.law.normal_stiffness * diameters / self.radii.len() as f64;
        self.law.cohesion == 0.0 && sum < FAINT * scale * count as f64
    }

    /// Takes the current configuration as the reference state of return mapping.
    pub fn rebase(&mut self) {
        self.reference.cell = self.cell;
        self.reference.positions = self.positions();
        self.reference.contacts = self.contacts();
        self.forget_turns();
        for k in 0..self.slots.len() {
            let link = self.link(k);
            let branch = self.branch(&link);
            let overlap = self.reach(&link) - length(&branch);
            let (b, l) = self.place(k);
            self.blocks[b].remember(l, &History::at(&branch, overlap, link.tangential));
        }
    }

    fn branch(&self, link: &Link) -> Vector<2> {
        let (a, b) = (self.poses[link.i as usize], self.poses[link.j as usize]);
        [b[0] - a[0] + link.image[0], b[1] - a[1] + link.image[1]]
    }

    /// R_i + R_j.
    fn reach(&self, link: &Link) -> f64 {
        self.radii[link.i as usize] + self.radii[link.j as usize]
    }

    /// The closed contacts with the forces last computed.
    pub fn contacts(&self) -> Vec<Contact<1>> {
        self.closed()
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
            positions: self.positions(),
            contacts: self.contacts(),
        }
    }

    /// The geometry of a closed contact in the current configuration.
    #[inline]
    pub fn geometry(&self, link: &Link) -> Geometry {
        let (i, j) = (link.i as usize, link.j as usize);
        let branch = self.branch(link);
        let distance = length(&branch);
        let overlap = self.reach(link) - distance;
        let arms = [self.radii[i] - 0.5 * overlap, self.radii[j] - 0.5 * overlap];
        let n = [branch[0] / distance, branch[1] / distance];
        let [a, b] = link.history.normal0;
        let alpha = kernel::alpha_of(a * n[1] - b * n[0], a * n[0] + b * n[1]);
        let turns = [alpha - self.poses[i][2], alpha - self.poses[j][2]];
        let slip = arms[0] * turns[0] + arms[1] * turns[1];
        let share = share_of(overlap, link.history.overlap0);
        let trial = link.history.tangential0 + self.law.tangential_stiffness * (share * slip);
        let made_since = link.history.overlap0 < 0.0;
        Geometry {
            branch,
            distance,
            n,
            arms,
            turns,
            slip,
            share,
            share_rate: if made_since {
                let closed_since = overlap - link.history.overlap0;
                -link.history.overlap0 / (closed_since * closed_since)
            } else {
                0.0
            },
            status: self.law.return_to_bound(trial, overlap).1,
        }
    }
}
