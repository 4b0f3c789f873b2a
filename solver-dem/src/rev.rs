//! The REV: grains in a periodic cell, with their contact history.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{Cell, ContactLaw, tensor::Vector};

/// What never changes about the grains of a packing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grains {
    /// Radii in length units, by grain number.
    pub radii: Vec<f64>,
}

impl Grains {
    /// a: the mean diameter.
    pub fn mean_diameter(&self) -> f64 {
        2.0 * self.radii.iter().sum::<f64>() / self.radii.len().max(1) as f64
    }

    /// The largest radius.
    pub fn largest_radius(&self) -> f64 {
        self.radii.iter().copied().fold(0.0, f64::max)
    }

    /// The area (2D) or volume (3D) of all grains, overlaps counted twice.
    pub fn solid_volume<const D: usize>(&self) -> f64 {
        let unit = if D == 2 {
            std::f64::consts::PI
        } else {
            4.0 / 3.0 * std::f64::consts::PI
        };
        let power = |r: &f64| (0..D).map(|_| r).product::<f64>();
        unit * self.radii.iter().map(power).sum::<f64>()
    }
}

/// A closed contact and what it remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<const S: usize> {
    /// The grain with the lower number.
    pub i: u32,
    /// The grain with the higher number; the normal points from `i` to `j`.
    pub j: u32,
    /// Tangential force. In 2D one component: the force of grain `j` on grain `i` along
    /// (−n_y, n_x), in force units; objective by itself.
    pub tangential: [f64; S],
}

/// The part of a REV that evolves, in space dimension `D` with `S` components of rotation
/// (1 in 2D, 3 in 3D). It holds all that the next increment reads: a restart from it gives the
/// same bits. Velocities are zero and rotations are counted from here.
#[derive(Clone, Debug, PartialEq)]
pub struct RevState<const D: usize, const S: usize> {
    /// The periodic cell.
    pub cell: Cell<D>,
    /// Grain centres, not wrapped into the cell, in length units.
    pub positions: Vec<Vector<D>>,
    /// Closed contacts, sorted by (i, j).
    pub contacts: Vec<Contact<S>>,
}

/// A REV: grains, contact law and state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rev<const D: usize, const S: usize> {
    /// Shared by all states of one packing.
    pub grains: Arc<Grains>,
    /// Shared by all contacts.
    pub law: ContactLaw,
    /// What evolves.
    pub state: RevState<D, S>,
}

impl<const D: usize, const S: usize> Rev<D, S> {
    /// e = V_void/V_solid = V/V_solid − 1.
    pub fn void_ratio(&self) -> f64 {
        self.state.cell.volume() / self.grains.solid_volume::<D>() - 1.0
    }

    /// z = 2 N_c/N, rattlers included in N.
    pub fn coordination(&self) -> f64 {
        2.0 * self.state.contacts.len() as f64 / self.grains.radii.len().max(1) as f64
    }

    /// The number of grains with fewer than D contacts: they carry no load (with cohesion, two
    /// grains may still hang on to each other).
    pub fn rattlers(&self) -> usize {
        let mut degree = vec![0usize; self.grains.radii.len()];
        for contact in &self.state.contacts {
            degree[contact.i as usize] += 1;
            degree[contact.j as usize] += 1;
        }
        degree.into_iter().filter(|&d| d < D).count()
    }
}
