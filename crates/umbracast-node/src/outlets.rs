//! Where the results of a [`Chain`](crate::chain::Chain) leave.

use umbracast::{Config, Error};
use umbracast_io::wire;

use crate::chain::{Made, Row};
use crate::hall::{Hall, Outlet, Urgency};

/// Where results leave.
pub(crate) struct Outlets {
    priors: Option<Outlet>,
    pub(crate) state: Option<Outlet>,
    detections: Option<Outlet>,
    followed: Option<Outlet>,
    links: Option<Outlet>,
    /// Where the site has a radio.
    losses: Option<Outlet>,
    bindings: Option<Outlet>,
    /// Where it says what changes cost.
    decisions: Option<Outlet>,
    /// All of it as JSON, for who listens.
    json: Option<Outlet>,
    /// Of each access point.
    warnings: Vec<(String, Outlet)>,
    access_points: Vec<String>,
    tracker: String,
}

impl Outlets {
    pub(crate) fn new(hall: &Hall, config: &Config, row: Row) -> Result<Self, Error> {
        let keys = hall.keys();
        let outlet = |wanted: bool, key: &str, urgency| {
            wanted.then(|| hall.outlet(&keys.of(key), urgency)).transpose()
        };
        let access_points: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
        let warnings = access_points.iter().filter(|_| row.cast).map(|name| {
            let chunk = crate::network::chunk(name).map_err(|e| e.within("site.access_points"))?;
            Ok((name.clone(), hall.outlet(&keys.warnings(&chunk), Urgency::Warning)?))
        });
        let tracks = if row.forecast { "tracks" } else { "followed" };
        Ok(Self {
            priors: outlet(row.track, "priors", Urgency::Result)?,
            state: outlet(row.track, "state", Urgency::Rest)?,
            detections: outlet(row.track, "detections", Urgency::Rest)?,
            followed: outlet(row.track || row.forecast, tracks, Urgency::Stage)?,
            links: outlet(row.cast, "links", Urgency::Result)?,
            losses: outlet(row.cast && config.site.has_radio(), "losses", Urgency::Result)?,
            bindings: outlet(row.cast && config.site.has_radio(), "bindings", Urgency::Result)?,
            decisions: outlet(row.cast && config.site.has_decisions(), "decisions", Urgency::Warning)?,
            json: outlet(row.cast, "json", Urgency::Result)?,
            warnings: warnings.collect::<Result<_, Error>>()?,
            access_points,
            tracker: hall.id(),
        })
    }

    /// Warnings and decisions first, then what other stages wait for, then what is looked at.
    pub(crate) fn put(&self, mut made: Made) {
        let term = made.term;
        for warning in &mut made.warnings {
            warning.term = term;
            if let Some((_, outlet)) = self.warnings.iter().find(|(name, _)| *name == warning.access_point) {
                outlet.put(warning);
            }
        }
        let names = &self.access_points;
        if let (Some(outlet), Some(_)) = (&self.decisions, &made.links) {
            outlet.put_rows(term, wire::encode(made.time_ns, made.frame, &made.decisions, names));
        }
        if let (Some(outlet), Some(followed)) = (&self.followed, &mut made.followed) {
            followed.term = term;
            outlet.put(followed);
        }
        let numbers = made.digest();
        if let (Some(outlet), Some(priors)) = (&self.priors, &mut made.priors) {
            (priors.tracker, priors.term, priors.numbers) = (self.tracker.clone(), term, numbers);
            outlet.put(priors);
        }
        if let (Some(outlet), Some(links)) = (&self.links, &made.links) {
            outlet.put_rows(term, wire::encode(made.time_ns, made.frame, links, names));
            if let Some(outlet) = &self.losses {
                outlet.put_rows(term, wire::encode(made.time_ns, made.frame, &made.losses, names));
            }
            if let Some(outlet) = &self.bindings {
                outlet.put_rows(term, wire::encode(made.time_ns, made.frame, &made.bindings, names));
            }
        }
        if let (Some(outlet), Some(links)) = (&self.json, &made.links)
            && outlet.is_heard()
        {
            let frame = serde_json::json!({
                "frame": made.frame,
                "time_ns": made.time_ns,
                "term": term,
                "tracks": wire::Json::whole(&made.tracks, names),
                "blockages": wire::Json::whole(links, names),
                "losses": wire::Json::whole(&made.losses, names),
                "decisions": wire::Json::whole(&made.decisions, names),
            });
            outlet.put_bytes(frame.to_string().into_bytes());
        }
        if let (Some(outlet), Some(detections)) = (&self.detections, &made.detections) {
            outlet.put_rows(term, wire::encode(made.time_ns, made.frame, detections, names));
        }
    }
}
