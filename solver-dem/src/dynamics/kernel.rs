//! The inner loop: contact forces of all listed pairs, four at a time.
//!
//! Pairs lie in blocks of [`LANES`], every quantity as one short array, so that the compiler turns the
//! arithmetic into vector instructions. Only what differs from pair to pair is streamed; what belongs to
//! grains is gathered from their [`Pose`]s. Lanes are summed in the order of the pairs, and no
//! instruction set contracts or reorders anything: every processor gives the same bits.

use crate::{ContactLaw, tensor::Tensor2};

/// Pairs in a block.
pub(super) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// x, y, rotation since the reference state, radius.
pub(super) type Pose = [f64; 4];

/// Velocity x, y, spin; the last component stays zero.
pub(super) type Velocity = [f64; 4];

/// Force x, y, moment, number of closed contacts.
pub(super) type Load = [f64; 4];

/// The series of the contact rotation serves below this sine; see [`alpha_of`].
const SMALL_SINE: f64 = 0.01;

/// Four pairs of near grains, their history and their present forces.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Block {
    pub i: [u32; LANES],
    pub j: [u32; LANES],
    /// H·shift.
    pub image: [Lanes; 2],
    /// Branch vector in the reference state and one over its length.
    pub branch0: [Lanes; 2],
    pub inverse0: Lanes,
    /// Overlap in the reference state; < 0 for a gap, −∞ when nothing is remembered.
    pub overlap0: Lanes,
    /// Tangential force in the reference state.
    pub tangential0: Lanes,
    /// kn δ − f_c now; 0 when open.
    pub normal: Lanes,
    /// Tangential force now, of j on i along (−n_y, n_x).
    pub tangential: Lanes,
    /// δ now; 0 when open.
    pub overlap: Lanes,
}

impl Block {
    /// Lanes that hold no pair: a grain without radius and its own image a unit away.
    pub fn empty(nobody: u32) -> Self {
        Self {
            i: [nobody; LANES],
            j: [nobody; LANES],
            image: [[1.0; LANES], [0.0; LANES]],
            branch0: [[1.0; LANES], [0.0; LANES]],
            inverse0: [1.0; LANES],
            overlap0: [f64::NEG_INFINITY; LANES],
            tangential0: [0.0; LANES],
            normal: [0.0; LANES],
            tangential: [0.0; LANES],
            overlap: [0.0; LANES],
        }
    }
}

/// Forces of all blocks at the given poses, added up in `loads`, which is cleared first. Returns the
/// virial Σ f_i l_j, f the force on j, l from i to j.
///
/// With α the rotation of the branch and θ that of the grains since the reference state,
/// u_t = (R_i − δ/2)(α − θ_i) + (R_j − δ/2)(α − θ_j), counted by the share δ/(δ − δ_0) in a contact
/// made since; the force on j is f_n n − f_t t, both grains get the moment (R − δ/2) f_t.
///
/// With `PATH` the reference state of every pair becomes the present one.
pub(super) fn forces<const PATH: bool>(
    blocks: &mut [Block],
    poses: &[Pose],
    law: &ContactLaw,
    loads: &mut [Load],
) -> Tensor2<2> {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2, which is all that the function asks for. With wider vectors a
        // cycle of 400 grains takes 0.78 of the time (benches/solve.rs); every bit stays as it is.
        return unsafe { forces_avx2::<PATH>(blocks, poses, law, loads) };
    }
    forces_body::<PATH>(blocks, poses, law, loads)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn forces_avx2<const PATH: bool>(
    blocks: &mut [Block],
    poses: &[Pose],
    law: &ContactLaw,
    loads: &mut [Load],
) -> Tensor2<2> {
    forces_body::<PATH>(blocks, poses, law, loads)
}

#[inline(always)]
fn forces_body<const PATH: bool>(
    blocks: &mut [Block],
    poses: &[Pose],
    law: &ContactLaw,
    loads: &mut [Load],
) -> Tensor2<2> {
    loads.fill([0.0; 4]);
    let mut virial = [[0.0; LANES]; 4];
    for block in blocks {
        let [xi, yi, ti, ri] = gathered(poses, &block.i);
        let [xj, yj, tj, rj] = gathered(poses, &block.j);
        let (mut bx, mut by) = ([0.0; LANES], [0.0; LANES]);
        let (mut inverse, mut overlap) = ([0.0; LANES], [0.0; LANES]);
        let (mut sine, mut cosine) = ([0.0; LANES], [0.0; LANES]);
        let mut turned = false;
        for l in 0..LANES {
            bx[l] = xj[l] - xi[l] + block.image[0][l];
            by[l] = yj[l] - yi[l] + block.image[1][l];
            let distance = (bx[l] * bx[l] + by[l] * by[l]).sqrt();
            inverse[l] = 1.0 / distance;
            overlap[l] = ri[l] + rj[l] - distance;
            let scale = inverse[l] * block.inverse0[l];
            sine[l] = (block.branch0[0][l] * by[l] - block.branch0[1][l] * bx[l]) * scale;
            cosine[l] = (block.branch0[0][l] * bx[l] + block.branch0[1][l] * by[l]) * scale;
        }
        let mut alpha = [0.0; LANES];
        for l in 0..LANES {
            alpha[l] = series(sine[l]);
            turned |= (sine[l].abs() >= SMALL_SINE) | (cosine[l] <= 0.0);
        }
        if turned {
            for l in 0..LANES {
                alpha[l] = alpha_of(sine[l], cosine[l]);
            }
        }
        let (mut fx, mut fy) = ([0.0; LANES], [0.0; LANES]);
        let (mut mi, mut mj) = ([0.0; LANES], [0.0; LANES]);
        let mut closed = [0.0; LANES];
        for l in 0..LANES {
            let delta = overlap[l];
            let touching = delta > 0.0;
            let (nx, ny) = (bx[l] * inverse[l], by[l] * inverse[l]);
            let (arm_i, arm_j) = (ri[l] - 0.5 * delta, rj[l] - 0.5 * delta);
            let slip = arm_i * (alpha[l] - ti[l]) + arm_j * (alpha[l] - tj[l]);
            let delta0 = block.overlap0[l];
            let part = delta / (delta - delta0);
            let share = if delta0 >= 0.0 { 1.0 } else { part };
            let trial = block.tangential0[l] + law.tangential_stiffness * (share * slip);
            let bounded = law.return_to_bound(trial, delta).0;
            let tangential = if touching { bounded } else { 0.0 };
            let pushed = law.normal_stiffness * delta - law.cohesion;
            let normal = if touching { pushed } else { 0.0 };
            block.overlap[l] = if touching { delta } else { 0.0 };
            block.normal[l] = normal;
            block.tangential[l] = tangential;
            fx[l] = normal * nx + tangential * ny;
            fy[l] = normal * ny - tangential * nx;
            mi[l] = arm_i * tangential;
            mj[l] = arm_j * tangential;
            closed[l] = if touching { 1.0 } else { 0.0 };
            virial[0][l] += fx[l] * bx[l];
            virial[1][l] += fx[l] * by[l];
            virial[2][l] += fy[l] * bx[l];
            virial[3][l] += fy[l] * by[l];
            if PATH {
                // Nothing is remembered of an open contact; a new one starts without slip.
                block.tangential0[l] = tangential;
                block.overlap0[l] = if touching { delta } else { f64::NEG_INFINITY };
                block.branch0[0][l] = bx[l];
                block.branch0[1][l] = by[l];
                block.inverse0[l] = inverse[l];
            }
        }
        for l in 0..LANES {
            add(
                &mut loads[block.i[l] as usize],
                [-fx[l], -fy[l], mi[l], closed[l]],
            );
            add(
                &mut loads[block.j[l] as usize],
                [fx[l], fy[l], mj[l], closed[l]],
            );
        }
    }
    let sums = virial.map(|lanes| lanes.iter().sum());
    [[sums[0], sums[1]], [sums[2], sums[3]]]
}

/// One cycle of damped motion: v ← v + s (F − α |F| sgn v), x ← x + Δt v with s = Δt/m by component. A grain
/// without contact stands still: a free flight would only wear out the pair list.
pub(super) fn integrate(
    poses: &mut [Pose],
    velocities: &mut [Velocity],
    loads: &[Load],
    steps: &[Velocity],
    dt: f64,
    damping: f64,
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: as in `forces`.
        return unsafe { integrate_avx2(poses, velocities, loads, steps, dt, damping) };
    }
    integrate_body(poses, velocities, loads, steps, dt, damping);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn integrate_avx2(
    poses: &mut [Pose],
    velocities: &mut [Velocity],
    loads: &[Load],
    steps: &[Velocity],
    dt: f64,
    damping: f64,
) {
    integrate_body(poses, velocities, loads, steps, dt, damping);
}

#[inline(always)]
fn integrate_body(
    poses: &mut [Pose],
    velocities: &mut [Velocity],
    loads: &[Load],
    steps: &[Velocity],
    dt: f64,
    damping: f64,
) {
    let grains = poses.iter_mut().zip(velocities).zip(loads).zip(steps);
    for (((pose, velocity), load), step) in grains {
        let mut next = [0.0; 4];
        for k in 0..4 {
            let faster = velocity[k] + step[k] * damped(load[k], velocity[k], damping);
            next[k] = if load[3] == 0.0 { 0.0 } else { faster };
        }
        *velocity = next;
        for k in 0..4 {
            pose[k] += dt * next[k];
        }
    }
}

/// F − α |F| sgn(v), as a factor on F.
#[inline(always)]
pub(crate) fn damped(force: f64, velocity: f64, damping: f64) -> f64 {
    let power = force * velocity;
    let driving = if power > 0.0 { damping } else { 0.0 };
    let braking = if power < 0.0 { damping } else { 0.0 };
    force * (1.0 - driving + braking)
}

/// The poses of four grains, by component.
#[inline(always)]
fn gathered(poses: &[Pose], grains: &[u32; LANES]) -> [Lanes; 4] {
    let rows = grains.map(|grain| poses[grain as usize]);
    let mut columns = [[0.0; LANES]; 4];
    for c in 0..4 {
        for l in 0..LANES {
            columns[c][l] = rows[l][c];
        }
    }
    columns
}

#[inline(always)]
fn add(sum: &mut Load, term: Load) {
    for c in 0..4 {
        sum[c] += term[c];
    }
}

/// asin s for |s| < 0.01: the first neglected term, 105/3456 s⁹, is 3e-20.
#[inline(always)]
fn series(s: f64) -> f64 {
    let s2 = s * s;
    s * (1.0 + s2 * (1.0 / 6.0 + s2 * (3.0 / 40.0 + s2 * (15.0 / 336.0))))
}

/// The angle with the given sine and cosine.
#[inline]
pub(super) fn alpha_of(sine: f64, cosine: f64) -> f64 {
    if sine.abs() < SMALL_SINE && cosine > 0.0 {
        series(sine)
    } else {
        libm::atan2(sine, cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> f64 {
        (k as f64 * 12.9898).sin() * 43_758.547 % 1.0
    }

    /// A run must go on with the same bits on another machine.
    #[test]
    fn wide_vectors_give_the_same_bits_as_narrow_ones() {
        let grains = 40;
        let poses: Vec<Pose> = (0..grains)
            .map(|k| {
                let x = [noise(4 * k), noise(4 * k + 1), 0.02 * noise(4 * k + 2)];
                [x[0], x[1], x[2], 0.4 + 0.2 * noise(4 * k + 3)]
            })
            .collect();
        let mut blocks = vec![Block::empty(0); 60];
        for (b, block) in blocks.iter_mut().enumerate() {
            for l in 0..LANES {
                let k = 1000 + 10 * (LANES * b + l);
                block.i[l] = (k * 7 % grains) as u32;
                block.j[l] = (k * 13 % grains) as u32;
                block.image = [[0.3; LANES], [noise(k); LANES]];
                block.branch0[0][l] = noise(k + 1);
                block.branch0[1][l] = noise(k + 2);
                block.inverse0[l] = 1.0 / noise(k + 1).hypot(noise(k + 2));
                block.overlap0[l] = noise(k + 3);
                block.tangential0[l] = noise(k + 4);
            }
        }
        let law = ContactLaw {
            normal_stiffness: 3.0,
            tangential_stiffness: 2.0,
            friction: 0.4,
            cohesion: 0.1,
        };
        let mut narrow = blocks.clone();
        let mut loads = vec![[0.0; 4]; grains];
        let mut narrow_loads = loads.clone();
        let virial = forces::<true>(&mut blocks, &poses, &law, &mut loads);
        let narrow_virial = forces_body::<true>(&mut narrow, &poses, &law, &mut narrow_loads);
        let bits =
            |loads: &[Load]| -> Vec<u64> { loads.iter().flatten().map(|x| x.to_bits()).collect() };
        assert!(loads.iter().any(|load| load[3] > 0.0));
        assert!(loads.iter().flatten().all(|x| x.is_finite()));
        assert_eq!(bits(&loads), bits(&narrow_loads));
        assert_eq!(virial, narrow_virial);
    }
}
