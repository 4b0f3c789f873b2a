//! What the frames of a step hold, and their bytes.
//!
//! | kind | index | role | content |
//! |---|---|---|---|
//! | 1 `POINT` | Gauss point | content | its state: cell, positions, contacts (or the elastic stress) |
//! | 2 `ANSWER` | Gauss point | diagnostic, journal only | rotations, stress, tangents, report, what it is good for as a start |
//! | 3 `PACKING` | packing | content, step 0 only | grains, law, state, stress, tangent |
//! | 4 `DEAL` | 0 | content, step 0 only | the packing of each Gauss point |
//! | 5 `MACRO` | 0 | content | the macro state |
//! | 6 `PROGRESS` | 0 | content | place in the programme, step-size control |
//! | 7 `COST` | 0 | diagnostic | CPU seconds of each Gauss point's element in the step |
//! | 8 `ASKED` | wave | diagnostic | what the last wave, and those it builds on, asked of every Gauss point |
//!
//! All are MessagePack, structs as arrays. Grains and contact law never change, so a point's state leaves them out and takes
//! them from the packing dealt to it at step 0; where the input scatters the friction or a new start replaces a law, the
//! law follows from the run's record (`relaw.rs`).

use std::sync::Arc;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use solver_dem::{Report, RevState, Trust};
use solver_fem::{GaussPointId, Tensor2, Tensor4};
use store::{Encoding, Frame, FrameId, Role};

use super::{
    point::{PointAnswer, PointEnd, PointState, with_state},
    work::Packing,
};

/// State of a Gauss point.
pub const POINT: u16 = 1;
/// Answer of a Gauss point.
pub const ANSWER: u16 = 2;
/// A packing.
pub const PACKING: u16 = 3;
/// Which packing each Gauss point got.
pub const DEAL: u16 = 4;
/// The macro state.
pub const MACRO: u16 = 5;
/// Place in the programme.
pub const PROGRESS: u16 = 6;
/// CPU time by Gauss point.
pub const COST: u16 = 7;
/// What a wave asked for.
pub const ASKED: u16 = 8;

/// A frame's bytes are not what they should be.
#[derive(Debug, thiserror::Error)]
#[error("decode frame {kind}.{index}: {reason}")]
pub struct DecodeError {
    kind: u16,
    index: u32,
    reason: String,
}

impl DecodeError {
    pub(super) fn new(id: FrameId, reason: impl std::fmt::Display) -> Self {
        Self {
            kind: id.kind,
            index: id.index,
            reason: reason.to_string(),
        }
    }
}

/// MessagePack bytes of a plain value.
pub fn encode(value: &impl Serialize) -> Vec<u8> {
    rmp_serde::to_vec(value).expect("plain values of known length serialise into memory")
}

/// The value of a frame.
///
/// # Errors
/// Bytes that are not such a value.
pub fn decode<T: DeserializeOwned>(id: FrameId, bytes: &[u8]) -> Result<T, DecodeError> {
    rmp_serde::from_slice(bytes).map_err(|error| DecodeError::new(id, error))
}

/// A frame of the result.
pub fn content(kind: u16, index: u32, value: &impl Serialize) -> Frame {
    Frame::content(FrameId::new(kind, index), encode(value))
}

/// A point's state without what its packing knows.
#[derive(Serialize, Deserialize)]
enum StoredPoint {
    Rev(RevState<2, 1>),
    Elastic(Tensor2<2>),
}

#[derive(Serialize)]
enum StoredPointRef<'a> {
    Rev(&'a RevState<2, 1>),
    Elastic(&'a Tensor2<2>),
}

/// The frame of a point's state.
pub fn point_frame(point: GaussPointId, state: &PointState) -> Frame {
    let stored = match state {
        PointState::Rev(rev) => StoredPointRef::Rev(&rev.state),
        PointState::Elastic { stress, .. } => StoredPointRef::Elastic(stress),
    };
    // Of all waves only the last one's states are committed.
    Frame {
        encoding: Encoding::FloatsOnceSealed,
        ..content(POINT, point.0, &stored)
    }
}

/// A point's state from its frame and the state dealt to it at step 0.
///
/// # Errors
/// Bytes that are no state of this point.
pub fn read_point(
    point: GaussPointId,
    bytes: &[u8],
    dealt: &PointState,
) -> Result<PointState, DecodeError> {
    let id = FrameId::new(POINT, point.0);
    match (decode(id, bytes)?, dealt) {
        (StoredPoint::Rev(state), PointState::Rev(rev)) => {
            if state.positions.len() != rev.grains.radii.len() {
                return Err(DecodeError::new(
                    id,
                    "it has another number of grains than its packing",
                ));
            }
            Ok(PointState::Rev(with_state(rev, state)))
        }
        (StoredPoint::Elastic(stress), PointState::Elastic { law, .. }) => {
            Ok(PointState::Elastic { law: *law, stress })
        }
        _ => Err(DecodeError::new(id, "it belongs to another material")),
    }
}

#[derive(Serialize, Deserialize)]
struct StoredAnswer {
    #[serde(with = "serde_bytes")]
    rotations: Vec<u8>,
    stress: Tensor2<2>,
    tangent: Tensor4<2>,
    elastic_tangent: Tensor4<2>,
    report: Option<Report>,
    /// Absent in journals of earlier versions, which went on from no answer.
    #[serde(default)]
    trust: Trust,
}

/// The frame of what an answer holds beside the state.
pub fn answer_frame(answer: &PointAnswer) -> Frame {
    let stored = StoredAnswer {
        rotations: solver_dem::wire::to_bytes(answer.end.rotations.iter()),
        stress: answer.stress,
        tangent: answer.tangent,
        elastic_tangent: answer.elastic_tangent,
        report: answer.report,
        trust: answer.end.trust,
    };
    Frame {
        id: FrameId::new(ANSWER, answer.point.0),
        role: Role::Diagnostic,
        encoding: Encoding::FloatsOnceSealed,
        payload: encode(&stored),
    }
}

/// An answer from its two frames.
///
/// # Errors
/// Bytes that are no answer.
pub fn read_answer(
    point: GaussPointId,
    state: PointState,
    bytes: &[u8],
) -> Result<PointAnswer, DecodeError> {
    let id = FrameId::new(ANSWER, point.0);
    let stored: StoredAnswer = decode(id, bytes)?;
    let rotations = solver_dem::wire::from_bytes(&stored.rotations)
        .ok_or_else(|| DecodeError::new(id, "the rotations are torn"))?;
    Ok(PointAnswer {
        point,
        end: Arc::new(PointEnd {
            state: Arc::new(state),
            rotations,
            trust: stored.trust,
        }),
        stress: stored.stress,
        tangent: stored.tangent,
        elastic_tangent: stored.elastic_tangent,
        report: stored.report,
    })
}

/// The initial state of each Gauss point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Deal {
    /// By Gauss point: the packing it got, or its elastic law and stress.
    pub points: Vec<Dealt>,
}

/// What a Gauss point got.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Dealt {
    /// The packing of this number.
    Packing(u32),
    /// An elastic law.
    Elastic(PointState),
}

impl Deal {
    /// The initial states, points with the same packing sharing it. `None` for a packing that is
    /// not there.
    pub fn states(&self, packings: &[Packing]) -> Option<Vec<Arc<PointState>>> {
        let shared: Vec<Arc<PointState>> = packings
            .iter()
            .map(|p| Arc::new(PointState::Rev(p.rev.clone())))
            .collect();
        self.points
            .iter()
            .map(|dealt| match dealt {
                Dealt::Packing(k) => shared.get(*k as usize).cloned(),
                Dealt::Elastic(state) => Some(Arc::new(state.clone())),
            })
            .collect()
    }
}
