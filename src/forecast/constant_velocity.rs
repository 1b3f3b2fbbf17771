//! Constant velocity on the filtered state.
