//! Counting what is journalled without reading it.

use std::fs::File;
use std::os::unix::fs::FileExt;

use crate::frame;
use crate::id::{RunName, StepIndex, WaveIndex};
use crate::part;
use crate::read_only::ReadOnlyStore;

/// How far the journal of a wave was counted; begin with the default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCount {
    /// Where the next frame begins.
    at: u64,
    /// Frames so far.
    pub frames: u64,
}

impl ReadOnlyStore {
    /// Goes on counting the frames of class `kind` in the journal of a wave, by their headers alone: cheap enough to be
    /// done again and again while the wave runs. What is not there counts as nothing.
    pub fn count_frames(
        &self,
        run: &RunName,
        step: StepIndex,
        wave: WaveIndex,
        kind: u16,
        count: &mut FrameCount,
    ) -> u64 {
        let Ok(file) = File::open(self.files().part(run, step, wave)) else {
            return count.frames;
        };
        let len = file.metadata().map_or(0, |data| data.len());
        if count.at == 0 {
            count.at = part::BEGIN;
        }
        let mut head = [0; frame::HEADER_LEN];
        while file.read_exact_at(&mut head, count.at).is_ok() {
            let Some((id, frame_len)) = frame::peek(&head) else {
                break;
            };
            if count.at + frame_len > len {
                break;
            }
            count.at += frame_len;
            count.frames += u64::from(id.kind == kind);
        }
        count.frames
    }
}
