//! femdem-flow: tests.
