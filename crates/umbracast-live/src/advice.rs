//! Decisions as they change, for programs that carry them out.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use umbracast::decide::Action;
use umbracast::radio::Surface;
use umbracast_io::rows::DecisionRow;

/// Something else to do about one device than in the frame before.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// The decision.
    pub decision: DecisionRow,
    /// The name of the access point that serves the device.
    pub serving: String,
    /// The name of the one that a change goes to.
    pub target: Option<String>,
}

/// What was to be done about every device in the frame before, by track.
#[derive(Debug, Clone, Default)]
pub struct Advised(BTreeMap<u64, (Action, Option<u32>, Option<Surface>)>);

impl Advised {
    /// The decisions that are not those of the frame before. A device stays where it is before its first frame.
    pub fn changes(&mut self, decisions: &[DecisionRow], access_points: &[String]) -> Vec<Advice> {
        let name = |index: u32| access_points.get(index as usize).cloned().unwrap_or_default();
        let mut now = BTreeMap::new();
        let mut changes = Vec::new();
        for &decision in decisions {
            let advice = (decision.action, decision.target, decision.surface);
            if self.0.get(&decision.track).copied().unwrap_or_default() != advice {
                let (serving, target) = (name(decision.serving), decision.target.map(name));
                changes.push(Advice { decision, serving, target });
            }
            now.insert(decision.track, advice);
        }
        self.0 = now;
        changes
    }
}

impl Advice {
    /// As events are sent.
    pub fn json(&self) -> Value {
        let Self { decision, serving, target } = self;
        json!({
            "event": "decision",
            "track": decision.track,
            "frame": decision.frame,
            "time_ns": decision.time_ns,
            "serving": serving,
            "action": decision.action.name(),
            "target": target,
            "surface": decision.surface.map(|surface| surface.to_string()),
            "deadline_s": decision.deadline_s,
            "saved_s": decision.saved_s,
            "p_out": decision.p_out,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_advised_when_there_is_something_else_to_do() {
        let names = ["east".to_owned(), "west".to_owned()];
        let mut advised = Advised::default();
        let stay = DecisionRow { track: 3, ..DecisionRow::default() };
        let prepare = DecisionRow { action: Action::Prepare, target: Some(1), ..stay };
        let leave = DecisionRow { action: Action::HandOver, ..prepare };
        let frames = [stay, prepare, prepare, leave, stay];
        let said: Vec<Vec<&str>> = frames
            .iter()
            .map(|row| advised.changes(&[*row], &names).iter().map(|a| a.decision.action.name()).collect())
            .collect();
        assert_eq!(said, [vec![], vec!["prepare"], vec![], vec!["hand-over"], vec!["stay"]]);
        let told = advised.changes(&[leave], &names)[0].json();
        assert_eq!((&told["serving"], &told["target"]), (&"east".into(), &"west".into()));
        assert!(advised.changes(&[], &names).is_empty(), "who is gone needs nothing");
        assert_eq!(advised.changes(&[leave], &names).len(), 1, "and begins anew");
    }
}
