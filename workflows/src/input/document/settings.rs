//! Solver and output settings: written and resolved in the same form, as every key has a default.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the equations are solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverSettings {
    /// Largest unbalanced force at free nodes over the reactions (or external forces) at which a step is accepted.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub force_tolerance: f64,
    /// Largest correction of the displacement over its increment at which a step is accepted.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub displacement_tolerance: f64,
    /// Unbalanced force up to which a step that gets no further is accepted, visibly reported.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub loosest_force_tolerance: f64,
    /// Newton iterations before the body is let move, overdamped, towards the next equilibrium.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations: u32,
    /// Iterations of that motion before the step is cut; 0: none. It is what leads through a peak or a collapse, where no
    /// equilibrium is near; at its end nothing viscous is left.
    #[serde(alias = "elastic_iterations")]
    #[schemars(range(min = 0, max = 10_000))]
    pub relaxation_iterations: u32,
    /// Smallest part of an increment of the programme that is tried before the run gives up.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub smallest_step: f64,
    /// Growth of the step after an easy one, up to the whole increment.
    #[schemars(range(min = 1.0, max = 2.0))]
    pub step_growth: f64,
    /// What solves the linear equations of an iteration. A run's forces are the same over both but for rounding; the other
    /// one is there to check the first.
    pub linear_solver: LinearSolver,
    /// Largest unbalanced force in a REV over its mean contact force. Inside a REV, equilibrium is always required.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e-2))]
    pub rev_tolerance: f64,
    /// What becomes of a REV whose grains have all come apart.
    pub loss_of_confinement: LossOfConfinement,
    /// Longest time one REV task may take, in seconds.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub task_time_limit: f64,
    /// How often a task that crashed or ran past its time limit is tried again. After that the step is cut, as it is at
    /// once where a REV finds no equilibrium; but the time limit stops the run, as no result may depend on the clock.
    #[schemars(range(max = 100))]
    pub task_retries: u32,
    /// Share of the work put into the body that the overdamped motion may take out of it. Where a step comes near it, the
    /// next ones are halved or quartered, until little is taken. 1: steps do not follow it.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub damped_work: f64,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            force_tolerance: 1e-3,
            displacement_tolerance: 1e-2,
            loosest_force_tolerance: 1e-2,
            iterations: 12,
            relaxation_iterations: 300,
            smallest_step: 1.0 / 64.0,
            step_growth: 1.25,
            linear_solver: LinearSolver::Multifrontal,
            rev_tolerance: 1e-4,
            loss_of_confinement: LossOfConfinement::Isolated,
            task_time_limit: 600.0,
            task_retries: 1,
            damped_work: 0.01,
        }
    }
}

/// What solves the linear equations of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinearSolver {
    /// LU along a dissection of the mesh: the faster one, and the same bits on every processor.
    Multifrontal,
    /// The sparse LU of faer, a general library: for a check.
    Faer,
}

/// What becomes of a REV whose grains have all come apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LossOfConfinement {
    /// The step is cut; where no shorter one keeps the grains together, the run ends and names the element.
    Fail,
    /// As `allow` in a body in which no more than one Gauss point in a hundred (but one in any case) is a void, as `fail`
    /// otherwise and in element tests: the grains of a single REV collapse now and then in a band, and touch again when the
    /// body around them has moved.
    Isolated,
    /// The REV is a void without stress and stiffness, until its grains touch again.
    Allow,
}

/// What is written for other programs to read. The curves of the whole run (CSV) always are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSettings {
    /// Fields are written for every so many load steps, and for the first and the last.
    #[schemars(range(min = 1))]
    pub every: u32,
    /// The fields that are written (VTU, for ParaView).
    pub fields: Vec<Field>,
}

impl Default for OutputSettings {
    fn default() -> Self {
        Self {
            every: 1,
            fields: Field::ALL.to_vec(),
        }
    }
}

/// A field over the mesh.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// Displacement from the initial position, at nodes.
    Displacement,
    /// Cauchy stress, positive in tension.
    Stress,
    /// Strain from the initial position, positive in extension.
    Strain,
    /// Second invariant of the deviatoric strain.
    ShearStrain,
    /// Volume of voids over volume of grains.
    VoidRatio,
    /// Mean number of contacts of a grain.
    Coordination,
    /// CPU time of the REV in this step, in seconds.
    RevCost,
    /// Where there is a second gradient: v, double stress, multiplier, and how well v is tied to the displacement.
    SecondGradient,
}

impl Field {
    /// All fields, in the order of the files.
    pub const ALL: [Field; 8] = [
        Field::Displacement,
        Field::Stress,
        Field::Strain,
        Field::ShearStrain,
        Field::VoidRatio,
        Field::Coordination,
        Field::RevCost,
        Field::SecondGradient,
    ];
}
