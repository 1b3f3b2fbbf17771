//! What is new to one sensor, and since when.

/// One surface that is nearer than the background.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stay {
    /// 0 of none.
    pub(super) range_m: f32,
    /// The revolution that it came in, and the last that saw it or something before it.
    pub(super) since: u32,
    pub(super) last: u32,
    /// Who was there when it came.
    pub(super) came: Near,
}

/// What is new to one sensor, and stays.
#[derive(Debug, Clone, Default)]
pub(super) struct Stays {
    pub(super) of_pixel: Vec<[Stay; 2]>,
    /// The revolution before which it was not seen what came.
    pub(super) blind: u32,
}

impl Stays {
    /// What may have been there for long, behind what was taken away.
    pub(super) fn hid(&mut self, pixel: usize, range_m: f32, count: u32) {
        self.of_pixel[pixel][0] = Stay { range_m, since: count, last: count, came: Near::Unsure };
    }
}

/// Who is near a return.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Near {
    #[default]
    Nobody,
    /// Who may be a person, but was never seen to walk; or what is there was hidden before.
    Unsure,
    Walker,
    /// A walker, and beside him somebody who was never seen to walk.
    Both,
}
