//! The list of pairs that may touch, and the history that goes with it.

use super::{
    Assembly, Friction,
    kernel::{Block, Forces, LANES},
    link::{History, length},
};
use crate::{
    neighbours::{Pair, pairs},
    tensor::{invert, product},
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
        let pairs = pairs(&self.cell, &inverse, &positions, self.radii, self.margin);
        let histories = match friction {
            Friction::ReturnMapping => self.reference_histories(&pairs),
            Friction::Path => self.carried_histories(&pairs),
        };
        self.fill_blocks(&pairs, &histories);
        self.listed = positions;
        self.listed_inverse = inverse;
        true
    }

    /// Puts pairs that are held together in the reference state first: their blocks need no share of the slip,
    /// and most blocks of the others are open in all lanes.
    fn fill_blocks(&mut self, pairs: &[Pair<2>], histories: &[History]) {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by_key(|k| histories[*k].overlap0 < 0.0);
        let nobody = self.len() as u32;
        self.slots.clear();
        self.slots.resize(pairs.len(), 0);
        self.blocks.clear();
        for (slot, k) in order.into_iter().enumerate() {
            let (pair, l) = (&pairs[k], slot % LANES);
            if l == 0 {
                self.blocks.push(Block::empty(nobody));
            }
            let block = &mut self.blocks[slot / LANES];
            let image = self.cell.translation(&pair.shift);
            block.i[l] = pair.i;
            block.j[l] = pair.j;
            block.image[0][l] = image[0];
            block.image[1][l] = image[1];
            block.reach[l] = self.radii[pair.i as usize] + self.radii[pair.j as usize];
            block.remember(l, &histories[k]);
            self.slots[k] = slot as u32;
        }
        self.forces.clear();
        self.forces.resize(self.blocks.len(), Forces::default());
        self.shifts.clear();
        self.shifts.extend(pairs.iter().map(|pair| pair.shift));
    }

    /// History of the pairs from the reference state.
    fn reference_histories(&self, pairs: &[Pair<2>]) -> Vec<History> {
        let reference = &self.reference;
        let mut contacts = reference.contacts.iter().peekable();
        let history = |pair: &Pair<2>| {
            let (i, j) = (pair.i, pair.j);
            let image = reference.cell.translation(&pair.shift);
            let (a, b) = (
                reference.positions[i as usize],
                reference.positions[j as usize],
            );
            let branch0 = [b[0] - a[0] + image[0], b[1] - a[1] + image[1]];
            let reach = self.radii[i as usize] + self.radii[j as usize];
            while contacts.next_if(|c| (c.i, c.j) < (i, j)).is_some() {}
            let contact = contacts.next_if(|c| (c.i, c.j) == (i, j));
            let tangential0 = contact.map_or(0.0, |contact| contact.tangential[0]);
            History::at(&branch0, reach - length(&branch0), tangential0)
        };
        pairs.iter().map(history).collect()
    }

    /// History of pairs that stay listed, from the present list; nothing is known of the others.
    fn carried_histories(&self, pairs: &[Pair<2>]) -> Vec<History> {
        let mut old = self.links().peekable();
        let history = |pair: &Pair<2>| {
            let (i, j) = (pair.i, pair.j);
            while old.next_if(|o| (o.i, o.j) < (i, j)).is_some() {}
            let known = old.next_if(|o| (o.i, o.j) == (i, j));
            known.map_or(History::NONE, |known| known.history)
        };
        pairs.iter().map(history).collect()
    }
}
