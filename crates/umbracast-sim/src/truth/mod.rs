//! What is really blocked: segments from access points to UEs against meshes and the hall.
