//! From a configuration to equilibrium.

use crate::{
    dynamics::{Assembly, Friction, RESIDUAL_CHECK, Record, damped},
    settings::Settings,
    tensor::{Tensor2, identity, invert, mean, product},
};

/// How the cell moves while the grains relax: each component of F either follows a straight line
/// to its target during the ramp, or is a degree of freedom driven by its stress.
pub(crate) struct CellMotion {
    /// F now, from the state at the start.
    pub gradient: Tensor2<2>,
    from: Tensor2<2>,
    to: Tensor2<2>,
    /// Stress asked for, on the components that are free to follow it.
    stress: [[Option<f64>; 2]; 2],
    rate: Tensor2<2>,
    ramp: u32,
    /// The largest strain per cycle of a stress-driven component.
    rate_limit: f64,
}

impl CellMotion {
    /// A cell at rest under stress alone on the given components.
    pub fn stress_driven(stress: [[Option<f64>; 2]; 2], rate_limit: f64) -> Self {
        Self::new(identity(), identity(), stress, 0, rate_limit)
    }

    pub fn new(
        from: Tensor2<2>,
        to: Tensor2<2>,
        stress: [[Option<f64>; 2]; 2],
        ramp: u32,
        rate_limit: f64,
    ) -> Self {
        Self {
            gradient: from,
            from,
            to,
            stress,
            rate: [[0.0; 2]; 2],
            ramp,
            rate_limit,
        }
    }

    fn is_driven(&self) -> bool {
        self.stress.iter().flatten().any(Option::is_some)
    }

    /// The largest stress error over the scale of the stresses, 0 without stress control.
    fn stress_error(&self, stress: &Tensor2<2>, bond: f64) -> f64 {
        let scale = self.scale(stress, bond);
        let mut worst: f64 = 0.0;
        for (row, target) in stress.iter().zip(&self.stress) {
            for (now, target) in row.iter().zip(target) {
                if let Some(target) = target {
                    worst = worst.max((now - target).abs() / scale);
                }
            }
        }
        worst
    }

    /// The largest stress asked for; where only zero is asked for, the present mean stress or what the bonds
    /// carry, whichever is larger.
    fn scale(&self, stress: &Tensor2<2>, bond: f64) -> f64 {
        let asked = self
            .stress
            .iter()
            .flatten()
            .flatten()
            .fold(0.0, |a: f64, s| a.max(s.abs()));
        if asked > 0.0 {
            asked
        } else {
            mean(stress).abs().max(bond)
        }
    }

    /// Moves the cell by one cycle. A driven component obeys M F̈ = V (σ_target − σ), damped like
    /// the grains; M = N V/12 is the inertia of the grains' own affine motion.
    fn advance(&mut self, assembly: &mut Assembly<'_>, cycle: u32) {
        if cycle > self.ramp && !self.is_driven() {
            return;
        }
        let mut next = self.gradient;
        if cycle <= self.ramp {
            let part = f64::from(cycle) / f64::from(self.ramp);
            for k in 0..2 {
                for l in 0..2 {
                    next[k][l] = self.from[k][l] + part * (self.to[k][l] - self.from[k][l]);
                }
            }
        }
        let dt = assembly.time_step();
        let stress = assembly.stress();
        let inertia = assembly.len() as f64 / 12.0;
        let limit = self.rate_limit / dt;
        for k in 0..2 {
            for l in 0..2 {
                let Some(target) = self.stress[k][l] else {
                    continue;
                };
                let rate = &mut self.rate[k][l];
                let pull = damped(target - stress[k][l], *rate, assembly.damping);
                *rate = (*rate + dt * pull / inertia).clamp(-limit, limit);
                next[k][l] = self.gradient[k][l] + dt * *rate;
            }
        }
        let Some(back) = invert(&self.gradient).1 else {
            return;
        };
        let mut l = product(&next, &back);
        for k in 0..2 {
            l[k][k] -= 1.0;
        }
        assembly.carry_along(&l);
        self.gradient = next;
    }
}

/// When to stop, and what to do on the way.
pub(crate) struct Limits {
    pub friction: Friction,
    pub cap: u32,
    /// Return mapping: re-base the reference state at every check from this cycle on.
    pub rebase_after: u32,
}

/// What a relaxation reached.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaxed {
    pub cycles: u32,
    pub residual: f64,
    pub drift: f64,
    pub stress_error: f64,
    pub rebased: bool,
    pub outcome: Outcome,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Equilibrium,
    /// No contact carries anything any more: the grains are at rest apart from one another, or just touching.
    GaveWay,
    /// The cap was reached first.
    Exhausted,
    /// The cell became too small for its grains or degenerate.
    CellTooSmall,
}

/// Cycles until equilibrium or the cap. Forces are those of the final configuration.
pub(crate) fn relax(
    assembly: &mut Assembly<'_>,
    motion: &mut CellMotion,
    limits: &Limits,
    settings: &Settings,
) -> Relaxed {
    let mut result = Relaxed {
        cycles: 0,
        residual: f64::INFINITY,
        drift: f64::INFINITY,
        stress_error: f64::INFINITY,
        rebased: false,
        outcome: Outcome::Exhausted,
    };
    let bond = assembly.bond_stress();
    let mut last_stress: Option<Tensor2<2>> = None;
    assembly.compute_forces(limits.friction, Record::All);
    loop {
        let cycle = result.cycles;
        let checked = cycle.is_multiple_of(RESIDUAL_CHECK);
        if checked {
            assembly.set_masses();
        }
        if checked && cycle >= motion.ramp {
            let stress = assembly.stress();
            result.residual = assembly.residual();
            result.stress_error = motion.stress_error(&stress, bond);
            result.drift = last_stress.map_or(f64::INFINITY, |last| change(&last, &stress, bond));
            last_stress = Some(stress);
            if result.residual <= settings.tolerance
                && result.drift <= settings.drift_tolerance
                && result.stress_error <= settings.stress_tolerance
            {
                result.outcome = Outcome::Equilibrium;
                return result;
            }
            // While return mapping swings, forces may vanish for a moment: whether they stay away, the path tells.
            if limits.friction == Friction::Path && !motion.is_driven() && assembly.gave_way() {
                result.outcome = Outcome::GaveWay;
                return result;
            }
            if cycle >= limits.cap.saturating_add(motion.ramp) || result.residual == f64::INFINITY {
                return result;
            }
            if cycle >= limits.rebase_after && limits.friction == Friction::ReturnMapping {
                assembly.rebase();
                result.rebased = true;
            }
        }
        result.cycles += 1;
        assembly.integrate();
        motion.advance(assembly, result.cycles);
        if !assembly.refresh_list(result.cycles, limits.friction) {
            result.outcome = Outcome::CellTooSmall;
            return result;
        }
        let looked_at = motion.is_driven() || result.cycles.is_multiple_of(RESIDUAL_CHECK);
        let record = if looked_at {
            Record::All
        } else {
            Record::Nothing
        };
        assembly.compute_forces(limits.friction, record);
    }
}

/// The largest change of a component over the mean stress, or over what the bonds carry if that is more: the stress of
/// cohesive grains pulled apart is zero to rounding, and no scale of itself.
fn change(a: &Tensor2<2>, b: &Tensor2<2>, bond: f64) -> f64 {
    let scale = mean(b).abs().max(bond);
    let largest = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
    if largest == 0.0 { 0.0 } else { largest / scale }
}
