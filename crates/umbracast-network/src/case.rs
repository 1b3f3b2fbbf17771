//! What a line of the tables depends on besides the policy, and the configuration that it means.

use umbracast::site::{AccessPoint, Handover, LossModel, Radio};
use umbracast::{Config, Error};

use crate::policy::Policy;
use crate::truth::TruthModel;

/// One network in one radio. What is `None` is as the site says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// People in a scene, each with a device.
    pub people: usize,
    /// The first so many access points of the site.
    pub access_points: usize,
    /// Their carrier.
    pub carrier_ghz: Option<f64>,
    /// How much a link can lose.
    pub margin_db: Option<f64>,
    /// How long nothing is sent while a device changes.
    pub interruption_ms: Option<f64>,
    /// The model of those who forecast.
    pub predictor: Option<LossModel>,
    /// The model of the truth.
    pub truth: TruthModel,
}

/// Loss models as site files and the command name them.
pub const PREDICTORS: [(&str, LossModel); 6] = [
    ("kirchhoff", LossModel::Kirchhoff),
    ("model-b", LossModel::ModelB),
    ("model-b-adult", LossModel::ModelBAdult),
    ("model-b-body", LossModel::ModelBBody),
    ("knife-edges", LossModel::KnifeEdges),
    ("three-edges", LossModel::ThreeEdges),
];

/// Access points of a site that has no radios: at the walls of the default hall, then in its corners.
const PLACES_M: [[f64; 3]; 8] = [
    [14.0, 0.0, 2.0],
    [0.0, 14.0, 3.0],
    [-14.0, 0.0, 3.0],
    [0.0, -14.0, 3.0],
    [10.5, 10.5, 3.0],
    [-10.5, -10.5, 3.0],
    [-10.5, 10.5, 3.0],
    [10.5, -10.5, 3.0],
];
/// A device in the hand is so far ahead of the body's axis.
const IN_HAND_M: f64 = 0.3;

/// The lists whose every combination is a case.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// See [`Case`].
    pub people: usize,
    /// See [`Case`].
    pub access_points: Vec<usize>,
    /// See [`Case`]; empty as the site says, and so below.
    pub carriers_ghz: Vec<f64>,
    /// See [`Case`].
    pub margins_db: Vec<f64>,
    /// See [`Case`].
    pub interruptions_ms: Vec<f64>,
    /// See [`Case`].
    pub predictors: Vec<LossModel>,
    /// See [`Case`].
    pub truths: Vec<TruthModel>,
}

impl Sweep {
    /// Every combination. Those that differ in truth and interruption alone, which forecasts do not depend on, stand together.
    pub fn cases(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for &access_points in &self.access_points {
            for carrier_ghz in or_site(&self.carriers_ghz) {
                for margin_db in or_site(&self.margins_db) {
                    for predictor in or_site(&self.predictors) {
                        for interruption_ms in or_site(&self.interruptions_ms) {
                            cases.extend(self.truths.iter().map(|&truth| Case {
                                people: self.people,
                                access_points,
                                carrier_ghz,
                                margin_db,
                                interruption_ms,
                                predictor,
                                truth,
                            }));
                        }
                    }
                }
            }
        }
        cases
    }
}

fn or_site<T: Copy>(values: &[T]) -> Vec<Option<T>> {
    if values.is_empty() { vec![None] } else { values.iter().copied().map(Some).collect() }
}

/// The configuration with access points that have radios: those of the site, or else the usual places of the default hall. With
/// `in_hand` devices are ahead of their owners, whose bodies then count; without `beams` nothing reflects, and with them everything
/// is of concrete unless the site says otherwise.
pub fn with_radios(config: &Config, in_hand: bool, beams: bool) -> Config {
    let mut config = config.clone();
    let site = &mut config.site;
    if !site.has_radio() {
        let place = |(i, position_m): (usize, [f64; 3])| AccessPoint {
            name: format!("ap{i}"),
            position_m,
            radio: Some(Radio::default()),
        };
        site.access_points = PLACES_M.into_iter().enumerate().map(place).collect();
    }
    site.handover.get_or_insert_default();
    site.reflections = beams.then(|| site.reflections.unwrap_or_default());
    if in_hand && site.ue.forward_m == 0.0 && site.ue.left_m == 0.0 {
        site.ue.forward_m = IN_HAND_M;
    }
    config
}

impl Case {
    /// The configuration of this case in a hall [`with_radios`].
    ///
    /// # Errors
    /// More access points than the site has.
    pub fn config(&self, hall: &Config) -> Result<Config, Error> {
        let mut config = hall.clone();
        let site = &mut config.site;
        let (asked, found) = (self.access_points, site.access_points.len());
        if asked == 0 || asked > found {
            return Err(Error::new(format!("access points: expected 1 to {found}, found {asked}")));
        }
        site.access_points.truncate(asked);
        for radio in site.access_points.iter_mut().filter_map(|ap| ap.radio.as_mut()) {
            radio.carrier_ghz = self.carrier_ghz.unwrap_or(radio.carrier_ghz);
            radio.margin_db = self.margin_db.unwrap_or(radio.margin_db);
            radio.loss_model = self.predictor.unwrap_or(radio.loss_model);
        }
        let handover = site.handover.get_or_insert_default();
        handover.interruption_ms = self.interruption_ms.or(handover.interruption_ms);
        Ok(config)
    }

    /// Whether forecasts of both are the same.
    pub(crate) fn foresees_as(&self, other: &Self) -> bool {
        let of = |case: &Self| (case.access_points, case.carrier_ghz, case.margin_db, case.predictor);
        of(self) == of(other)
    }
}

/// What the network's procedures are under a policy.
pub(crate) fn handover_under(policy: Policy, handover: Handover) -> Handover {
    match policy {
        Policy::Commands => Handover { conditional: Some(false), ..handover },
        Policy::AtOnce => Handover { age_ms: Some(0.0), ..handover },
        _ => handover,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Mode;

    #[test]
    fn every_combination_is_a_case_and_says_what_it_changes() {
        let sweep = Sweep {
            people: 20,
            access_points: vec![2, 4],
            carriers_ghz: vec![28.0, 60.0],
            margins_db: Vec::new(),
            interruptions_ms: vec![3.0, 25.0, 70.0],
            predictors: vec![LossModel::ModelB],
            truths: TruthModel::ALL.to_vec(),
        };
        let cases = sweep.cases();
        assert_eq!(cases.len(), 2 * 2 * 3 * 3);
        assert!(
            cases[..9].iter().all(|case| case.foresees_as(&cases[0])) && !cases[9].foresees_as(&cases[0])
        );
        let hall = with_radios(&Config::for_mode(Mode::Default), true, false);
        assert_eq!((hall.site.access_points.len(), hall.site.ue.forward_m), (8, IN_HAND_M));
        let config = cases[9].config(&hall).unwrap();
        let radio = config.site.access_points[1].radio.unwrap();
        assert_eq!((config.site.access_points.len(), radio.carrier_ghz, radio.margin_db), (2, 60.0, 10.0));
        assert_eq!(
            (radio.loss_model, config.site.handover.unwrap().costs().interruption_s),
            (LossModel::ModelB, 0.003)
        );
        assert!(Case { access_points: 9, ..cases[0] }.config(&hall).is_err());
    }
}
