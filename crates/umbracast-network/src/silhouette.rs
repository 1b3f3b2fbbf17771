//! A body's outline as a path sees it, cut from its mesh, and what that costs the path by three models.

use std::f64::consts::{FRAC_PI_2, PI};

use umbracast::geometry::{DVec2, DVec3};

use crate::fresnel::Fresnel;

/// The outline is cut into stripes so high.
const STRIPE_M: f64 = 0.05;
/// Places of the body over which powers are averaged, so that no millimetre decides.
const OFFSETS_M: [f64; 5] = [-0.04, -0.023, 0.0, 0.017, 0.037];
/// Nothing loses more.
const MOST_DB: f64 = 50.0;
/// An antenna is not nearer to what it is shadowed by.
const NEAREST_M: f64 = 0.05;

/// By which model the truth is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TruthModel {
    /// The formula of 3GPP's model B, its shares of the field added up over the outline's stripes.
    ModelB,
    /// Kirchhoff's integral over the outline, as the mean power over 8 cm.
    Kirchhoff,
    /// Three knife edges at the outline's sides and top, as powers.
    Edges,
}

impl TruthModel {
    /// As a command names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::ModelB => "model-b",
            Self::Kirchhoff => "kirchhoff",
            Self::Edges => "edges",
        }
    }

    /// All of them.
    pub const ALL: [Self; 3] = [Self::ModelB, Self::Kirchhoff, Self::Edges];
}

/// What of a body stands across a path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outline {
    to_tx_m: f64,
    to_rx_m: f64,
    /// From the lowest up: right and left edge, bottom and top, from the path.
    stripes: Vec<[f64; 4]>,
}

/// The mesh of a body at an instant, with what does not depend on the path that it is looked at along.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    /// Its vertices from above, by stripe from the lowest up.
    stripes_m: Vec<Vec<DVec2>>,
    middle_m: DVec2,
    bottom_m: f64,
    top_m: f64,
}

impl Body {
    /// `None` of a mesh without vertices: who is not there.
    pub(crate) fn new(vertices_m: Vec<DVec3>) -> Option<Self> {
        let first = *vertices_m.first()?;
        let sum_m: DVec3 = vertices_m.iter().sum();
        let [bottom_m, top_m] =
            vertices_m.iter().fold([first.z; 2], |[low, high], v| [low.min(v.z), high.max(v.z)]);
        let middle_m = sum_m.truncate() / vertices_m.len() as f64;
        let count = ((top_m - bottom_m) / STRIPE_M).ceil().max(1.0) as usize;
        let mut stripes_m = vec![Vec::new(); count];
        for v in vertices_m {
            stripes_m[(((v.z - bottom_m) / STRIPE_M) as usize).min(count - 1)].push(v.truncate());
        }
        Some(Self { stripes_m, middle_m, bottom_m, top_m })
    }
}

impl Outline {
    /// Looks at a body along the path from `tx_m` to `rx_m`. False where it is not between both, or too far aside to matter.
    pub(crate) fn look(&mut self, tx_m: DVec3, rx_m: DVec3, body: &Body, aside_m: f64) -> bool {
        let way_m = (tx_m - rx_m).truncate();
        let length_m = way_m.length();
        let slope = (tx_m.z - rx_m.z) / length_m;
        let along = way_m / length_m;
        let off_m = body.middle_m - rx_m.truncate();
        let at_m = along.dot(off_m);
        if at_m < NEAREST_M || at_m > length_m - NEAREST_M || along.perp_dot(off_m).abs() > aside_m {
            return false;
        }
        let slant = slope.hypot(1.0);
        (self.to_rx_m, self.to_tx_m) = (at_m * slant, (length_m - at_m) * slant);
        let path_m = rx_m.z + slope * at_m;
        let [bottom_m, top_m] = [body.bottom_m, body.top_m];
        if path_m > top_m + 1.0 {
            return false;
        }
        let of_rx_m = along.perp_dot(rx_m.truncate());
        self.stripes.clear();
        for (i, stripe_m) in body.stripes_m.iter().enumerate() {
            let [right_m, left_m] = stripe_m.iter().fold([f64::MAX, f64::MIN], |[right, left], v| {
                let across_m = along.perp_dot(*v) - of_rx_m;
                [right.min(across_m), left.max(across_m)]
            });
            if right_m < left_m {
                let at_m = |edge: usize| (bottom_m + edge as f64 * STRIPE_M).min(top_m) - path_m;
                self.stripes.push([right_m, left_m, at_m(i), at_m(i + 1)]);
            }
        }
        !self.stripes.is_empty()
    }

    /// The loss in dB, not below zero for model B.
    pub(crate) fn loss_db(&self, model: TruthModel, fresnel: &Fresnel, wavelength_m: f64) -> f64 {
        match model {
            TruthModel::ModelB => self.model_b_db(wavelength_m),
            TruthModel::Kirchhoff => self.kirchhoff_db(fresnel, wavelength_m),
            TruthModel::Edges => self.edges_db(fresnel, wavelength_m),
        }
        .min(MOST_DB)
    }

    fn model_b_db(&self, wavelength_m: f64) -> f64 {
        let signed = |off_m: f64| {
            let round = |m: f64| m.hypot(off_m) - m;
            let detour_m = round(self.to_tx_m) + round(self.to_rx_m);
            (FRAC_PI_2 * (PI / wavelength_m * detour_m).sqrt()).atan().copysign(off_m) / PI
        };
        // Most stripes begin where the one below ends.
        let mut below = (f64::NAN, 0.0);
        let mut share = 0.0;
        for [right_m, left_m, low_m, high_m] in &self.stripes {
            let low = if below.0 == *low_m { below.1 } else { signed(*low_m) };
            below = (*high_m, signed(*high_m));
            share += (signed(*left_m) - signed(*right_m)) * (below.1 - low);
        }
        (-20.0 * (1.0 - share).max(1e-6).log10()).max(0.0)
    }

    fn per_m(&self, wavelength_m: f64) -> f64 {
        (2.0 / wavelength_m * (1.0 / self.to_tx_m + 1.0 / self.to_rx_m)).sqrt()
    }

    fn kirchhoff_db(&self, fresnel: &Fresnel, wavelength_m: f64) -> f64 {
        let per_m = self.per_m(wavelength_m);
        let between = |from_m: f64, to_m: f64| {
            let ([c0, s0], [c1, s1]) = (fresnel.at(per_m * from_m), fresnel.at(per_m * to_m));
            [c1 - c0, s0 - s1]
        };
        let mut power = 0.0;
        for off_m in OFFSETS_M {
            let mut sum = [0.0, 0.0];
            for [right_m, left_m, low_m, high_m] in &self.stripes {
                let (a, b) = (between(right_m + off_m, left_m + off_m), between(*low_m, *high_m));
                sum[0] += a[0] * b[0] - a[1] * b[1];
                sum[1] += a[0] * b[1] + a[1] * b[0];
            }
            power += (1.0 + 0.5 * sum[1]).powi(2) + (0.5 * sum[0]).powi(2);
        }
        -10.0 * (power / OFFSETS_M.len() as f64).log10()
    }

    /// The sides are those of what stands within a first zone's radius of the path's height.
    fn edges_db(&self, fresnel: &Fresnel, wavelength_m: f64) -> f64 {
        let per_m = self.per_m(wavelength_m);
        let zone_m = 1.0 / per_m;
        let round = |covered_m: f64| {
            let [c, s] = fresnel.at(per_m * covered_m);
            0.5 * ((0.5 - c).powi(2) + (0.5 - s).powi(2))
        };
        let near = self.stripes.iter().filter(|[.., low_m, high_m]| *low_m < zone_m && *high_m > -zone_m);
        let sides = near
            .fold([f64::MAX, f64::MIN], |[r, l], [right_m, left_m, ..]| [r.min(*right_m), l.max(*left_m)]);
        if sides[0] > sides[1] {
            return 0.0;
        }
        let top_m = self.stripes.last().map_or(0.0, |stripe| stripe[3]);
        let power = round(-sides[0]) + round(sides[1]) + round(top_m);
        (-10.0 * power.min(1.0).log10()).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a thin board across the x axis, dense enough for every stripe.
    fn board(at_m: DVec2, half_m: f64, top_m: f64) -> Body {
        let heights = (0..=(top_m / 0.02) as usize).map(|i| i as f64 * 0.02);
        let corners = heights.flat_map(|z| [-half_m, half_m].map(|y| DVec3::new(at_m.x, at_m.y + y, z)));
        Body::new(corners.collect()).unwrap()
    }

    #[test]
    fn a_board_loses_what_the_formulas_say_of_a_screen() {
        let (ap_m, ue_m) = (DVec3::new(10.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 1.2));
        let (mut outline, fresnel) = (Outline::default(), Fresnel::new());
        let wavelength_m = 299_792_458.0 / 28e9;
        assert!(outline.look(ap_m, ue_m, &board(DVec2::new(1.0, 0.0), 0.15, 1.7), 2.0));
        // TR 38.901, model B: 11.83 dB for an upright screen of 0.3 x 1.7 m.
        let found = outline.loss_db(TruthModel::ModelB, &fresnel, wavelength_m);
        assert!((found - 11.83).abs() < 0.4, "{found}");
        for model in [TruthModel::Kirchhoff, TruthModel::Edges] {
            let found = outline.loss_db(model, &fresnel, wavelength_m);
            assert!((11.0..19.0).contains(&found), "{model:?} {found}");
        }
        assert!(!outline.look(ap_m, ue_m, &board(DVec2::new(1.0, 3.0), 0.15, 1.7), 2.0));
        assert!(outline.look(ap_m, ue_m, &board(DVec2::new(1.0, 1.2), 0.15, 1.7), 2.0));
        for model in TruthModel::ALL {
            let found = outline.loss_db(model, &fresnel, wavelength_m);
            assert!(found.abs() < 0.3, "{model:?} {found}");
        }
        assert!(
            !outline.look(ap_m, ue_m, &board(DVec2::new(-1.0, 0.0), 0.15, 1.7), 2.0),
            "behind the device"
        );
    }
}
