//! The list of pairs that may touch, and the history that goes with it.

use super::{
    Assembly, Friction,
    kernel::{Block, LANES},
    link::{Link, length},
};
use crate::{
    neighbours::pairs,
    tensor::{Vector, invert, product},
};

/// Cycles between two looks at the list.
const LIST_CHECK: u32 = 16;

impl Assembly<'_> {
    /// Builds the pair list anew when it is no longer certain to hold all contacts until the next
    /// look. `false` when the cell has become too small for its grains.
    pub fn refresh_list(&mut self, cycle: u32, friction: Friction) -> bool {
        if !cycle.is_multiple_of(LIST_CHECK) {
            return true;
        }
        // Displacement relative to the motion of the cell: x − H·H_listed⁻¹·x_listed.
        let carried = product(&self.cell.h, &self.listed_inverse);
        let (mut displacement2, mut speed2): (f64, f64) = (0.0, 0.0);
        for ((pose, old), v) in self.poses.iter().zip(&self.listed).zip(&self.velocities) {
            let dx = pose[0] - (carried[0][0] * old[0] + carried[0][1] * old[1]);
            let dy = pose[1] - (carried[1][0] * old[0] + carried[1][1] * old[1]);
            displacement2 = displacement2.max(dx * dx + dy * dy);
            speed2 = speed2.max(v[0] * v[0] + v[1] * v[1]);
        }
        let stretch = (0..4)
            .map(|k| (carried[k / 2][k % 2] - f64::from(u8::from(k / 2 == k % 2))).abs())
            .fold(0.0, f64::max);
        let longest = 2.0 * self.radii.iter().copied().fold(0.0, f64::max) + self.margin;
        let ahead = f64::from(LIST_CHECK) * self.dt * speed2.sqrt();
        // Two grains approach each other by at most twice the largest displacement. The rest of the
        // margin is for what velocities and the cell gain until the next look.
        let used = 2.0 * (displacement2.sqrt() + ahead) + 2.0 * stretch * longest;
        if used < 0.8 * self.margin {
            return true;
        }
        self.build_list(friction)
    }

    pub(super) fn build_list(&mut self, friction: Friction) -> bool {
        let (volume, inverse) = invert(&self.cell.h);
        let Some(inverse) = inverse else { return false };
        let cutoff = 2.0 * self.radii.iter().copied().fold(0.0, f64::max) + self.margin;
        let positions = self.positions();
        let finite = positions.iter().flatten().all(|x| x.is_finite());
        if volume.is_nan() || volume <= 0.0 || !finite || self.cell.smallest_height() < 2.0 * cutoff
        {
            return false;
        }
        let old: Vec<Link> = match friction {
            Friction::ReturnMapping => Vec::new(),
            Friction::Path => self.links().collect(),
        };
        let pairs = pairs(&self.cell, &inverse, &positions, self.radii, self.margin);
        let nobody = positions.len() as u32;
        self.pairs = pairs.len();
        self.shifts.clear();
        self.blocks.clear();
        for chunk in pairs.chunks(LANES) {
            let mut block = Block::empty(nobody);
            for (l, pair) in chunk.iter().enumerate() {
                block.i[l] = pair.i;
                block.j[l] = pair.j;
                let image = self.cell.translation(&pair.shift);
                block.image[0][l] = image[0];
                block.image[1][l] = image[1];
                self.shifts.push(pair.shift);
            }
            self.blocks.push(block);
        }
        match friction {
            Friction::ReturnMapping => self.recall_reference(),
            Friction::Path => self.carry_history(&old),
        }
        self.listed = positions;
        self.listed_inverse = inverse;
        true
    }

    /// History of every listed pair from the reference state.
    fn recall_reference(&mut self) {
        let reference = &self.reference;
        let mut contacts = reference.contacts.iter().peekable();
        for (k, shift) in self.shifts.iter().enumerate() {
            let (block, l) = (&mut self.blocks[k / LANES], k % LANES);
            let (i, j) = (block.i[l], block.j[l]);
            let image = reference.cell.translation(shift);
            let (a, b) = (
                reference.positions[i as usize],
                reference.positions[j as usize],
            );
            let branch0 = [b[0] - a[0] + image[0], b[1] - a[1] + image[1]];
            let reach = self.radii[i as usize] + self.radii[j as usize];
            let mut tangential0 = 0.0;
            while contacts.next_if(|c| (c.i, c.j) < (i, j)).is_some() {}
            if let Some(contact) = contacts.next_if(|c| (c.i, c.j) == (i, j)) {
                tangential0 = contact.tangential[0];
            }
            remember(block, l, &branch0, reach - length(&branch0), tangential0);
        }
    }

    /// History of pairs that stay listed, from the old list.
    fn carry_history(&mut self, old: &[Link]) {
        let mut old = old.iter().peekable();
        for k in 0..self.pairs {
            let now = self.link(k);
            let (block, l) = (&mut self.blocks[k / LANES], k % LANES);
            while old.next_if(|o| (o.i, o.j) < (now.i, now.j)).is_some() {}
            if let Some(known) = old.next_if(|o| (o.i, o.j) == (now.i, now.j)) {
                remember(block, l, &known.branch0, known.overlap0, known.tangential0);
                block.normal[l] = known.normal;
                block.tangential[l] = known.tangential;
                block.overlap[l] = known.overlap;
            } else {
                let (a, b) = (self.poses[now.i as usize], self.poses[now.j as usize]);
                let branch = [b[0] - a[0] + now.image[0], b[1] - a[1] + now.image[1]];
                remember(block, l, &branch, f64::NEG_INFINITY, 0.0);
            }
        }
    }
}

/// Sets the reference state of one pair.
pub(super) fn remember(
    block: &mut Block,
    lane: usize,
    branch0: &Vector<2>,
    overlap0: f64,
    tangential0: f64,
) {
    block.branch0[0][lane] = branch0[0];
    block.branch0[1][lane] = branch0[1];
    block.inverse0[lane] = 1.0 / length(branch0);
    block.overlap0[lane] = overlap0;
    block.tangential0[lane] = tangential0;
}
