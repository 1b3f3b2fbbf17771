//! See the caster.
