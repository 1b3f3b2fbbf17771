//! What is not as it should be now. What was counted before somebody looked is history: it is in the JSON, and no trouble.

use std::collections::BTreeMap;

use serde_json::Value;
use umbracast::Health;

use super::{Hall, Node};

/// The stages that every hall needs, behind its front ends.
const STAGES: [(&str, &str); 3] =
    [("track", "nobody is followed"), ("forecast", "nothing is forecast"), ("cast", "nobody warns")];
/// Who does one of these says once a second how it goes. Controllers and displays are other programs.
const SPEAKERS: [&str; 7] = ["sensor", "track", "forecast", "cast", "record", "serve", "router"];
/// Counters of [`Health`] that tell what was done, and nothing that was skipped.
const NOTHING_SKIPPED: [&str; 3] = ["frames_with_fewer_samples", "sensors_moved", "clocks_corrected"];
/// Clocks that are farther apart are not set by the same time: frames meet by time, and wait a tenth of a second. Less than
/// this a word may be late on a busy host.
const CLOCKS_APART_S: f64 = 0.5;
/// Who has no frame in so long, seconds, while others have some, hangs.
const HANGS_S: f64 = 0.9;

impl Hall {
    /// What is wrong with the hall: stages and front ends that no node runs, and frames that do not come.
    pub fn troubles(&self) -> Vec<String> {
        let runs = |role: &str| self.nodes.values().any(|node| node.roles.contains(role));
        // A router that stands alone is no hall.
        if !STAGES.iter().any(|(stage, _)| runs(stage)) && !runs("sensor") {
            return Vec::new();
        }
        let missing = STAGES.iter().filter(|(stage, _)| !runs(stage));
        let mut troubles: Vec<String> =
            missing.map(|(stage, so)| format!("no node runs {stage}: {so}")).collect();
        // Lists of objects come from perception that is none of our front ends.
        let fed_otherwise = !runs("sensor") && self.nodes.values().any(|node| node.new_frames() > Some(0));
        let served = |name: &&String| self.nodes.values().any(|node| node.sensors.contains(*name));
        if !fed_otherwise {
            let unserved = self.sensors.iter().filter(|name| !served(name));
            troubles.extend(unserved.map(|name| format!("no front end of sensor {name}")));
        }
        let frames: Vec<u64> = self.nodes.values().filter_map(Node::new_frames).collect();
        if !frames.is_empty() && frames.iter().all(|&frames| frames == 0) {
            troubles.push("no frames come".to_owned());
        }
        troubles
    }

    /// What is wrong with one of its nodes.
    pub fn troubles_of(&self, node: &Node) -> Vec<String> {
        let Some(health) = &node.health else {
            let speaks = node.roles.iter().any(|role| SPEAKERS.contains(&role.as_str()));
            return speaks.then(|| "says nothing: it hangs".to_owned()).into_iter().collect();
        };
        if node.roles.is_empty() {
            return vec!["gone".to_owned()];
        }
        let mut troubles = health.troubles.clone();
        troubles.extend(node.counted());
        if let Some(ahead_s) = node.ahead_s.map(|ahead_s| ahead_s - self.clock_s()) {
            let way = if ahead_s > 0.0 { "ahead of" } else { "behind" };
            let told = format!("its clock is {:.1} s {way} most", ahead_s.abs());
            troubles.extend((ahead_s.abs() > CLOCKS_APART_S).then_some(told));
        }
        if self.site().is_some_and(|site| site != health.site) && !node.roles.contains("router") {
            troubles.push("another site than most".to_owned());
        }
        if node.new_frames() == Some(0) && self.nodes.values().any(|other| other.new_frames() > Some(0)) {
            troubles.push("no frames while others have some: it hangs, or nothing reaches it".to_owned());
        }
        let others_know =
            self.nodes.values().filter_map(|other| other.health.as_ref()).any(|other| other.empty_hall);
        if node.roles.contains("sensor") && !health.empty_hall && others_know {
            troubles.push("without the empty hall, which another node has".to_owned());
        }
        troubles
    }

    /// Whether nothing is wrong.
    pub fn is_well(&self) -> bool {
        self.troubles().is_empty() && self.nodes.values().all(|node| self.troubles_of(node).is_empty())
    }

    /// The site of most of its nodes; of as many, the one with the least number. A router works for any site.
    fn site(&self) -> Option<u64> {
        let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
        let of_hall = self.nodes.values().filter(|node| !node.roles.contains("router"));
        for health in of_hall.filter_map(|node| node.health.as_ref()) {
            *counts.entry(health.site).or_default() += 1;
        }
        counts.into_iter().rev().max_by_key(|&(_, count)| count).map(|(site, _)| site)
    }

    /// The clock that most agree with, as seconds that it is ahead of the host that listens, whose own is one of them.
    fn clock_s(&self) -> f64 {
        let clocks: Vec<f64> =
            std::iter::once(0.0).chain(self.nodes.values().filter_map(|node| node.ahead_s)).collect();
        let agree = |one: &f64| clocks.iter().filter(|other| (*other - one).abs() <= CLOCKS_APART_S).count();
        // Of as many, the one of the host that listens: it is the last here, and the last greatest is taken.
        clocks.iter().rev().copied().max_by_key(agree).unwrap_or(0.0)
    }
}

impl Node {
    /// Frames between its first and its last word; none where it did not speak twice, or does no frames.
    fn new_frames(&self) -> Option<u64> {
        let (first, now) = (self.first.as_ref()?, self.health.as_ref()?);
        let works = self.roles.iter().any(|role| role != "router" && SPEAKERS.contains(&role.as_str()));
        (works && now.up_s - first.up_s > HANGS_S).then(|| now.frames.saturating_sub(first.frames))
    }

    /// What it lost between its first and its last word.
    fn counted(&self) -> Vec<String> {
        let (Some(first), Some(now)) = (&self.first, &self.health) else { return Vec::new() };
        let own = [
            (first.frames_skipped, now.frames_skipped, "frames skipped"),
            (first.frames_incomplete, now.frames_incomplete, "frames without a front end"),
            (first.messages_late, now.messages_late, "messages late"),
            (first.messages_broken, now.messages_broken, "messages not understood"),
        ];
        let own = own.into_iter().map(|(first, now, what)| (now.saturating_sub(first), what.to_owned()));
        let (first, now) = (counts(&first.health), counts(&now.health));
        let skipped = now.into_iter().map(|(name, now)| {
            let before = first.get(&name).copied().unwrap_or(0);
            (now.saturating_sub(before), name.replace('_', " "))
        });
        own.chain(skipped)
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

/// Every counter of what was skipped, by name.
fn counts(health: &Health) -> BTreeMap<String, u64> {
    let Ok(Value::Object(fields)) = serde_json::to_value(health) else { return BTreeMap::new() };
    let skipped = fields.into_iter().filter(|(name, _)| !NOTHING_SKIPPED.contains(&name.as_str()));
    skipped.filter_map(|(name, count)| Some((name, count.as_u64()?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::{Word, halls, json, text};
    use crate::share::site_number;
    use umbracast::Config;
    use umbracast_io::nodes::NodeHealth;

    const SECOND_NS: i64 = 1_000_000_000;

    /// A word of a node that does ten frames a second.
    fn word(key: &str, second: i64, change: impl Fn(&mut NodeHealth)) -> Word {
        let mut health = NodeHealth {
            time_ns: second * SECOND_NS,
            up_s: second as f64,
            frames: second as u64 * 10,
            ..NodeHealth::default()
        };
        change(&mut health);
        (key.to_owned(), health, second * SECOND_NS)
    }

    /// A hall whose nodes have spoken twice, after `change` by the second.
    fn hall(nodes: &[(&str, &[&str])], change: impl Fn(&str, i64, &mut NodeHealth)) -> Hall {
        let tokens: Vec<String> = nodes
            .iter()
            .flat_map(|(id, roles)| roles.iter().map(move |role| format!("umbracast/lab/node/{role}/{id}")))
            .collect();
        let id = |id: &str| id.rsplit('.').next().unwrap_or_default().to_owned();
        let words = nodes.iter().flat_map(|(name, roles)| {
            let key = format!("umbracast/lab/health/{}/{}", roles[0], id(name));
            [10, 12].map(|second| word(&key, second, |health| change(&id(name), second, health)))
        });
        let mut hall = halls(&tokens, words.collect()).remove("lab").unwrap();
        hall.sensors = vec!["east".to_owned(), "west".to_owned()];
        hall
    }

    const WHOLE: [(&str, &[&str]); 4] =
        [("east.e", &["sensor"]), ("west.w", &["sensor"]), ("t", &["track", "forecast"]), ("c", &["cast"])];

    fn of<'a>(hall: &'a Hall, id: &str) -> &'a Node {
        &hall.nodes[id]
    }

    #[test]
    fn a_hall_whose_stages_all_work_is_well_whatever_was_counted_before() {
        let hall = hall(&WHOLE, |_, second, health| {
            (health.frames_skipped, health.health.packets_late) = (7, 12);
            health.health.frames_with_fewer_samples = second as u64; // No input that was skipped.
        });
        assert!(hall.is_well(), "{:?} {}", hall.troubles(), text(&[("lab".to_owned(), hall.clone())].into()));
        let json = json(&[("lab".to_owned(), hall)].into());
        assert_eq!(
            (&json["lab"]["troubles"], &json["lab"]["nodes"]["t"]["frames_skipped"]),
            (&serde_json::json!([]), &7.into())
        );
    }

    #[test]
    fn what_is_lost_while_somebody_looks_is_named_and_then_no_more() {
        let hall = hall(&WHOLE, |id, second, health| {
            if id == "t" {
                health.frames_skipped = second as u64;
                health.health.packets_late = 3 * second as u64;
            }
        });
        assert_eq!(hall.troubles_of(of(&hall, "t")), ["2 frames skipped", "6 packets late"]);
        assert!(hall.troubles_of(of(&hall, "c")).is_empty() && !hall.is_well());
    }

    #[test]
    fn a_stage_and_a_front_end_that_nobody_runs_are_named() {
        let hall = hall(&WHOLE[..1], |_, _, _| ());
        assert_eq!(
            hall.troubles(),
            [
                "no node runs track: nobody is followed",
                "no node runs forecast: nothing is forecast",
                "no node runs cast: nobody warns",
                "no front end of sensor west"
            ]
        );
        let text = text(&[("lab".to_owned(), hall)].into());
        assert!(text.contains("lab          no node runs cast: nobody warns"), "{text}");
    }

    #[test]
    fn a_hall_of_lists_of_objects_needs_no_front_end() {
        assert_eq!(hall(&WHOLE[2..], |_, _, _| ()).troubles(), Vec::<String>::new());
    }

    #[test]
    fn a_node_that_hangs_is_named_as_long_as_it_is_seen_and_then_its_stage_is_missing() {
        // It tells its health and does nothing.
        let stuck = hall(&WHOLE, |id, _, health| {
            if id == "c" {
                health.frames = 55;
            }
        });
        assert!(stuck.troubles_of(of(&stuck, "c"))[0].starts_with("no frames while others have some"));
        // It is stopped: its token is there for some seconds, and then it is gone.
        let mut stopped = hall(&WHOLE, |_, _, _| ());
        stopped.nodes.insert("c".to_owned(), Node { health: None, first: None, ..of(&stuck, "c").clone() });
        assert_eq!(stopped.troubles_of(of(&stopped, "c")), ["says nothing: it hangs"]);
        stopped.nodes.remove("c");
        assert_eq!(stopped.troubles(), ["no node runs cast: nobody warns"]);
        // It went while it was looked at.
        let mut gone = hall(&WHOLE, |_, _, _| ());
        gone.nodes.get_mut("c").unwrap().roles.clear();
        assert_eq!(gone.troubles_of(of(&gone, "c")), ["gone"]);
    }

    #[test]
    fn a_hall_without_frames_is_not_well() {
        let hall = hall(&WHOLE, |_, _, health| health.frames = 0);
        assert_eq!(hall.troubles(), ["no frames come"]);
    }

    #[test]
    fn a_clock_that_is_off_is_named_and_the_others_are_not() {
        let hall = hall(&WHOLE, |id, _, health| {
            if id == "w" {
                health.time_ns += 3600 * SECOND_NS;
            }
        });
        assert_eq!(hall.troubles_of(of(&hall, "w")), ["its clock is 3600.0 s ahead of most"]);
        assert!(["e", "t", "c"].iter().all(|id| hall.troubles_of(of(&hall, id)).is_empty()));
        let alone = super::tests::hall(&WHOLE[2..3], |_, _, health| health.time_ns -= 2 * SECOND_NS);
        assert_eq!(
            alone.troubles_of(of(&alone, "t")),
            ["its clock is 2.0 s behind most"],
            "than that of who listens"
        );
    }

    #[test]
    fn a_front_end_without_the_empty_hall_is_named_where_another_node_has_it() {
        let hall = |known: &'static [&str]| {
            super::tests::hall(&WHOLE, |id, _, health| health.empty_hall = known.contains(&id))
        };
        let one = hall(&["t", "e"]);
        assert_eq!(one.troubles_of(of(&one, "w")), ["without the empty hall, which another node has"]);
        assert!(one.troubles_of(of(&one, "e")).is_empty() && one.troubles_of(of(&one, "c")).is_empty());
        assert!(hall(&[]).is_well(), "nobody has one: it is learned");
    }

    #[test]
    fn what_a_node_says_of_itself_is_printed_as_it_says_it() {
        let hall = hall(&WHOLE, |id, _, health| {
            if id == "t" {
                health.troubles = vec!["3 messages of east out of bounds".to_owned()];
            }
        });
        assert_eq!(hall.troubles_of(of(&hall, "t")), ["3 messages of east out of bounds"]);
    }

    #[test]
    fn a_node_with_another_site_file_than_the_rest_is_told() {
        let mut other = Config::default().site;
        other.access_points[0].position_m[2] += 0.01;
        let numbers = [site_number(&Config::default().site), site_number(&other)];
        let hall = hall(&WHOLE, |id, _, health| health.site = numbers[usize::from(id == "w")]);
        let troubles = |id: &str| hall.troubles_of(of(&hall, id)).len();
        assert_eq!(["e", "w", "t", "c"].map(troubles), [0, 1, 0, 0]);
    }

    #[test]
    fn nodes_are_listed_with_their_load() {
        let hall = hall(&WHOLE, |_, second, health| health.cpu_s = second as f64 / 2.0);
        assert_eq!(of(&hall, "t").cores(), Some(0.5), "between its words");
        let text = text(&[("lab".to_owned(), hall)].into());
        assert_eq!(text.lines().count(), 5);
        assert!(text.contains("forecast,track"), "{text}");
    }
}
