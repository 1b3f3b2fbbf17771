//! Euclidean clusters in plan view.
