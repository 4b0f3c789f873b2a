//! femdem-flow: engine.
