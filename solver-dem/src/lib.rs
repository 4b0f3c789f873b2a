//! femdem-flow: solver-dem.
