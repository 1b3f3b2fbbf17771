//! A whole scene: crowd, bodies, sensors and truth, frame by frame.
