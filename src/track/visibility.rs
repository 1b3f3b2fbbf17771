//! See the tracker.
