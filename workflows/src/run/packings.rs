//! Which packings a run needs, and which Gauss point gets which.

use std::collections::BTreeMap;

use solver_dem::{Recipe, exchange::PackingRecord};
use solver_fem::elastic::Elastic;
use store::Digest;

use super::{
    draw::draw,
    error::RunError,
    frames::{Deal, Dealt, encode},
    model::Model,
    point::PointState,
    work::Job,
};
use crate::input::{
    Packings, Problem,
    problem::{Law, Material, Model as InputModel, Origin, Rev},
};

/// Changes whenever the same recipe would give other bits, so that an old cache is not taken for new.
const PREPARATION: &str = "preparation 2";

/// What has to be prepared, and how it is dealt out.
pub struct Plan {
    /// One job a packing.
    pub jobs: Vec<Job>,
    /// Whose packing each job makes: the material, and its number among the packings of the material.
    pub names: Vec<(String, u64)>,
    /// Which packing each Gauss point gets.
    pub deal: Deal,
}

impl Plan {
    /// The plan of a body: `materials[k]` is the material of element k, with `per_element` Gauss points.
    ///
    /// # Errors
    /// A packing file that cannot be read, constants that are no elastic law.
    pub fn of_body(materials: &[&Material], per_element: usize) -> Result<Self, RunError> {
        let mut planner = Planner::default();
        let mut points = Vec::with_capacity(materials.len() * per_element);
        for (element, material) in materials.iter().enumerate() {
            for local in 0..per_element {
                points.push(match &material.law {
                    Law::Elastic(elastic) => Dealt::Elastic(elastic_point(elastic)?),
                    Law::Rev(rev) => {
                        let point = (element * per_element + local) as u64;
                        let number = match rev.packings {
                            Packings::Shared => 0,
                            Packings::Gallery(size) => {
                                draw(rev.seed, point) % u64::from(size.max(1))
                            }
                            Packings::OnePerElement => element as u64,
                            Packings::OnePerGaussPoint => point,
                        };
                        Dealt::Packing(planner.packing(material, rev, number, true)?)
                    }
                });
            }
        }
        Ok(Self {
            jobs: planner.jobs,
            names: planner.names,
            deal: Deal { points },
        })
    }

    /// The plan of an element test. A packing from a file is taken as it is, so that other codes'
    /// results can be compared.
    ///
    /// # Errors
    /// A packing file that cannot be read, a material without grains.
    pub fn of_element_test(material: &Material) -> Result<Self, RunError> {
        let Law::Rev(rev) = &material.law else {
            return Err(RunError::Model(format!(
                "material `{}` has no grains to test",
                material.name
            )));
        };
        let mut planner = Planner::default();
        let packing = planner.packing(material, rev, 0, false)?;
        let deal = Deal {
            points: vec![Dealt::Packing(packing)],
        };
        Ok(Self {
            jobs: planner.jobs,
            names: planner.names,
            deal,
        })
    }
}

impl Plan {
    /// The plan of all that `problem` needs, and the model of its body.
    ///
    /// # Errors
    /// What the mesh, the conditions or the packings refuse.
    pub fn of_problem(problem: &Problem) -> Result<(Self, Option<Model>), RunError> {
        match &problem.model {
            InputModel::Body(body) => {
                let model = Model::to_solve(body, problem.loads.len(), &problem.solver)?;
                model.check(&problem.programme)?;
                let materials: Vec<&Material> = model
                    .materials
                    .iter()
                    .map(|&k| &problem.materials[k])
                    .collect();
                let plan = Self::of_body(&materials, model.problem.points_per_element())?;
                Ok((plan, Some(model)))
            }
            InputModel::ElementTest(test) => Ok((
                Self::of_element_test(&problem.materials[test.material])?,
                None,
            )),
        }
    }

    /// Leaves out what the material `name` does not need. The points are dealt nothing any more.
    pub fn keep_only(&mut self, name: &str) {
        let kept: Vec<bool> = self
            .names
            .iter()
            .map(|(material, _)| material == name)
            .collect();
        let mut keep = kept.iter();
        self.jobs.retain(|_| keep.next().is_some_and(|keep| *keep));
        self.names.retain(|(material, _)| material == name);
        self.deal.points.clear();
    }
}

/// The key of a job's result in the cache.
pub fn cache_key(job: &Job) -> Digest {
    let mut bytes = PREPARATION.as_bytes().to_vec();
    bytes.extend(encode(job));
    Digest::of(&bytes)
}

#[derive(Default)]
struct Planner {
    jobs: Vec<Job>,
    names: Vec<(String, u64)>,
    /// Material name and number of the packing within the material → number of the job.
    known: BTreeMap<(String, u64), u32>,
}

impl Planner {
    fn packing(
        &mut self,
        material: &Material,
        rev: &Rev,
        number: u64,
        settle: bool,
    ) -> Result<u32, RunError> {
        let key = (material.name.clone(), number);
        if let Some(&job) = self.known.get(&key) {
            return Ok(job);
        }
        let job = match &rev.origin {
            Origin::Prepared(preparation) => Job::Prepare(Recipe {
                grains: preparation.grains,
                sizes: preparation.sizes.clone(),
                confining_stress: rev.confining_stress,
                stiffness: rev.stiffness,
                tangential_stiffness: rev.tangential_stiffness,
                friction: rev.friction,
                preparation_friction: preparation.friction,
                cohesion_ratio: rev.cohesion_ratio,
                aspect_ratio: preparation.aspect_ratio,
                anisotropy: preparation.anisotropy,
                orientation: preparation.orientation,
                target: preparation.target,
                seed: if number == 0 {
                    rev.seed
                } else {
                    draw(rev.seed, number)
                },
            }),
            Origin::Imported(path) => {
                let mut packing = read_packing(path)?;
                packing.law = law(rev, &packing);
                Job::Adopt {
                    rev: packing,
                    pressure: settle.then_some(rev.confining_stress),
                }
            }
        };
        let index = self.jobs.len() as u32;
        self.jobs.push(job);
        self.names.push(key.clone());
        self.known.insert(key, index);
        Ok(index)
    }
}

/// The contact law of a material on a given packing: kn = κ σ0, f_c = p* a σ0.
pub fn law(rev: &Rev, packing: &super::point::PlaneRev) -> solver_dem::ContactLaw {
    let kn = rev.stiffness * rev.confining_stress;
    solver_dem::ContactLaw {
        normal_stiffness: kn,
        tangential_stiffness: rev.tangential_stiffness * kn,
        friction: rev.friction,
        cohesion: rev.cohesion_ratio * rev.confining_stress * packing.grains.mean_diameter(),
    }
}

/// Reads a packing file.
///
/// # Errors
/// A file that cannot be read, is no JSON, or no packing.
pub fn read_packing(path: &str) -> Result<super::point::PlaneRev, RunError> {
    read_record(path).map(|(_, rev)| rev)
}

/// Reads a packing file, and what it says beside the packing.
///
/// # Errors
/// As [`read_packing`].
pub fn read_record(path: &str) -> Result<(PackingRecord, super::point::PlaneRev), RunError> {
    let failed = |reason: String| RunError::Packing {
        path: path.to_owned(),
        reason,
    };
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    let record: PackingRecord =
        serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let rev = record.to_rev().map_err(|error| failed(error.to_string()))?;
    Ok((record, rev))
}

/// A point of an elastic material before loading.
///
/// # Errors
/// Constants that are no elastic law.
pub fn elastic_point(elastic: &crate::input::problem::Elastic) -> Result<PointState, RunError> {
    let law = Elastic::new(elastic.young, elastic.poisson)
        .map_err(|error| RunError::Model(error.to_string()))?;
    let p = elastic.initial_stress;
    Ok(PointState::Elastic {
        law,
        stress: [[p, 0.0], [0.0, p]],
    })
}
