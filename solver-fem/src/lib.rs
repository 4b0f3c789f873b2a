//! femdem-flow: solver-fem.
