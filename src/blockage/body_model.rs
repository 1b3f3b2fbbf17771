//! The body that a ray meets, as numbers: fitted by `umbracast train body` to which links walking meshes blocked, and shipped as
//! `models/body.toml`; data and scores are in the card beside it.

use serde::{Deserialize, Serialize};

use crate::Error;

/// An upright body. All sizes are shares of the standing height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyModel {
    /// Elliptic cylinders from the floor up.
    pub slices: Vec<Slice>,
    /// Mediolateral sway: side to side, half of the way that the trunk goes as it walks.
    pub sway_left: f64,
    /// Anteroposterior sway: the same ahead and back, twice a stride.
    pub sway_ahead: f64,
    /// Left and right alike.
    pub arms: Arms,
}

/// One elliptic cylinder of a body, from the top of the one below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slice {
    /// Upper end.
    pub top: f64,
    /// Half axis front to back.
    pub half_depth: f64,
    /// Half axis side to side.
    pub half_width: f64,
    /// Its middle ahead of the body axis.
    pub ahead: f64,
    /// The same to the left; 0 of a usual body.
    #[serde(default)]
    pub left: f64,
}

/// An arm: rods from the shoulder to the elbow and on to the middle of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arms {
    /// Above the floor.
    pub shoulder_up: f64,
    /// Away from the axis.
    pub shoulder_out: f64,
    /// Above the floor.
    pub elbow_up: f64,
    /// Away from the axis.
    pub elbow_out: f64,
    /// Above the floor.
    pub hand_up: f64,
    /// Away from the axis.
    pub hand_out: f64,
    /// Of the upper arm.
    pub upper_radius: f64,
    /// Of forearm and hand.
    pub fore_radius: f64,
    /// How far the elbow swings to either side, for a speed of one hip height a second.
    pub elbow_swing: f64,
    /// How far ahead the hand is in the middle of its swing, for the same speed.
    pub hand_ahead: f64,
    /// How far the hand swings to either side of that, for the same speed.
    pub hand_swing: f64,
}

impl BodyModel {
    /// The model that is embedded in the program.
    pub fn shipped() -> Self {
        Self::parse(include_str!("../../models/body.toml")).expect("the embedded file is proven by a test")
    }

    /// Reads a model.
    ///
    /// # Errors
    /// No TOML, a number that is missing, or slices that do not stand on each other, with what was expected and found.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let model: Self = toml::from_str(text).map_err(|e| Error::new(format!("model of the body: {e}")))?;
        let mut bottom = 0.0;
        for Slice { top, half_depth, half_width, .. } in &model.slices {
            if !(*top > bottom && *half_depth > 0.0 && *half_width > 0.0) {
                return Err(Error::new(format!(
                    "model of the body: slices: expected half axes above 0 and a top above {bottom}, found half axes \
                     {half_depth} and {half_width} and the top {top}"
                )));
            }
            bottom = *top;
        }
        let Arms { upper_radius, fore_radius, .. } = model.arms;
        if !(upper_radius >= 0.0 && fore_radius >= 0.0) {
            return Err(Error::new(format!(
                "model of the body: arms: expected radii of 0 and more, found {upper_radius} and {fore_radius}"
            )));
        }
        Ok(model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_model_stands_as_high_as_its_owner() {
        let model = BodyModel::shipped();
        assert_eq!(model.slices.last().map(|slice| slice.top), Some(1.0));
    }

    #[test]
    fn arms_thinner_than_nothing_are_refused() {
        let mut model = BodyModel::shipped();
        model.arms.fore_radius = -0.01;
        let message = BodyModel::parse(&toml::to_string(&model).unwrap()).unwrap_err().to_string();
        assert!(message.contains("radii of 0 and more") && message.contains("-0.01"), "{message}");
    }

    #[test]
    fn slices_that_do_not_rise_are_refused() {
        let (text, tops) = (include_str!("../../models/body.toml"), BodyModel::shipped().slices);
        let text = text.replacen(&format!("top = {:.3}", tops[2].top), "top = 0.1", 1);
        let message = BodyModel::parse(&text).unwrap_err().to_string();
        assert!(
            message.contains(&format!("a top above {}", tops[1].top)) && message.contains("0.1"),
            "{message}"
        );
    }
}
