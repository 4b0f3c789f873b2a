//! The inner loop: contact forces of all listed pairs, four at a time.
//!
//! Pairs lie in blocks of [`LANES`], every quantity as one short array, so that the compiler turns the
//! arithmetic into vector instructions. Only what differs from pair to pair is streamed; what belongs to
//! grains is gathered from their [`Pose`]s, already combined so that one transposition of four rows yields
//! all that the four pairs need, and one brings their loads back. Sums run in the order of the pairs, and no
//! instruction set contracts or reorders anything: every processor gives the same bits.

use pulp::NullaryFnOnce;

use super::{
    link::History,
    quad::{Plain, Quad},
};
use crate::{ContactLaw, simd::Simd, tensor::Tensor2};

/// Pairs in a block.
pub(super) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// x, y, rotation θ since the reference state, R θ.
pub(super) type Pose = [f64; 4];

/// Velocity x, y, spin; the last component stays zero.
pub(super) type Velocity = [f64; 4];

/// Force x, y, Σ f_t and Σ δ f_t/2 over the contacts of a grain; its moment is R Σ f_t − Σ δ f_t/2.
pub(super) type Load = [f64; 4];

/// Δt/m, Δt/m, Δt/I, R.
pub(super) type Inertia = [f64; 4];

/// Above this cosine the contact has turned by less than 0.01 and [`series`] serves.
const SMALL_TURN_COSINE: f64 = 0.99995;

/// Four pairs of near grains and their history.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Block {
    pub i: [u32; LANES],
    pub j: [u32; LANES],
    /// H·shift.
    pub image: [Lanes; 2],
    /// Direction from i to j in the reference state.
    pub normal0: [Lanes; 2],
    /// R_i + R_j.
    pub reach: Lanes,
    /// Tangential force in the reference state.
    pub tangential0: Lanes,
    /// Overlap in the reference state; < 0 for a gap, −∞ when nothing is remembered.
    pub overlap0: Lanes,
}

/// The forces of four pairs, for whoever looks at them between cycles.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Forces {
    /// kn δ − f_c; 0 when open.
    pub normal: Lanes,
    /// Tangential force of j on i along (−n_y, n_x).
    pub tangential: Lanes,
    /// δ; 0 when open.
    pub overlap: Lanes,
}

impl Block {
    /// Lanes that hold no pair: a grain without radius and its own image a unit away.
    pub fn empty(nobody: u32) -> Self {
        Self {
            i: [nobody; LANES],
            j: [nobody; LANES],
            image: [[1.0; LANES], [0.0; LANES]],
            normal0: [[1.0; LANES], [0.0; LANES]],
            reach: [0.0; LANES],
            tangential0: [0.0; LANES],
            overlap0: [f64::NEG_INFINITY; LANES],
        }
    }

    /// Sets the reference state of the pair in lane `l`.
    pub fn remember(&mut self, l: usize, history: &History) {
        self.normal0[0][l] = history.normal0[0];
        self.normal0[1][l] = history.normal0[1];
        self.overlap0[l] = history.overlap0;
        self.tangential0[l] = history.tangential0;
    }

    /// The reference state of the pair in lane `l`.
    pub fn history(&self, l: usize) -> History {
        History {
            normal0: [self.normal0[0][l], self.normal0[1][l]],
            overlap0: self.overlap0[l],
            tangential0: self.tangential0[l],
        }
    }
}

/// Everything the inner loop works on.
pub(super) struct Field<'a> {
    pub blocks: &'a mut [Block],
    pub forces: &'a mut [Forces],
    pub poses: &'a [Pose],
    pub law: &'a ContactLaw,
    pub loads: &'a mut [Load],
}

/// Sums of the contact forces at the given poses: see [`ForcesOf`].
pub(super) fn forces<const FOLLOWS: bool, const RECORDS: bool>(
    simd: Simd,
    field: Field<'_>,
) -> Tensor2<2> {
    match simd {
        #[cfg(target_arch = "x86_64")]
        Simd::Wide(simd) => simd.vectorize(ForcesOf::<_, FOLLOWS, RECORDS> { simd, field }),
        #[cfg(target_arch = "x86_64")]
        Simd::Narrow(simd) => simd.vectorize(ForcesOf::<_, FOLLOWS, RECORDS> { simd, field }),
        Simd::Plain => ForcesOf::<_, FOLLOWS, RECORDS> { simd: Plain, field }.call(),
    }
}

/// Forces of all blocks at the given poses, added up in the loads, which are cleared first. Returns the virial
/// Σ f_i l_j, f the force on j, l from i to j.
///
/// With α the rotation of the branch l and θ those of the grains since the reference state, and R_i + R_j − δ = |l|,
/// u_t = (R_i − δ/2)(α − θ_i) + (R_j − δ/2)(α − θ_j) = |l| α − (R_i θ_i + R_j θ_j) + δ/2 (θ_i + θ_j),
/// counted by the share δ/(δ − δ_0) in a contact made since. The force on j is f_n n − f_t t; both grains get the
/// moment (R − δ/2) f_t.
///
/// With `FOLLOWS` the reference state of every pair becomes the present one. Without `RECORDS` neither the forces
/// of the pairs are written down nor the virial added up.
struct ForcesOf<'a, S, const FOLLOWS: bool, const RECORDS: bool> {
    simd: S,
    field: Field<'a>,
}

impl<S: Quad, const FOLLOWS: bool, const RECORDS: bool> NullaryFnOnce
    for ForcesOf<'_, S, FOLLOWS, RECORDS>
{
    type Output = Tensor2<2>;

    #[inline(always)]
    fn call(self) -> Tensor2<2> {
        let Self { simd: s, field } = self;
        let Field {
            blocks,
            forces,
            poses,
            law,
            loads,
        } = field;
        loads.fill([0.0; 4]);
        let (zero, one, half) = (s.splat(0.0), s.splat(1.0), s.splat(0.5));
        let (kn, kt) = (
            s.splat(law.normal_stiffness),
            s.splat(law.tangential_stiffness),
        );
        let slope = s.splat(law.friction * law.normal_stiffness);
        let cohesion = s.splat(law.cohesion);
        let (forgotten, turn) = (s.splat(f64::NEG_INFINITY), s.splat(SMALL_TURN_COSINE));
        let mut virial = [zero; 4];
        for (block, record) in blocks.iter_mut().zip(forces) {
            let (i, j) = (block.i, block.j);
            let row = |l: usize| {
                let (a, b) = (s.load(&poses[i[l] as usize]), s.load(&poses[j[l] as usize]));
                s.add(b, s.negate_first_two(a))
            };
            // x_j − x_i, θ_i + θ_j, R_i θ_i + R_j θ_j.
            let [bx, by, turns, rolled] = s.transpose([row(0), row(1), row(2), row(3)]);
            let bx = s.add(bx, s.load(&block.image[0]));
            let by = s.add(by, s.load(&block.image[1]));
            let square = s.add(s.mul(bx, bx), s.mul(by, by));
            let reach = s.load(&block.reach);
            // What is no number is not apart, and gets noticed.
            if s.all(s.above(square, s.mul(reach, reach))) {
                if FOLLOWS {
                    s.store(&mut block.overlap0, forgotten);
                    s.store(&mut block.tangential0, zero);
                }
                if RECORDS {
                    *record = Forces::default();
                }
                continue;
            }
            let distance = s.sqrt(square);
            let inverse = s.mul(distance, s.div(one, square));
            // 0 for an open pair, and with it every force below.
            let delta = s.larger(zero, s.sub(reach, distance));
            let (nx, ny) = (s.mul(bx, inverse), s.mul(by, inverse));
            let (ax, ay) = (s.load(&block.normal0[0]), s.load(&block.normal0[1]));
            let sine = s.sub(s.mul(ax, ny), s.mul(ay, nx));
            let cosine = s.add(s.mul(ax, nx), s.mul(ay, ny));
            let mut alpha = series(s, sine);
            if !s.all(s.above(cosine, turn)) {
                alpha = angles(s, sine, cosine);
            }
            let middle = s.mul(half, delta);
            let rolling = s.sub(s.mul(distance, alpha), rolled);
            let mut slip = s.add(rolling, s.mul(middle, turns));
            let overlap0 = s.load(&block.overlap0);
            let made_since = s.above(zero, overlap0);
            if s.any(made_since) {
                let share = s.div(delta, s.sub(delta, overlap0));
                slip = s.mul(s.choose(made_since, share, one), slip);
            }
            let trial = s.add(s.load(&block.tangential0), s.mul(kt, slip));
            let bound = s.mul(slope, delta);
            // The order of the operands lets pass what is no number.
            let tangential = s.smaller(bound, s.larger(s.sub(zero, bound), trial));
            let closed = s.above(delta, zero);
            let normal = s.sub(s.mul(kn, delta), s.choose(closed, cohesion, zero));
            let fx = s.add(s.mul(normal, nx), s.mul(tangential, ny));
            let fy = s.sub(s.mul(normal, ny), s.mul(tangential, nx));
            if RECORDS {
                s.store(&mut record.normal, normal);
                s.store(&mut record.tangential, tangential);
                s.store(&mut record.overlap, delta);
                let products = [s.mul(fx, bx), s.mul(fx, by), s.mul(fy, bx), s.mul(fy, by)];
                for k in 0..4 {
                    virial[k] = s.add(virial[k], products[k]);
                }
            }
            if FOLLOWS {
                // Nothing is remembered of an open contact; a new one starts without slip.
                s.store(&mut block.tangential0, tangential);
                s.store(&mut block.overlap0, s.choose(closed, delta, forgotten));
                s.store(&mut block.normal0[0], nx);
                s.store(&mut block.normal0[1], ny);
            }
            let rows = s.transpose([fx, fy, tangential, s.mul(middle, tangential)]);
            for l in 0..LANES {
                add(s, &mut loads[i[l] as usize], s.negate_first_two(rows[l]));
                add(s, &mut loads[j[l] as usize], rows[l]);
            }
        }
        let sums = virial.map(|lanes| {
            let mut sum = [0.0; LANES];
            s.store(&mut sum, lanes);
            sum.iter().sum()
        });
        [[sums[0], sums[1]], [sums[2], sums[3]]]
    }
}

#[inline(always)]
fn add<S: Quad>(s: S, sum: &mut Load, term: S::Reg) {
    let sum_now = s.load(sum);
    s.store(sum, s.add(sum_now, term));
}

/// asin x for |x| < 0.01: the first neglected term, 105/3456 x⁹, is 3e-20.
#[inline(always)]
fn series<S: Quad>(s: S, x: S::Reg) -> S::Reg {
    let square = s.mul(x, x);
    let mut sum = s.splat(15.0 / 336.0);
    for coefficient in [3.0 / 40.0, 1.0 / 6.0, 1.0] {
        sum = s.add(s.mul(square, sum), s.splat(coefficient));
    }
    s.mul(x, sum)
}

/// The angles with the given sines and cosines, some of them large.
#[cold]
#[inline(never)]
fn large_angles(sine: &[f64; 4], cosine: &[f64; 4]) -> [f64; 4] {
    let mut angles = [0.0; 4];
    for l in 0..LANES {
        angles[l] = alpha_of(sine[l], cosine[l]);
    }
    angles
}

#[inline(always)]
fn angles<S: Quad>(s: S, sine: S::Reg, cosine: S::Reg) -> S::Reg {
    let (mut sines, mut cosines) = ([0.0; 4], [0.0; 4]);
    s.store(&mut sines, sine);
    s.store(&mut cosines, cosine);
    s.load(&large_angles(&sines, &cosines))
}

/// The angle with the given sine and cosine.
pub(super) fn alpha_of(sine: f64, cosine: f64) -> f64 {
    if cosine > SMALL_TURN_COSINE {
        series(Plain, [sine; 4])[0]
    } else {
        libm::atan2(sine, cosine)
    }
}

/// What moves, and by what.
pub(super) struct Motion<'a> {
    pub poses: &'a mut [Pose],
    pub velocities: &'a mut [Velocity],
    pub loads: &'a [Load],
    pub inertia: &'a [Inertia],
    pub dt: f64,
    pub damping: f64,
}

/// One cycle of damped motion: v ← v + s (F − α |F| sgn v), x ← x + Δt v with s = Δt/m by component. A grain
/// without contact stands still: a free flight would only wear out the pair list.
struct MotionOf<'a, S> {
    simd: S,
    motion: Motion<'a>,
}

impl<S: Quad> NullaryFnOnce for MotionOf<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd: s, motion } = self;
        let Motion {
            poses,
            velocities,
            loads,
            inertia,
            dt,
            damping,
        } = motion;
        let zero = s.splat(0.0);
        let dt = s.load(&[dt, dt, dt, 0.0]);
        let (driven, braked) = (s.splat(1.0 - damping), s.splat(1.0 + damping));
        let grains = poses.iter_mut().zip(velocities);
        for (((pose, velocity), load), inertia) in grains.zip(loads).zip(inertia) {
            if load[0] == 0.0 && load[1] == 0.0 {
                *velocity = [0.0; 4];
                continue;
            }
            let radius = inertia[3];
            let force = s.load(&[load[0], load[1], moment(load, radius), 0.0]);
            let v = s.load(velocity);
            let factor = s.choose(s.above(s.mul(force, v), zero), driven, braked);
            let gain = s.mul(s.load(inertia), s.mul(force, factor));
            let v = s.add(v, gain);
            s.store(velocity, v);
            let x = s.add(s.load(pose), s.mul(dt, v));
            s.store(pose, x);
            pose[3] = radius * pose[2];
        }
    }
}

/// One cycle of damped motion: see [`MotionOf`].
pub(super) fn integrate(simd: Simd, motion: Motion<'_>) {
    match simd {
        #[cfg(target_arch = "x86_64")]
        Simd::Wide(simd) => simd.vectorize(MotionOf { simd, motion }),
        #[cfg(target_arch = "x86_64")]
        Simd::Narrow(simd) => simd.vectorize(MotionOf { simd, motion }),
        Simd::Plain => MotionOf {
            simd: Plain,
            motion,
        }
        .call(),
    }
}

/// Σ (R − δ/2) f_t.
#[inline(always)]
pub(super) fn moment(load: &Load, radius: f64) -> f64 {
    radius * load[2] - load[3]
}

/// F − α |F| sgn(v), as a factor on F.
pub(crate) fn damped(force: f64, velocity: f64, damping: f64) -> f64 {
    let driven = force * velocity > 0.0;
    force * if driven { 1.0 - damping } else { 1.0 + damping }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> f64 {
        (k as f64 * 12.9898).sin() * 43_758.547 % 1.0
    }

    /// What all paths make of the same grains: loads, records, histories and virials as bits.
    fn bits<const FOLLOWS: bool, const RECORDS: bool>(simd: Simd) -> Vec<u64> {
        let grains = 40;
        let mut poses: Vec<Pose> = (0..grains)
            .map(|k| {
                let [x, y, turn] = [noise(4 * k), noise(4 * k + 1), 0.02 * noise(4 * k + 2)];
                [x, y, turn, (0.4 + 0.2 * noise(4 * k + 3)) * turn]
            })
            .collect();
        let mut blocks = vec![Block::empty(0); 60];
        for (b, block) in blocks.iter_mut().enumerate() {
            for l in 0..LANES {
                let k = 1000 + 10 * (LANES * b + l);
                block.i[l] = (k / 10 * 7 % grains) as u32;
                block.j[l] = (k / 10 * 13 % grains) as u32;
                block.image = [[0.3; LANES], [noise(k); LANES]];
                block.reach[l] = 0.8 + 0.2 * noise(k);
                // Some turned a little, some a lot.
                let angle = if b % 2 == 0 { 1e-3 } else { 1.0 } * noise(k + 1);
                let history = History::at(&[angle.cos(), angle.sin()], noise(k + 3), noise(k + 4));
                block.remember(l, &history);
            }
        }
        let law = ContactLaw {
            normal_stiffness: 3.0,
            tangential_stiffness: 2.0,
            friction: 0.4,
            cohesion: 0.1,
        };
        let mut loads = vec![[0.0; 4]; grains];
        let mut records = vec![Forces::default(); blocks.len()];
        let mut velocities = vec![[0.01, -0.02, 0.03, 0.0]; grains];
        let inertia = vec![[0.3, 0.3, 0.4, 0.5]; grains];
        let mut bits = Vec::new();
        let mut loaded = 0;
        for _ in 0..3 {
            let field = Field {
                blocks: &mut blocks,
                forces: &mut records,
                poses: &poses,
                law: &law,
                loads: &mut loads,
            };
            let virial = forces::<FOLLOWS, RECORDS>(simd, field);
            loaded += loads.iter().filter(|load| load[2] != 0.0).count();
            let motion = Motion {
                poses: &mut poses,
                velocities: &mut velocities,
                loads: &loads,
                inertia: &inertia,
                dt: 0.01,
                damping: 0.7,
            };
            integrate(simd, motion);
            let histories = blocks.iter().flat_map(|block| {
                [
                    block.overlap0,
                    block.tangential0,
                    block.normal0[0],
                    block.normal0[1],
                ]
            });
            let recorded = records
                .iter()
                .flat_map(|r| [r.normal, r.tangential, r.overlap]);
            let rows = loads.iter().chain(&poses).chain(&velocities).copied();
            let rows = rows.chain(histories).chain(recorded);
            bits.extend(
                rows.flatten()
                    .chain(virial.into_iter().flatten())
                    .map(f64::to_bits),
            );
        }
        assert!(
            loaded > grains,
            "only {loaded} grains carry load in three cycles"
        );
        assert!(loads.iter().flatten().all(|x| x.is_finite()));
        bits
    }

    /// A run must go on with the same bits on another machine.
    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        #[cfg(target_arch = "x86_64")]
        let narrow = Simd::Narrow(pulp::x86::V1::try_new().expect("every x86-64 has SSE2"));
        #[cfg(not(target_arch = "x86_64"))]
        let narrow = Simd::Plain;
        for simd in [Simd::of_this_processor(), narrow] {
            assert_eq!(
                bits::<false, false>(simd),
                bits::<false, false>(Simd::Plain)
            );
            assert_eq!(bits::<false, true>(simd), bits::<false, true>(Simd::Plain));
            assert_eq!(bits::<true, false>(simd), bits::<true, false>(Simd::Plain));
            assert_eq!(bits::<true, true>(simd), bits::<true, true>(Simd::Plain));
        }
    }
}
