//! femdem-flow: workflows.
