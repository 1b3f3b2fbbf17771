//! The kinds of bodies of the people in a scene.

use std::sync::Arc;

use rand::RngExt;
use umbracast::Error;

use super::kind::Kind;
use super::meshes::Meshes;
use super::recorded::Gait;
use super::walker::Walker;
use crate::crowd::Trajectory;
use crate::random::stream;

/// Shares of the kinds in a scene; who is left over is plain.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bodies {
    shares: Vec<(Kind, f64)>,
    gaits: Vec<Arc<Gait>>,
    meshes: Option<Arc<Meshes>>,
}

impl Bodies {
    /// Kinds with their shares, and how those walk who move as recorded: each as one of these.
    ///
    /// # Errors
    /// A share that is not above 0, or more than 1 together; [`Kind::CmuWalk`] without a gait.
    pub fn new(shares: Vec<(Kind, f64)>, gaits: impl IntoIterator<Item = Arc<Gait>>) -> Result<Self, Error> {
        let gaits: Vec<Arc<Gait>> = gaits.into_iter().collect();
        if let Some((kind, share)) = shares.iter().find(|(_, share)| share.is_nan() || *share <= 0.0) {
            let name = kind.name();
            return Err(Error::new(format!("share of {name}: expected more than 0, found {share}")));
        }
        let sum: f64 = shares.iter().map(|(_, share)| share).sum();
        // Shares written with a few digits may miss 1 by a hair.
        if sum > 1.0 + 1e-9 {
            return Err(Error::new(format!("shares of bodies: expected 1 at most together, found {sum}")));
        }
        if gaits.is_empty() && shares.iter().any(|(kind, _)| *kind == Kind::CmuWalk) {
            return Err(Error::new("cmu-walk: expected a motion capture (--gait FILE), found none"));
        }
        Ok(Self { shares, gaits, meshes: None })
    }

    /// The same kinds, with the bodies of these people.
    #[must_use]
    pub fn of(self, meshes: Arc<Meshes>) -> Self {
        Self { meshes: Some(meshes), ..self }
    }

    /// Nobody is special.
    pub fn is_plain(&self) -> bool {
        self.shares.is_empty() && self.meshes.is_none()
    }

    /// The body of a person, drawn from the person's own seed.
    pub fn walker(&self, trajectory: Trajectory, seed: u64) -> Walker {
        let kind = self.kind_of(seed);
        let walker = Walker::of_meshes(trajectory, seed, kind, self.meshes.as_deref());
        match self.gait_of(seed) {
            Some(gait) if kind == Kind::CmuWalk => walker.with_gait(Arc::clone(gait)),
            _ => walker,
        }
    }

    /// The recorded gait of a person, drawn from the person's own seed.
    fn gait_of(&self, seed: u64) -> Option<&Arc<Gait>> {
        match self.gaits.len() {
            0 => None,
            several => self.gaits.get(stream(seed, "gait", 0).random_range(0..several)),
        }
    }

    /// The kind of a person, drawn from the person's own seed.
    fn kind_of(&self, seed: u64) -> Kind {
        let drawn: f64 = stream(seed, "kind", 0).random();
        let mut sum = 0.0;
        let reached = |(_, share): &&(Kind, f64)| {
            sum += share;
            drawn < sum || sum > 1.0 - 1e-9
        };
        self.shares.iter().find(reached).map_or(Kind::Plain, |&(kind, _)| kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_drawn_by_share_and_who_is_left_over_is_plain() {
        let bodies = Bodies::new(vec![(Kind::Bag, 0.3), (Kind::Child, 0.2)], None).unwrap();
        let count = |kind: Kind| (0..2000).filter(|&seed| bodies.kind_of(seed) == kind).count();
        assert!((520..680).contains(&count(Kind::Bag)), "{}", count(Kind::Bag));
        assert!((330..470).contains(&count(Kind::Child)), "{}", count(Kind::Child));
        assert_eq!(count(Kind::Bag) + count(Kind::Child) + count(Kind::Plain), 2000);
        let all = Bodies::new(vec![(Kind::Phone, 1.0)], None).unwrap();
        assert!((0..2000).all(|seed| all.kind_of(seed) == Kind::Phone));
        assert_eq!(Bodies::default().kind_of(7), Kind::Plain);
    }

    #[test]
    fn each_person_walks_as_one_of_the_recorded_ones() {
        let gaits: Vec<Arc<Gait>> = (0..3).map(|_| Arc::new(Gait::default())).collect();
        let bodies = Bodies::new(vec![(Kind::CmuWalk, 1.0)], gaits.clone()).unwrap();
        for gait in &gaits {
            let walks_so = |&seed: &u64| Arc::ptr_eq(bodies.gait_of(seed).unwrap(), gait);
            let count = (0..900).filter(walks_so).count();
            assert!((240..360).contains(&count), "{count} of 900");
        }
        assert!(Bodies::default().gait_of(7).is_none());
    }

    #[test]
    fn shares_that_cannot_be_are_refused() {
        let refused = |shares: Vec<(Kind, f64)>| Bodies::new(shares, None).unwrap_err().to_string();
        assert!(refused(vec![(Kind::Bag, 0.0)]).contains("share of bag: expected more than 0, found 0"));
        assert!(refused(vec![(Kind::Bag, 0.6), (Kind::Child, 0.6)]).contains("1 at most together"));
        assert!(refused(vec![(Kind::CmuWalk, 0.5)]).contains("--gait FILE"));
        assert!("dog".parse::<Kind>().unwrap_err().to_string().contains("found \"dog\""));
        assert!(Kind::ALL.iter().all(|kind| kind.name().parse() == Ok(*kind)));
    }
}
