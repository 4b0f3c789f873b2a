//! What a Gauss point asks of its REV.

use crate::{
    Rev, RevState,
    contact::Status,
    dynamics::{Assembly, Friction, Record},
    homogenise::asymmetry,
    network::{self, Linearisation, Network},
    onward::Onward,
    relax::{CellMotion, Limits, Outcome, Relaxed, relax},
    response::{EquilibriumError, Method, Report, Response, Start},
    settings::{LossOfConfinement, Settings, Tangents, Unsettled},
    tensor::{Tensor2, apply, identity, invert, product, rotation, rotation_angle},
};

/// Largest departure from the affine motion that return mapping is trusted with, over the mean diameter.
const STRAY: f64 = 0.25;

/// Brings `base`, deformed by `gradient` (F, dx_{n+1} = F dx_n), to equilibrium.
///
/// Return mapping first, from `start` or from the affine motion (or on from `start`, see [`crate::Trust`]); when that does not settle, the
/// path solver along a ramp from the base. A pure function: same arguments, same bits.
///
/// Where [`Settings::loss_of_confinement`] allows it, a REV pulled apart until no grain touches another is an answer:
/// its stress and its tangents are zero, and [`Report::contacts`] tells the void from a solid. Only the path
/// solver may find it.
///
/// F = R·U is split first: the grains see U alone, and what they answer is turned by R. So a rotation of any angle
/// changes nothing, on either solver.
///
/// # Errors
/// [`EquilibriumError`] when F is no motion, the cell gets too small, all contacts are lost, or nothing settles.
pub fn respond(
    base: &Rev<2, 1>,
    start: Option<Start<'_>>,
    gradient: &Tensor2<2>,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    check(base, gradient)?;
    if let Some(onward) = start.and_then(|start| Onward::from(base, start, gradient)) {
        return onward.respond(gradient, settings);
    }
    let angle = rotation_angle(gradient);
    let back = rotation(-angle);
    let stretch = if angle == 0.0 {
        *gradient
    } else {
        product(&back, gradient)
    };
    let asked = Asked {
        from: identity(),
        to: stretch,
        stress: [[None; 2]; 2],
    };
    let mut response = map_or_follow(base, start, &stretch, &asked, settings)?;
    if angle != 0.0 {
        response.turn(angle);
        response.gradient = *gradient;
    }
    Ok(response)
}

/// What is asked of the cell: F goes from `from`, which belongs to the base, to `to`, except in the
/// components that are free to follow a stress.
pub(crate) struct Asked {
    pub from: Tensor2<2>,
    pub to: Tensor2<2>,
    pub stress: [[Option<f64>; 2]; 2],
}

/// Return mapping at the end of the increment, `step` being F from the base; where that does not settle or
/// cannot be trusted, the path solver.
pub(crate) fn map_or_follow(
    base: &Rev<2, 1>,
    start: Option<Start<'_>>,
    step: &Tensor2<2>,
    asked: &Asked,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    let cell = base.state.cell.deformed(step);
    let (positions, rotations) = configuration(base, start, step, &cell);
    let mut cycles = 0;
    if let Some(mut assembly) = Assembly::new(base, cell, positions, rotations) {
        let mut motion = CellMotion::new(asked.to, asked.to, asked.stress, 0, STRESS_DRIVEN_RATE);
        let limits = Limits {
            friction: Friction::ReturnMapping,
            cap: settings.return_mapping_cap,
            rebase_after: settings.rebase_after,
        };
        let relaxed = relax(&mut assembly, &mut motion, &limits, settings);
        if relaxed.outcome == Outcome::Equilibrium && !strayed(base, &assembly) {
            let method = if relaxed.rebased {
                Method::Rebased
            } else {
                Method::ReturnMapping
            };
            return answer(base, &assembly, motion.gradient, &relaxed, method, settings);
        }
        cycles = relaxed.cycles;
    }
    follow_path(base, asked, settings, cycles)
}

/// Whether the grains have gone where a return mapping has no say: all contacts lost, or a grain further
/// from its affine motion than [`STRAY`]. A sudden large increment may throw grains apart or through
/// each other, and what results can be in perfect equilibrium: whether it is the answer, the slow path tells.
fn strayed(base: &Rev<2, 1>, assembly: &Assembly<'_>) -> bool {
    if !base.state.contacts.is_empty() && assembly.closed().next().is_none() {
        return true;
    }
    let Some(back) = base.state.cell.inverse() else {
        return true;
    };
    let carried = product(&assembly.cell.h, &back);
    let limit = STRAY * base.grains.mean_diameter();
    let positions = assembly.positions();
    positions.iter().zip(&base.state.positions).any(|(x, old)| {
        let affine = apply(&carried, old);
        let (dx, dy) = (x[0] - affine[0], x[1] - affine[1]);
        let astray2 = dx * dx + dy * dy;
        astray2.is_nan() || astray2 > limit * limit
    })
}

/// How much slower the ramp of each attempt of the path solver is. What happens to a floppy
/// network depends on the way: where one way ends in a slow creep, another often settles.
const RAMPS: [u32; 3] = [1, 2, 10];

/// Largest strain per cycle of a component that follows its stress.
const STRESS_DRIVEN_RATE: f64 = 1e-4;

/// The path solver: a slow ramp of F, then relaxation; slower ramps where that does not settle.
pub(crate) fn follow_path(
    base: &Rev<2, 1>,
    asked: &Asked,
    settings: &Settings,
    cycles_before: u32,
) -> Result<Response, EquilibriumError> {
    let mut strain: f64 = 0.0;
    for k in 0..2 {
        for l in 0..2 {
            strain = strain.max((asked.to[k][l] - asked.from[k][l]).abs());
        }
    }
    let limits = Limits {
        friction: Friction::Path,
        cap: settings.path_cap,
        rebase_after: u32::MAX,
    };
    let mut cycles = cycles_before;
    let mut last = None;
    for slower in RAMPS {
        let (cell, positions) = (base.state.cell, base.state.positions.clone());
        let unturned = vec![0.0; positions.len()];
        let mut assembly = Assembly::new(base, cell, positions, unturned)
            .ok_or_else(|| too_small(base, &cell, cycles))?;
        let ramp = ramp_cycles(strain, slower, settings);
        let mut motion =
            CellMotion::new(asked.from, asked.to, asked.stress, ramp, STRESS_DRIVEN_RATE);
        let mut relaxed = relax(&mut assembly, &mut motion, &limits, settings);
        cycles = cycles.saturating_add(relaxed.cycles);
        relaxed.cycles = cycles;
        let lasting = assembly.closed().next().is_some() && relaxed.residual.is_finite();
        if relaxed.outcome == Outcome::Exhausted
            && settings.unsettled == Unsettled::Answer
            && lasting
        {
            let method = Method::Unsettled;
            return answer(base, &assembly, motion.gradient, &relaxed, method, settings);
        }
        let end = finish(base, &assembly, &motion, &relaxed, Method::Path, settings);
        if relaxed.outcome != Outcome::Exhausted {
            return end;
        }
        last = Some(end);
    }
    last.expect("there is at least one ramp")
}

/// Cycles of a ramp over `strain`. A ramp longer than the cap would never end; such increments are cut by
/// the caller. The cap also stands in for a rate that is no number.
fn ramp_cycles(strain: f64, slower: u32, settings: &Settings) -> u32 {
    let longest = settings.path_cap.max(settings.ramp_min_cycles).max(1);
    let cycles = (strain / settings.ramp_rate).ceil() * f64::from(slower);
    let shortest = settings
        .ramp_min_cycles
        .saturating_mul(slower)
        .clamp(1, longest);
    if cycles < f64::from(longest) {
        (cycles as u32).max(shortest)
    } else {
        longest
    }
}

/// The answer, or why there is none.
pub(crate) fn finish(
    base: &Rev<2, 1>,
    assembly: &Assembly<'_>,
    motion: &CellMotion,
    relaxed: &Relaxed,
    method: Method,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    match relaxed.outcome {
        Outcome::Equilibrium => answer(base, assembly, motion.gradient, relaxed, method, settings),
        Outcome::GaveWay => void(base, assembly, motion.gradient, relaxed, method, settings),
        Outcome::CellTooSmall => Err(too_small(base, &assembly.cell, relaxed.cycles)),
        // A stress that no strain can carry pulls the grains apart.
        Outcome::Exhausted
            if assembly.closed().next().is_none()
                && settings.loss_of_confinement == LossOfConfinement::Fail =>
        {
            Err(unconfined(base, assembly, relaxed.cycles))
        }
        Outcome::Exhausted => Err(EquilibriumError::NotReached {
            cycles: relaxed.cycles,
            residual: relaxed.residual,
            tolerance: settings.tolerance,
            drift: relaxed.drift,
            stress_error: relaxed.stress_error,
        }),
    }
}

pub(crate) fn too_small(base: &Rev<2, 1>, cell: &crate::Cell<2>, cycles: u32) -> EquilibriumError {
    let cutoff = 2.0 * base.grains.largest_radius() + 0.1 * base.grains.mean_diameter();
    EquilibriumError::CellTooSmall {
        height: cell.smallest_height(),
        needed: 2.0 * cutoff,
        cycles,
    }
}

fn unconfined(base: &Rev<2, 1>, assembly: &Assembly<'_>, cycles: u32) -> EquilibriumError {
    EquilibriumError::ConfinementLost {
        volume_change: assembly.cell.volume() / base.state.cell.volume(),
        contacts: base.state.contacts.len(),
        cycles,
    }
}

/// Refuses what no relaxation could mend.
pub(crate) fn check(base: &Rev<2, 1>, gradient: &Tensor2<2>) -> Result<(), EquilibriumError> {
    let (determinant, inverse) = invert(gradient);
    let motion = determinant > 0.0 && determinant.is_finite() && inverse.is_some();
    if !motion || !gradient.iter().flatten().all(|x| x.is_finite()) {
        return Err(EquilibriumError::NotAMotion {
            gradient: *gradient,
            determinant,
        });
    }
    match flaw(base) {
        Some(flaw) => Err(EquilibriumError::InvalidState(flaw)),
        None => Ok(()),
    }
}

/// What is wrong with a REV, if anything is.
fn flaw(base: &Rev<2, 1>) -> Option<String> {
    let state = &base.state;
    let n = state.positions.len();
    if n == 0 || base.grains.radii.len() != n {
        return Some(format!(
            "{n} positions for {} radii",
            base.grains.radii.len()
        ));
    }
    let at_least = |x: f64, bound: f64| x >= bound && x.is_finite();
    let law = &base.law;
    let problems = [
        (
            base.grains.radii.iter().all(|r| *r > 0.0 && r.is_finite()),
            "a radius is not positive",
        ),
        (
            state.positions.iter().flatten().all(|x| x.is_finite()),
            "a position is not finite",
        ),
        (
            at_least(state.cell.volume(), f64::MIN_POSITIVE),
            "the cell has no volume or is inside out",
        ),
        (
            at_least(law.normal_stiffness, f64::MIN_POSITIVE),
            "the normal stiffness is not positive",
        ),
        (
            at_least(law.tangential_stiffness, 0.0),
            "the tangential stiffness is negative or not finite",
        ),
        (
            at_least(law.friction, 0.0),
            "the friction coefficient is negative or not finite",
        ),
        (
            at_least(law.cohesion, 0.0),
            "the cohesion is negative or not finite",
        ),
        (
            state
                .contacts
                .iter()
                .all(|c| c.i < c.j && (c.j as usize) < n),
            "a contact names a grain that is not there",
        ),
        (
            state.contacts.iter().all(|c| c.tangential[0].is_finite()),
            "a tangential force is not finite",
        ),
        (
            state
                .contacts
                .windows(2)
                .all(|c| (c[0].i, c[0].j) < (c[1].i, c[1].j)),
            "contacts are not sorted by grain numbers or one is named twice",
        ),
    ];
    let first = problems.iter().find(|(fine, _)| !fine);
    first.map(|(_, problem)| (*problem).into())
}

/// Positions and rotations to start from. From an earlier end state (cell H_s, positions x_s):
/// x = F H_0 H_s⁻¹ x_s, so that the fluctuations are carried over; grains turn by the change of the
/// macroscopic rotation. The cell vectors of both must describe the same lattice, which a
/// reduction may have changed: then the affine motion serves.
fn configuration(
    base: &Rev<2, 1>,
    start: Option<Start<'_>>,
    gradient: &Tensor2<2>,
    cell: &crate::Cell<2>,
) -> (Vec<[f64; 2]>, Vec<f64>) {
    let n = base.state.positions.len();
    let angle = rotation_angle(gradient);
    if let Some(start) = start
        && start.state.positions.len() == n
        && start.rotations.len() == n
        && let Some(back) = start.state.cell.inverse()
        && let Some(base_back) = base.state.cell.inverse()
    {
        let from_start = product(&cell.h, &back);
        let earlier = rotation_angle(&product(&start.state.cell.h, &base_back));
        if stretched_by(&from_start) < 0.2 {
            let positions = start
                .state
                .positions
                .iter()
                .map(|x| apply(&from_start, x))
                .collect();
            let rotations = start
                .rotations
                .iter()
                .map(|theta| theta + (angle - earlier))
                .collect();
            return (positions, rotations);
        }
    }
    let positions = base
        .state
        .positions
        .iter()
        .map(|x| apply(gradient, x))
        .collect();
    (positions, vec![angle; n])
}

/// The largest component of FᵀF − 1, which no rotation changes.
pub(crate) fn stretched_by(f: &Tensor2<2>) -> f64 {
    let transposed = [[f[0][0], f[1][0]], [f[0][1], f[1][1]]];
    let c = product(&transposed, f);
    let components = [c[0][0] - 1.0, c[0][1], c[1][1] - 1.0];
    components.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// The answer of grains that carry nothing: no stress, no stiffness. They stay where they are, ready to be pressed
/// together again.
fn void(
    base: &Rev<2, 1>,
    assembly: &Assembly<'_>,
    gradient: Tensor2<2>,
    relaxed: &Relaxed,
    method: Method,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    if settings.loss_of_confinement == LossOfConfinement::Fail {
        return Err(unconfined(base, assembly, relaxed.cycles));
    }
    Ok(Response {
        state: RevState {
            contacts: Vec::new(),
            ..assembly.state()
        },
        rotations: assembly.rotations(),
        gradient,
        stress: [[0.0; 2]; 2],
        tangent: [[[[0.0; 2]; 2]; 2]; 2],
        elastic_tangent: [[[[0.0; 2]; 2]; 2]; 2],
        report: Report {
            method,
            cycles: relaxed.cycles,
            residual: 0.0,
            drift: 0.0,
            stress_error: relaxed.stress_error,
            asymmetry: 0.0,
            contacts: 0,
            sliding: 0,
            affine_tangent: false,
        },
    })
}

/// Stress, tangents and end state of an assembly in equilibrium.
fn answer(
    base: &Rev<2, 1>,
    assembly: &Assembly<'_>,
    gradient: Tensor2<2>,
    relaxed: &Relaxed,
    method: Method,
    settings: &Settings,
) -> Result<Response, EquilibriumError> {
    // A reference state that has moved no longer tells what the whole increment did to a contact.
    let whole;
    let over_increment = if method == Method::ReturnMapping {
        assembly
    } else {
        let mut again = Assembly::new(
            base,
            assembly.cell,
            assembly.positions(),
            assembly.rotations(),
        )
        .ok_or_else(|| too_small(base, &assembly.cell, relaxed.cycles))?;
        again.compute_forces(Friction::ReturnMapping, Record::All);
        whole = again;
        &whole
    };
    let closed = assembly.closed().count();
    if closed == 0 {
        return void(base, assembly, gradient, relaxed, method, settings);
    }
    let sliding = over_increment
        .closed()
        .filter(|link| over_increment.geometry(link).status == Status::Sliding)
        .count();
    let soft = settings.network_regularisation;
    let pattern = network::pattern_of(assembly);
    let mut room = Network::new(&pattern);
    let mut tangent = |of, kind| network::tangent(of, &mut room, kind, soft);
    let algorithmic = tangent(over_increment, Linearisation::Algorithmic);
    let elastic = match settings.tangents {
        Tangents::Both => tangent(assembly, Linearisation::Elastic),
        Tangents::Algorithmic => Some(network::affine(assembly)),
    };
    let affine_tangent = algorithmic.is_none() || elastic.is_none();
    let affine = || network::affine(assembly);
    Ok(Response {
        state: assembly.state(),
        rotations: assembly.rotations(),
        gradient,
        stress: assembly.stress(),
        tangent: algorithmic.unwrap_or_else(affine),
        elastic_tangent: elastic.unwrap_or_else(affine),
        report: Report {
            method,
            cycles: relaxed.cycles,
            residual: relaxed.residual,
            drift: relaxed.drift,
            stress_error: relaxed.stress_error,
            asymmetry: asymmetry(&assembly.raw_stress()),
            contacts: closed as u32,
            sliding: sliding as u32,
            affine_tangent,
        },
    })
}
