//! Rights: what a user's role may read and write, as rules that Zenoh enforces where other nodes connect.
//!
//! A node with `roles` in its `[network]` enforces the rules on its connections: it accepts and sends only what the
//! role of the user, or of the certificate's name, allows. A user without a role gets nothing. Nodes that only
//! connect to others need no roles: they trust the other end by its certificate.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use umbracast::Error;

use crate::keys::chunk;
use crate::role::Role;

/// What somebody does, and for which hall.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Work {
    /// None: in every hall.
    pub hall: Option<String>,
    /// What.
    pub kind: Kind,
}

/// What somebody does on the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kind {
    /// A node's work.
    Node(Role),
    /// A front end's, of these sensors alone.
    Sensors(Vec<String>),
    /// Another perception, which gives lists of objects.
    Objects,
    /// Shows the hall to ROS 2 in this domain, and brings what drivers publish there.
    Ros2(u32),
}

/// A user's works: a word or a list of them, `"sensor:lidar_east"`, `["hall_a/track", "hall_a/forecast"]`, `"ros2:0"`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Works(pub Vec<Work>);

/// Keys of a hall, by their ends.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Rights {
    /// Sent by it.
    writes: Vec<String>,
    /// Sent to it.
    reads: Vec<String>,
    /// Queries that it may make.
    asks: Vec<String>,
    /// Queries that it may answer.
    answers: Vec<String>,
    /// What says that it is there.
    tokens: Vec<String>,
    /// Whose presence it sees.
    sees: Vec<String>,
}

/// Zenoh's `access_control` for users, or names of certificates, with their works.
pub fn access_control<'a>(users: impl IntoIterator<Item = (&'a String, &'a Works)>) -> Value {
    let (mut rules, mut subjects, mut policies) = (Vec::new(), Vec::new(), Vec::new());
    for (user, works) in users {
        let of_user = rules_of(user, &works.0.iter().map(Work::rights).fold(Rights::default(), Rights::with));
        let ids: Vec<Value> = of_user.iter().map(|rule| rule["id"].clone()).collect();
        // A name is a user's or a certificate's: two subjects, as both in one would ask for both.
        let [by_password, by_certificate] = [format!("{user} by password"), format!("{user} by certificate")];
        subjects.push(json!({ "id": by_password, "usernames": [user] }));
        subjects.push(json!({ "id": by_certificate, "cert_common_names": [user] }));
        policies.push(json!({ "rules": ids, "subjects": [by_password, by_certificate] }));
        rules.extend(of_user);
    }
    json!({
        "enabled": true,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    })
}

/// Rights as a door sees them: what comes in from the user, what goes out to it.
fn rules_of(user: &str, rights: &Rights) -> Vec<Value> {
    let Rights { writes, reads, asks, answers, tokens, sees } = rights;
    // Who listens and who can answer is told to those who send and ask, else they would send nothing; it holds no data.
    let everywhere = vec!["**".to_owned(), "@ros2_lv/**".to_owned()];
    let rule = |what: &str, flow: &str, messages: &[&str], keys: &[String]| {
        json!({
            "id": format!("{user} {what}"),
            "permission": "allow",
            "flows": [flow],
            "messages": messages,
            "key_exprs": keys,
        })
    };
    let rules = [
        (writes, rule("sends", "ingress", &["put", "delete"], writes)),
        (reads, rule("listens", "ingress", &["declare_subscriber"], reads)),
        (reads, rule("gets", "egress", &["put", "delete"], reads)),
        (asks, rule("asks", "ingress", &["query"], asks)),
        (asks, rule("gets answers", "egress", &["reply"], asks)),
        (answers, rule("answers", "ingress", &["declare_queryable", "reply"], answers)),
        (answers, rule("is asked", "egress", &["query"], answers)),
        (tokens, rule("is there", "ingress", &["liveliness_token"], tokens)),
        (sees, rule("looks", "ingress", &["liveliness_query", "declare_liveliness_subscriber"], sees)),
        (sees, rule("sees", "egress", &["liveliness_token"], sees)),
        (
            &everywhere,
            rule(
                "is told who listens",
                "egress",
                &[
                    "declare_subscriber",
                    "declare_queryable",
                    "liveliness_query",
                    "declare_liveliness_subscriber",
                ],
                &everywhere,
            ),
        ),
    ];
    rules.into_iter().filter(|(keys, _)| !keys.is_empty()).map(|(_, rule)| rule).collect()
}

impl Rights {
    /// With what a node of this role sends, hears, asks and answers; `keys` makes keys of their ends.
    fn of_node(self, role: Role, keys: impl Fn(&[&str]) -> Vec<String>) -> Self {
        let (writes, reads, asks, answers) = of_role(role);
        let health = format!("health/{}/*", role.name());
        let rights = Self {
            writes: keys(writes),
            reads: keys(reads),
            asks: keys(&[&["config/**"], asks].concat()),
            answers: keys(answers),
            ..self
        };
        match role {
            // A display only looks: it writes nothing and is not seen.
            Role::Display => Self { tokens: Vec::new(), ..rights },
            _ => Self { writes: [rights.writes, keys(&[&health])].concat(), ..rights },
        }
    }

    fn with(mut self, other: Self) -> Self {
        self.writes.extend(other.writes);
        self.reads.extend(other.reads);
        self.asks.extend(other.asks);
        self.answers.extend(other.answers);
        self.tokens.extend(other.tokens);
        self.sees.extend(other.sees);
        self
    }
}

impl Work {
    fn rights(&self) -> Rights {
        let hall = self.hall.as_deref().unwrap_or("*");
        let keys =
            |ends: &[&str]| ends.iter().map(|end| format!("umbracast/{hall}/{end}")).collect::<Vec<_>>();
        let all = || vec!["**".to_owned(), "@ros2_lv/**".to_owned()];
        let settings: &[&str] = &["config/**"];
        let rights = Rights { sees: keys(&["node/**"]), ..Rights::default() };
        match &self.kind {
            // It passes on what others send, ask and answer, in all halls.
            Kind::Node(Role::Router) => Rights {
                writes: all(),
                reads: all(),
                asks: all(),
                answers: all(),
                tokens: all(),
                sees: all(),
            },
            Kind::Node(role) => {
                let rights = Rights { tokens: keys(&[&format!("node/{}/*", role.name())]), ..rights };
                rights.of_node(*role, keys)
            }
            // As any front end, but for the names of the sensors. A front end of several is known by all their names.
            Kind::Sensors(names) => {
                let together = (names.len() > 1).then(|| names.join(","));
                let front_ends = names.iter().cloned().chain(together);
                let writes: Vec<String> =
                    front_ends.map(|name| format!("sensor/{name}/foreground")).collect();
                let tokens: Vec<String> = names.iter().map(|name| format!("node/sensor/{name}.$*")).collect();
                let of_all = rights.of_node(Role::Sensor, keys);
                let any = keys(&[ANY_FOREGROUND]);
                let others = of_all.writes.iter().filter(|key| !any.contains(key)).cloned();
                Rights {
                    writes: others.chain(writes.iter().flat_map(|end| keys(&[end]))).collect(),
                    tokens: tokens.iter().flat_map(|end| keys(&[end])).collect(),
                    ..of_all
                }
            }
            Kind::Objects => Rights {
                writes: keys(&["objects/*"]),
                reads: keys(&["json", "warnings/*"]),
                asks: keys(&["config/site"]),
                ..rights
            },
            Kind::Ros2(domain) => Rights {
                writes: vec![format!("{domain}/**")],
                reads: [keys(&["**"]), vec![format!("{domain}/**")]].concat(),
                asks: [keys(settings), vec![format!("{domain}/**")]].concat(),
                answers: vec![format!("{domain}/**")],
                tokens: vec![format!("@ros2_lv/{domain}/**")],
                sees: [rights.sees, vec![format!("@ros2_lv/{domain}/**")]].concat(),
            },
        }
    }
}

type Ends = &'static [&'static str];

const ANY_FOREGROUND: &str = "sensor/*/foreground";

/// Keys that a role writes, reads, asks and answers, by their ends; `config/**` is asked by all. Settings and the tracker's state
/// come from the stages alone, and the empty hall from the tracker: a front end hangs where anybody may reach it, and whoever
/// looks on has nothing to say.
fn of_role(role: Role) -> (Ends, Ends, Ends, Ends) {
    match role {
        Role::Sensor => (&[ANY_FOREGROUND], &["priors"], &[], &[]),
        Role::Track => (
            &["priors", "followed", "state", "detections"],
            &[ANY_FOREGROUND, "objects/*", "state", "priors", "followed"],
            &["state"],
            &["state", "config/**"],
        ),
        Role::Forecast => {
            (&["tracks"], &["followed", "state"], &["state"], &["state", "config/site", "config/weights"])
        }
        Role::Cast => (
            &["links", "losses", "bindings", "decisions", "warnings/*", "json"],
            &["tracks", "state", "reports/*"],
            &["state"],
            &["state", "config/site"],
        ),
        Role::Record => (&[], &["**"], &["state"], &[]),
        Role::Serve => (&["reports/*"], &["**"], &["state"], &[]),
        Role::Display => (&[], &["**"], &[], &[]),
        Role::Controller => {
            (&["reports/*"], &["links", "losses", "bindings", "decisions", "warnings/*", "json"], &[], &[])
        }
        Role::Router => (&[], &[], &[], &[]), // Of no hall: see above.
    }
}

impl std::str::FromStr for Work {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let (hall, word) = match text.rsplit_once('/') {
            Some((hall, word)) => (Some(chunk(hall)?), word),
            None => (None, text),
        };
        let kind = match word.split_once(':') {
            None if word == "objects" => Kind::Objects,
            Some(("sensor", names)) => Kind::Sensors(names.split(',').map(chunk).collect::<Result<_, _>>()?),
            Some(("ros2", domain)) => Kind::Ros2(domain.parse().map_err(|_| {
                Error::new(format!("expected a number of a domain behind ros2:, found {domain:?}"))
            })?),
            _ => Kind::Node(word.parse().map_err(|error: Error| {
                Error::new(format!(
                    "{error}; or sensor:NAME, objects, ros2:DOMAIN; with a hall before it as HALL/..."
                ))
            })?),
        };
        Ok(Self { hall, kind })
    }
}

impl<'de> Deserialize<'de> for Works {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Words {
            One(String),
            Many(Vec<String>),
        }
        let words = match Words::deserialize(deserializer)? {
            Words::One(word) => vec![word],
            Words::Many(words) => words,
        };
        let works =
            words.iter().map(|word| word.parse().map_err(D::Error::custom)).collect::<Result<_, _>>()?;
        Ok(Self(works))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn users(table: &str) -> BTreeMap<String, Works> {
        toml::from_str(table).unwrap()
    }

    /// Whether a message of a user passes the rules, as Zenoh decides: allowed by a key that includes it.
    fn passes(rules: &Value, user: &str, flow: &str, message: &str, key: &str) -> bool {
        let key = zenoh::key_expr::KeyExpr::try_from(key).unwrap();
        let of_user = |rule: &&Value| rule["id"].as_str().unwrap().starts_with(&format!("{user} "));
        let holds = |list: &Value, word: &str| list.as_array().unwrap().iter().any(|value| value == word);
        rules["rules"].as_array().unwrap().iter().filter(of_user).any(|rule| {
            let keys = rule["key_exprs"].as_array().unwrap().iter().map(|key| key.as_str().unwrap());
            let includes =
                |allowed: &str| zenoh::key_expr::KeyExpr::try_from(allowed).unwrap().includes(&key);
            holds(&rule["flows"], flow) && holds(&rule["messages"], message) && keys.into_iter().any(includes)
        })
    }

    #[test]
    fn a_role_does_its_own_work_and_no_others() {
        let users = users(
            "edge = \"sensor\"\nscreen = \"display\"\nradio = \"lab/controller\"\nserver = [\"track\", \"cast\"]",
        );
        let rules = access_control(&users);
        let put = |user: &str, key: &str| passes(&rules, user, "ingress", "put", key);
        let gets = |user: &str, key: &str| {
            passes(&rules, user, "ingress", "declare_subscriber", key)
                && passes(&rules, user, "egress", "put", key)
        };
        assert!(put("edge", "umbracast/lab/sensor/east/foreground") && gets("edge", "umbracast/lab/priors"));
        assert!(!put("edge", "umbracast/lab/tracks") && !gets("edge", "umbracast/lab/warnings/door"));
        assert!(gets("screen", "umbracast/lab/links") && gets("screen", "umbracast/lab/**"));
        for key in ["sensor/east/foreground", "links", "warnings/door", "state", "health/display/1"] {
            assert!(!put("screen", &format!("umbracast/lab/{key}")), "{key}");
        }
        assert!(gets("radio", "umbracast/lab/warnings/door") && !gets("radio", "umbracast/lab/tracks"));
        assert!(gets("radio", "umbracast/lab/decisions") && !put("radio", "umbracast/lab/decisions"));
        assert!(!gets("radio", "umbracast/other/warnings/door"), "another hall");
        assert!(put("server", "umbracast/lab/state") && put("server", "umbracast/lab/warnings/door"));
        assert!(!put("server", "umbracast/lab/tracks"), "no forecast");
        assert!(!put("edge", "umbracast/lab/**") && !gets("edge", "**"), "not by a pattern either");
    }

    #[test]
    fn presence_is_announced_under_the_own_role_alone_and_by_a_display_not_at_all() {
        let rules = access_control(&users("edge = \"sensor\"\nscreen = \"display\""));
        let token = |user, key| passes(&rules, user, "ingress", "liveliness_token", key);
        assert!(token("edge", "umbracast/lab/node/sensor/1") && !token("edge", "umbracast/lab/node/track/1"));
        assert!(!token("screen", "umbracast/lab/node/display/1"));
    }

    #[test]
    fn a_front_end_of_named_sensors_writes_the_foreground_of_no_other() {
        let rules = access_control(&users("edge = \"lab/sensor:lidar_east,door\""));
        let may =
            |message, key: &str| passes(&rules, "edge", "ingress", message, &format!("umbracast/lab/{key}"));
        for own in ["lidar_east", "door", "lidar_east,door"] {
            assert!(may("put", &format!("sensor/{own}/foreground")), "{own}");
        }
        for other in ["lidar_west", "lidar_east,lidar_west", "*", "lidar_east.1"] {
            assert!(!may("put", &format!("sensor/{other}/foreground")), "{other}");
        }
        assert!(may("liveliness_token", "node/sensor/door.1f") && may("put", "health/sensor/1f"));
        assert!(!may("liveliness_token", "node/sensor/lidar_west.1f"));
    }

    #[test]
    fn the_tracker_alone_answers_for_the_empty_hall_and_nobody_beside_the_stages_for_the_state() {
        let table =
            ["sensor", "sensor:lidar_east", "record", "serve", "display", "controller", "objects", "track"];
        for work in table {
            let rules = access_control(&users(&format!("user = \"{work}\"")));
            for key in ["config/site", "config/background/lidar_east", "config/weights", "state"] {
                let answers = ["declare_queryable", "reply"].map(|message| {
                    passes(&rules, "user", "ingress", message, &format!("umbracast/lab/{key}"))
                });
                assert_eq!(answers, [work == "track"; 2], "{work}: {key}");
            }
        }
    }

    #[test]
    fn whoever_is_not_named_has_no_rule() {
        let rules = access_control(&users("edge = \"sensor\""));
        assert_eq!(rules["default_permission"], "deny");
        let subjects = rules["subjects"].as_array().unwrap();
        assert!(
            subjects.iter().all(|s| s.get("usernames").is_some() || s.get("cert_common_names").is_some())
        );
    }

    #[test]
    fn every_rule_is_one_that_zenoh_takes() {
        let users = users(
            "a = [\"sensor\", \"router\"]\nb = [\"lab/objects\", \"ros2:3\", \"record\", \"serve\", \"forecast\"]",
        );
        let mut config = zenoh::Config::default();
        config.insert_json5("access_control", &access_control(&users).to_string()).unwrap();
    }

    #[test]
    fn works_that_do_not_exist_are_refused_with_those_that_do() {
        for (word, told) in [("pilot", "controller"), ("ros2:x", "domain"), ("a*/sensor", "name")] {
            let message = word.parse::<Work>().unwrap_err().to_string();
            assert!(message.contains(told), "{word}: {message}");
        }
        assert_eq!("lab/ros2:7".parse::<Work>().unwrap().kind, Kind::Ros2(7));
    }
}
