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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A node's work.
    Node(Role),
    /// Another perception, which gives lists of objects.
    Objects,
    /// Shows the hall to ROS 2 in this domain, and brings what drivers publish there.
    Ros2(u32),
}

/// A user's works: a word or a list of them, `"sensor"`, `["hall_a/track", "hall_a/forecast"]`, `"ros2:0"`.
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
        match self.kind {
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
                let (writes, reads, asks, answers) = of_role(role);
                let health = format!("health/{}/*", role.name());
                let token = format!("node/{}/*", role.name());
                let mut writes = keys(writes);
                // A display only looks: it writes nothing at all.
                let speaks = role != Role::Display;
                writes.extend(keys(&[&health]).into_iter().filter(|_| speaks));
                let asks = [settings, asks].concat();
                Rights {
                    writes,
                    reads: keys(reads),
                    asks: keys(&asks),
                    answers: keys(answers),
                    tokens: keys(&[&token]),
                    ..rights
                }
            }
            Kind::Objects => Rights { writes: keys(&["objects/*"]), asks: keys(&["config/site"]), ..rights },
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

/// Keys that a role writes, reads, asks and answers, by their ends; `config/**` is asked by all.
fn of_role(role: Role) -> (Ends, Ends, Ends, Ends) {
    match role {
        Role::Sensor => (&["sensor/*/foreground", "sensor/*/health"], &["priors"], &[], &["config/**"]),
        Role::Track => (
            &["priors", "followed", "state", "detections"],
            &["sensor/*/foreground", "sensor/*/health", "objects/*", "state", "priors", "followed"],
            &["state"],
            &["state", "config/**"],
        ),
        Role::Forecast => (&["tracks"], &["followed", "state"], &["state"], &["state", "config/**"]),
        Role::Cast => (&["links", "warnings/*"], &["tracks", "state"], &["state"], &["state", "config/**"]),
        Role::Record => (&[], &["**"], &["state"], &["state", "config/**"]),
        Role::Serve => (&[], &["**"], &["state"], &["state", "config/**"]),
        Role::Display => (&[], &["**"], &[], &[]),
        Role::Controller => (&[], &["links", "warnings/*"], &[], &[]),
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
        let kind = match (word, word.strip_prefix("ros2:")) {
            ("objects", _) => Kind::Objects,
            (_, Some(domain)) => Kind::Ros2(domain.parse().map_err(|_| {
                Error::new(format!("expected a number of a domain behind ros2:, found {domain:?}"))
            })?),
            _ => Kind::Node(word.parse().map_err(|error: Error| {
                Error::new(format!("{error}; or objects, ros2:DOMAIN; with a hall before it as HALL/..."))
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
        assert!(!gets("radio", "umbracast/other/warnings/door"), "another hall");
        assert!(put("server", "umbracast/lab/state") && put("server", "umbracast/lab/warnings/door"));
        assert!(!put("server", "umbracast/lab/tracks"), "no forecast");
        assert!(!put("edge", "umbracast/lab/**") && !gets("edge", "**"), "not by a pattern either");
    }

    #[test]
    fn presence_is_announced_under_the_own_role_alone() {
        let rules = access_control(&users("edge = \"sensor\""));
        let token = |key| passes(&rules, "edge", "ingress", "liveliness_token", key);
        assert!(token("umbracast/lab/node/sensor/1") && !token("umbracast/lab/node/track/1"));
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
