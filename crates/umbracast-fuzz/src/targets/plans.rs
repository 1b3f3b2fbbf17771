//! What the page of `plan` asks.

use std::sync::Mutex;

use umbracast_plan::{Plan, answer};

use super::Target;

/// A question that is understood is answered with finite shares of time, and a site file of the plan reads back as the plan;
/// any other is refused with a sentence.
pub const PLANS: Target = Target { name: "plans", corpus: questions, check: question };

fn questions() -> Vec<Vec<u8>> {
    let small = r#"{"site":{"name":"a","hall":{"length_m":8.0,"width_m":6.0,"height_m":4.0},"pillars":[{"position_m":[1.0,1.0],"radius_m":0.2}],"furniture":[{"position_m":[2.0,-1.0],"size_m":[1.0,0.5,0.8],"yaw_deg":20.0}],"sensors":[{"name":"w","model":"vlp-16","position_m":[-3.5,0.0,3.0],"rotation_deg":{"yaw":0.0,"pitch":15.0,"roll":0.0}}],"access_points":[{"name":"side","position_m":[3.5,0.0,2.0]}],"ue":{"forward_m":0.0,"left_m":0.0,"height_share":0.5},"simulation":{"dropout":0.02,"lost_after_s":{}}},"people":5,"step_m":1.0}"#;
    vec![small.as_bytes().to_vec()]
}

fn question(bytes: &[u8]) -> bool {
    let plan = Plan { file: None, text: Mutex::default() };
    let map = answer(&plan, "map", bytes);
    if let Err(error) = &map {
        assert!(!error.to_string().is_empty());
    }
    let shares = map.is_ok_and(|map| {
        assert!(!map.contains("null"), "a share that is no number");
        true
    });
    let saved = answer(&plan, "save", bytes);
    shares && saved.is_ok()
}
