//! What waves asked of the Gauss points: with the states committed before the step, enough to repeat any answer of it.
//!
//! An answer depends on the base, on the start and on F. Base and start are ends of earlier waves, which are not kept;
//! but they follow from the committed state by the waves before. So a step keeps what the last wave and those that it
//! builds on asked for: 32 bytes a Gauss point and wave, against some 15 kB of its state.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use solver_dem::Settings;
use solver_fem::{Base, GaussPointId, Tensor2, Wave};
use store::{Encoding, Frame, FrameId, Role};

use super::frames::{self, ASKED, DecodeError};

/// What one wave asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AskedWave {
    /// Its number in the step.
    pub wave: u32,
    /// The state that each point started from.
    pub base: Base,
    /// The wave whose ends were the first guesses.
    pub start: Option<u32>,
    /// [`Settings`] of the REVs as MessagePack with names: settings that are added later do not make this unreadable.
    #[serde(with = "serde_bytes")]
    settings: Vec<u8>,
    /// F from the base by Gauss point, four little-endian numbers each, row by row.
    #[serde(with = "serde_bytes")]
    gradients: Vec<u8>,
}

impl AskedWave {
    /// What `wave` asks for, its REVs solved with `settings`.
    pub fn of(wave: &Wave<2>, settings: &Settings) -> Self {
        let gradients = wave.points.iter().flat_map(|(_, f)| f.iter().flatten());
        Self {
            wave: wave.index,
            base: wave.base,
            start: wave.start,
            settings: rmp_serde::to_vec_named(settings)
                .expect("plain values serialise into memory"),
            gradients: solver_dem::wire::to_bytes(gradients),
        }
    }

    /// Whether another wave asks for the same deformation in the same way: base, start and F, but not settings.
    pub fn asks_the_same(&self, other: &Self) -> bool {
        (self.base, self.start, &self.gradients) == (other.base, other.start, &other.gradients)
    }

    /// F of a point; `None` for a point that was not asked.
    pub fn gradient(&self, point: GaussPointId) -> Option<Tensor2<2>> {
        let at = point.index().checked_mul(32)?;
        let bytes = self.gradients.get(at..at.checked_add(32)?)?;
        match solver_dem::wire::from_bytes(bytes)?.as_slice() {
            &[xx, xy, yx, yy] => Some([[xx, xy], [yx, yy]]),
            _ => None,
        }
    }

    /// How the REVs were solved.
    ///
    /// # Errors
    /// Settings of another version of the program, which this one does not know.
    pub fn settings(&self) -> Result<Settings, DecodeError> {
        let id = FrameId::new(ASKED, self.wave);
        rmp_serde::from_slice(&self.settings).map_err(|error| {
            DecodeError::new(id, format!("it has settings of another version: {error}"))
        })
    }

    /// The waves whose ends it builds on.
    fn builds_on(&self) -> impl Iterator<Item = u32> {
        let base = match self.base {
            Base::Committed => None,
            Base::Wave(wave) => Some(wave),
        };
        base.into_iter().chain(self.start)
    }

    /// Its frame in the pack of the step. It says how the result came about and is no part of the digest.
    pub fn frame(&self) -> Frame {
        Frame {
            id: FrameId::new(ASKED, self.wave),
            role: Role::Diagnostic,
            encoding: Encoding::Floats,
            payload: frames::encode(self),
        }
    }
}

/// What the waves of an attempt asked for, as far as a later wave may still build on them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AskedWaves(BTreeMap<u32, AskedWave>);

impl AskedWaves {
    /// Adds a wave and drops those on which neither it nor the `live` ones build.
    pub fn add(&mut self, wave: AskedWave, live: &[u32]) {
        let newest = wave.wave;
        self.0.insert(newest, wave);
        let mut kept = BTreeSet::new();
        for wave in live.iter().copied().chain([newest]) {
            self.ancestors(wave, &mut kept);
        }
        self.0.retain(|wave, _| kept.contains(wave));
    }

    /// The waves on which the ends of `wave` build and itself, ascending; `None` where one is not known, as in an attempt
    /// that a version began which did not keep them.
    pub fn leading_to(&self, wave: u32) -> Option<Vec<&AskedWave>> {
        let mut waves = BTreeSet::new();
        self.ancestors(wave, &mut waves);
        waves.iter().map(|wave| self.0.get(wave)).collect()
    }

    fn ancestors(&self, wave: u32, found: &mut BTreeSet<u32>) {
        let mut open = vec![wave];
        while let Some(wave) = open.pop() {
            if found.insert(wave)
                && let Some(asked) = self.0.get(&wave)
            {
                open.extend(asked.builds_on());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(index: u32, base: Base, start: Option<u32>) -> AskedWave {
        let points = (0..3).map(|k| {
            let f = f64::from(index) + 0.1 * f64::from(k);
            (GaussPointId(k), [[f, 0.5], [-0.25, 1.0 / f]])
        });
        let wave = Wave {
            index,
            base,
            start,
            points: points.collect(),
        };
        AskedWave::of(&wave, &Settings::default())
    }

    #[test]
    fn a_gradient_keeps_its_bits() {
        let bytes = frames::encode(&wave(3, Base::Wave(1), None));
        let back: AskedWave = frames::decode(FrameId::new(ASKED, 3), &bytes).unwrap();
        let f: f64 = 3.0 + 0.1 * 2.0;
        assert_eq!(
            back.gradient(GaussPointId(2)),
            Some([[f, 0.5], [-0.25, 1.0 / f]])
        );
        assert_eq!(back.gradient(GaussPointId(3)), None);
        assert_eq!(back.gradient(GaussPointId(u32::MAX)), None);
        assert_eq!(back.settings().unwrap(), Settings::default());
    }

    #[test]
    fn what_a_wave_builds_on_is_kept_and_nothing_else() {
        let mut asked = AskedWaves::default();
        asked.add(wave(0, Base::Committed, None), &[]);
        asked.add(wave(1, Base::Committed, Some(0)), &[0]);
        asked.add(wave(2, Base::Wave(1), None), &[1]);
        // Wave 2 went astray: the best iterate, 1, is left in another direction.
        asked.add(wave(3, Base::Wave(1), None), &[1]);
        let numbers: Vec<u32> = asked
            .leading_to(3)
            .unwrap()
            .iter()
            .map(|w| w.wave)
            .collect();
        assert_eq!(numbers, [0, 1, 3]);
        assert_eq!(asked.leading_to(2), None);
        // A journal of a version that kept nothing.
        let mut unknown = AskedWaves::default();
        unknown.add(wave(5, Base::Wave(4), None), &[4]);
        assert_eq!(unknown.leading_to(5), None);
    }
}
