//! femdem-flow: store.
