//! Packings as other codes write and read them.
//!
//! A flat record, meant to be serialised as JSON by the caller: an axis-aligned or sheared cell, the
//! contact parameters, one row a grain (`id, x, y, radius`), and optionally one row a contact whose
//! ninth column is the tangential force (force of grain 2 on grain 1 along (−n_y, n_x)).

use std::{collections::BTreeMap, sync::Arc};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{Cell, Contact, ContactLaw, Grains, Rev, RevState};

/// A packing in two dimensions. Keys of other codes that are not named here are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackingRecord {
    /// What the numbers are measured in, for the reader.
    #[serde(default)]
    pub units: String,
    /// First cell vector: (Lx, H_21).
    #[serde(rename = "Lx")]
    pub lx: f64,
    /// Second cell vector: (H_12, Ly).
    #[serde(rename = "Ly")]
    pub ly: f64,
    /// Off-diagonal components H_12 and H_21 of the cell.
    #[serde(default)]
    pub shear_of_cell: [f64; 2],
    /// Normal contact stiffness.
    pub kn: f64,
    /// Tangential contact stiffness.
    pub kt: f64,
    /// Friction coefficient while shearing.
    pub mu_shear: f64,
    /// Attraction of a closed contact, force.
    #[serde(default)]
    pub cohesion: f64,
    /// Isotropic stress at which the packing was made.
    pub sigma0: f64,
    /// `[id, x, y, radius]` by grain; ids are 0, 1, 2, ….
    pub bodies: Vec<[f64; 4]>,
    /// `[id1, id2, shift_x, shift_y, overlap, nx, ny, fn, ft?]` by contact.
    #[serde(default)]
    pub contacts_list: Vec<Vec<f64>>,
}

/// Why a record is not a packing.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RecordError {
    /// A number is missing, not finite or out of range.
    #[error("{0}")]
    Invalid(String),
}

impl PackingRecord {
    /// The REV of the record. Overlaps and normal forces follow from the positions; only the tangential
    /// forces are taken from the contact list.
    ///
    /// # Errors
    /// [`RecordError`] names the row and the value that cannot be.
    pub fn to_rev(&self) -> Result<Rev<2, 1>, RecordError> {
        let bad = |what: String| Err(RecordError::Invalid(what));
        let positive = [
            ("Lx", self.lx),
            ("Ly", self.ly),
            ("kn", self.kn),
            ("sigma0", self.sigma0),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return bad(format!("{name} is {value}, it must be a positive number"));
            }
        }
        for (name, value) in [
            ("kt", self.kt),
            ("mu_shear", self.mu_shear),
            ("cohesion", self.cohesion),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return bad(format!("{name} is {value}, it must be a number ≥ 0"));
            }
        }
        let cell = Cell {
            h: [
                [self.lx, self.shear_of_cell[0]],
                [self.shear_of_cell[1], self.ly],
            ],
        };
        let volume = cell.volume();
        if !(volume > 0.0 && volume.is_finite()) {
            return bad(format!(
                "shear_of_cell {:?} makes the cell degenerate",
                self.shear_of_cell
            ));
        }
        if self.bodies.is_empty() {
            return bad("bodies is empty".into());
        }
        for (row, [id, x, y, radius]) in self.bodies.iter().enumerate() {
            if *id != row as f64 {
                return bad(format!(
                    "bodies row {row} has id {id}: ids must count 0, 1, 2, …"
                ));
            }
            if !(x.is_finite() && y.is_finite() && *radius > 0.0 && radius.is_finite()) {
                return bad(format!(
                    "bodies row {row} needs a finite position and a positive radius"
                ));
            }
        }
        let contacts = self.contacts()?;
        Ok(Rev {
            grains: Arc::new(Grains {
                radii: self.bodies.iter().map(|b| b[3]).collect(),
            }),
            law: ContactLaw {
                normal_stiffness: self.kn,
                tangential_stiffness: self.kt,
                friction: self.mu_shear,
                cohesion: self.cohesion,
            },
            state: RevState {
                cell,
                positions: self.bodies.iter().map(|b| [b[1], b[2]]).collect(),
                contacts,
            },
        })
    }

    fn contacts(&self) -> Result<Vec<Contact<1>>, RecordError> {
        let n = self.bodies.len() as f64;
        let mut forces = BTreeMap::new();
        for (row, contact) in self.contacts_list.iter().enumerate() {
            let (Some(&a), Some(&b)) = (contact.first(), contact.get(1)) else {
                return Err(RecordError::Invalid(format!(
                    "contacts_list row {row} names no two grains"
                )));
            };
            let known = |id: f64| id >= 0.0 && id < n && id.fract() == 0.0;
            if !known(a) || !known(b) || a == b {
                return Err(RecordError::Invalid(format!(
                    "contacts_list row {row} joins {a} and {b}, which are not two grains of the packing"
                )));
            }
            // The scalar is the same seen from either grain: n and t both turn.
            let tangential = contact.get(8).copied().unwrap_or(0.0);
            if !tangential.is_finite() {
                return Err(RecordError::Invalid(format!(
                    "contacts_list row {row}: the force is not finite"
                )));
            }
            forces.insert((a.min(b) as u32, a.max(b) as u32), tangential);
        }
        Ok(forces
            .into_iter()
            .map(|((i, j), t)| Contact {
                i,
                j,
                tangential: [t],
            })
            .collect())
    }

    /// The record of a REV made at the isotropic stress `sigma0`.
    pub fn from_rev(rev: &Rev<2, 1>, sigma0: f64) -> Self {
        let h = rev.state.cell.h;
        let inverse = rev.state.cell.inverse().unwrap_or_default();
        let contacts_list = rev
            .state
            .contacts
            .iter()
            .map(|contact| {
                let (a, b) = (
                    rev.state.positions[contact.i as usize],
                    rev.state.positions[contact.j as usize],
                );
                let d = [b[0] - a[0], b[1] - a[1]];
                let shift = crate::tensor::apply(&inverse, &d).map(|s| -s.round());
                let image = rev.state.cell.translation(&shift);
                let branch = [d[0] + image[0], d[1] + image[1]];
                let distance = (branch[0] * branch[0] + branch[1] * branch[1]).sqrt();
                let reach =
                    rev.grains.radii[contact.i as usize] + rev.grains.radii[contact.j as usize];
                let overlap = reach - distance;
                vec![
                    f64::from(contact.i),
                    f64::from(contact.j),
                    shift[0] + 0.0,
                    shift[1] + 0.0,
                    overlap,
                    branch[0] / distance,
                    branch[1] / distance,
                    rev.law.normal_stiffness * overlap - rev.law.cohesion,
                    contact.tangential[0],
                ]
            })
            .collect();
        let bodies = rev
            .state
            .positions
            .iter()
            .zip(&rev.grains.radii)
            .enumerate();
        Self {
            units: "the user's own".into(),
            lx: h[0][0],
            ly: h[1][1],
            shear_of_cell: [h[0][1], h[1][0]],
            kn: rev.law.normal_stiffness,
            kt: rev.law.tangential_stiffness,
            mu_shear: rev.law.friction,
            cohesion: rev.law.cohesion,
            sigma0,
            bodies: bodies
                .map(|(id, (x, radius))| [id as f64, x[0], x[1], *radius])
                .collect(),
            contacts_list,
        }
    }
}
