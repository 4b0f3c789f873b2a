//! Which vector instructions there are, and how to let the compiler use them.
//!
//! Wider registers change the speed of a computation and not one bit of it: the compiler never contracts or reorders
//! floating-point operations.

use pulp::NullaryFnOnce;

/// What the processor can do.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Simd {
    #[cfg(target_arch = "x86_64")]
    Wide(pulp::x86::V3),
    #[cfg(target_arch = "x86_64")]
    Narrow(pulp::x86::V1),
    Plain,
}

impl Simd {
    /// The widest registers there are.
    #[cfg(target_arch = "x86_64")]
    pub fn of_this_processor() -> Self {
        use pulp::x86::{V1, V3};
        let narrow = || V1::try_new().map_or(Self::Plain, Self::Narrow);
        V3::try_new().map_or_else(narrow, Self::Wide)
    }

    /// Does the work with the widest registers there are. Its `call` must be marked `#[inline(always)]`, and so must
    /// what it calls: a function of its own would be compiled without them. (So would a closure.)
    #[inline(always)]
    pub fn run<W: NullaryFnOnce>(work: W) -> W::Output {
        match Self::of_this_processor() {
            #[cfg(target_arch = "x86_64")]
            Self::Wide(simd) => simd.vectorize(work),
            _ => work.call(),
        }
    }

    /// The widest registers there are.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn of_this_processor() -> Self {
        Self::Plain
    }
}
