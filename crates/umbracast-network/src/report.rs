//! Rows as text for people, as CSV and as JSON.

use serde_json::{Value, json};
use umbracast_eval::score::bootstrap::{Bootstrap, Pooled, interval};

use crate::case::{Case, PREDICTORS};
use crate::device::Tally;
use crate::experiment::Row;
use crate::fades::{Compared, STEPS_AHEAD};
use crate::policy::{Policy, Tuning};
use crate::truth::TICK_S;

/// Ticks of a minute.
const MINUTE_TICKS: f64 = 6000.0;

/// What one policy comes to in one case, over all scenes. Intervals are 95 %, by bootstrap over scenes; `None` with fewer than five.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Share of the time in outage: the link out, the device changing, or lost.
    pub outage: Figure,
    /// Changes a device and minute.
    pub handovers: Figure,
    /// Beams pointed elsewhere, a device and minute.
    pub beams: Figure,
    /// Links given up, a device and minute.
    pub recoveries: Figure,
    /// Commands that the serving link did not carry, a device and minute.
    pub lost_commands: Figure,
    /// Changes back within a second, a device and minute.
    pub ping_pongs: Figure,
    /// Share of changes away from a link that would not have been out within 0.9 s.
    pub needless: Figure,
    /// The lowest 1 % of the mean rates of 100 ms lie below it; not known of the bounds.
    pub worst_bps: Option<f64>,
    /// The share of the gap in outage from A3 (60 and 40 ms) to the oracle that is closed; where both were played.
    pub gap_to_a3: Option<Figure>,
    /// The same from conditional handover (60 and 40 ms).
    pub gap_to_conditional: Option<Figure>,
}

/// A figure and its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// Of all scenes.
    pub value: f64,
    /// Low and high.
    pub interval: Option<[f64; 2]>,
}

/// Counts of scenes, which can be pooled.
#[derive(Debug, Clone, Copy, Default)]
struct Sums([u64; 8]);

impl Pooled for Sums {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + times * other.0[i]))
    }
}

impl Sums {
    fn of(tally: &Tally) -> Self {
        let Tally { ticks, handovers, ping_pongs, needless, lost_commands, recoveries, beams, .. } = *tally;
        let counts = [ticks, 0, handovers, ping_pongs, needless, lost_commands, recoveries, beams];
        let mut sums = counts.map(|count| count as u64);
        sums[1] = tally.out_ms();
        Self(sums)
    }

    fn share(&self, of: usize, among: usize) -> Option<f64> {
        Some(self.0[of] as f64 / self.0[among].max(1) as f64)
    }
}

/// Outage of three policies in the same scenes.
#[derive(Debug, Clone, Copy, Default)]
struct Gap([u64; 3]);

impl Pooled for Gap {
    fn plus(&self, other: &Self, times: u64) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + times * other.0[i]))
    }
}

impl Gap {
    fn closed(&self) -> Option<f64> {
        let [from, with, best] = self.0.map(|out_ms| out_ms as f64);
        (from != best).then(|| (from - with) / (from - best))
    }
}

/// The figures of a row; `rows` are all of the run.
pub fn figures(row: &Row, rows: &[Row]) -> Figures {
    let bootstrap = Bootstrap::new(&(0..row.scenes.len() as u64).collect::<Vec<_>>());
    let scenes: Vec<Sums> = row.scenes.iter().map(Sums::of).collect();
    let resampled = bootstrap.resampled(&scenes);
    let all = scenes.iter().fold(Sums::default(), |all, scene| all.plus(scene, 1));
    let figure = |score: &dyn Fn(&Sums) -> Option<f64>| Figure {
        value: score(&all).unwrap_or_default(),
        interval: interval(&resampled, score),
    };
    let a_minute =
        |count: usize| figure(&|sums: &Sums| sums.share(count, 0).map(|share| share * MINUTE_TICKS));
    let out_ms = |policy: Policy| {
        let row = rows.iter().find(|other| other.case == row.case && other.policy == policy)?;
        Some(row.scenes.iter().map(Tally::out_ms).collect::<Vec<_>>())
    };
    let gap = |from: Policy| {
        let (from, best) = (out_ms(from)?, out_ms(Policy::Oracle)?);
        let with = row.scenes.iter().map(Tally::out_ms);
        let scenes: Vec<Gap> = from
            .into_iter()
            .zip(with)
            .zip(best)
            .map(|((from, with), best)| Gap([from, with, best]))
            .collect();
        let all = scenes.iter().fold(Gap::default(), |all, scene| all.plus(scene, 1));
        Some(Figure { value: all.closed()?, interval: interval(&bootstrap.resampled(&scenes), Gap::closed) })
    };
    let mut rates: Vec<f32> = row.scenes.iter().flat_map(|tally| tally.rates_bps.iter().copied()).collect();
    rates.sort_by(f32::total_cmp);
    Figures {
        outage: figure(&|sums| sums.share(1, 0).map(|share| share / (TICK_S * 1e3))),
        handovers: a_minute(2),
        beams: a_minute(7),
        ping_pongs: a_minute(3),
        needless: figure(&|sums| sums.share(4, 2)),
        lost_commands: a_minute(5),
        recoveries: a_minute(6),
        worst_bps: rates.get(rates.len() / 100).map(|bps| f64::from(*bps)),
        gap_to_a3: gap(Policy::A3(Tuning::Fast)),
        gap_to_conditional: gap(Policy::Conditional(Tuning::Fast)),
    }
}

/// A table for each case.
pub fn to_text(rows: &[Row]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        if i == 0 || rows[i - 1].case != row.case {
            text += &format!("{}{}\n", if i == 0 { "" } else { "\n" }, name_of(&row.case));
            text += "policy                  outage %               handovers  beams  lost commands  recoveries  ping-pongs  needless  \
                     worst 1 %  gap to A3 closed     to conditional\n";
        }
        let of = figures(row, rows);
        let gap = |figure: Option<Figure>| figure.map_or("-".to_owned(), |figure| told(figure, 1.0));
        text += &format!(
            "{:22}  {:21}  {:9.1}  {:5.1}  {:13.2}  {:10.2}  {:10.2}  {:8.2}  {:>9}  {:19}  {}\n",
            row.policy.name(),
            told(of.outage, 100.0),
            of.handovers.value,
            of.beams.value,
            of.lost_commands.value,
            of.recoveries.value,
            of.ping_pongs.value,
            of.needless.value,
            of.worst_bps.map_or("-".to_owned(), |bps| format!("{:.2} Gb/s", bps * 1e-9)),
            gap(of.gap_to_a3),
            gap(of.gap_to_conditional),
        );
    }
    text += "handovers, beams pointed elsewhere, lost commands, recoveries and ping-pongs a device and minute; needless: share of handovers; worst 1 %: of the \
             mean rates of 100 ms; gap: share of the way in outage to the oracle's without beams; brackets: 95 % over scenes\n";
    text
}

/// Losses told beside those that came.
pub fn fades_to_text(all: &[Compared]) -> String {
    let mut text = "about fades of 10 dB and more, 400 ms to each side: RMSE of the median told, share of truths within 10 to 90 %\n\
                    true places: RMSE of a trunk and a head by the same integral where everybody is in truth\n\
                    same meshes: RMSE of the other models of the truth, which see every arm and leg where it is\n\
                    spread: that of real fades about a model is in what is told and in the truth\n"
        .to_owned();
    for of in all {
        let Some(case) = &of.case else { continue };
        let spread = if of.spread { "with spread" } else { "bodies alone" };
        text += &format!("{}, {spread}: {} fades", name_of(case), of.fades);
        for (ahead, steps) in STEPS_AHEAD.into_iter().enumerate() {
            let (rmse_db, coverage) = (of.rmse_db(ahead), of.coverage(ahead));
            text += &format!("; {} ms ahead {rmse_db:.2} dB, {coverage:.3}", 100 * steps);
        }
        let (placed_db, median_ms, most_ms) = (of.rmse_placed_db(), of.took_ms(0.5), of.took_ms(0.99));
        text += &format!(
            "; true places {placed_db:.2} dB; {median_ms:.2} ms a frame (median), {most_ms:.2} ms (99 %)"
        );
        for (model, apart_db) in of.rmse_apart_db() {
            text += &format!("; same meshes by {} {apart_db:.2} dB", model.name());
        }
        text.push('\n');
    }
    text
}

/// The same as JSON.
pub fn fades_to_json(all: &[Compared]) -> Value {
    let one = |of: &Compared| {
        let mut value = Value::from_iter(of.case.iter().flat_map(of_case));
        value["spread"] = of.spread.into();
        value["fades"] = of.fades.into();
        for (ahead, steps) in STEPS_AHEAD.into_iter().enumerate() {
            value[format!("rmse_{}_ms_db", 100 * steps)] = of.rmse_db(ahead).into();
            value[format!("coverage_{}_ms", 100 * steps)] = of.coverage(ahead).into();
        }
        value["rmse_true_places_db"] = of.rmse_placed_db().into();
        for (model, apart_db) in of.rmse_apart_db() {
            value[format!("rmse_same_meshes_by_{}_db", model.name().replace('-', "_"))] = apart_db.into();
        }
        value["losses_ms_median"] = of.took_ms(0.5).into();
        value["losses_ms_p99"] = of.took_ms(0.99).into();
        value
    };
    all.iter().map(one).collect()
}

/// Every row as an object of JSON.
pub fn to_json(rows: &[Row]) -> Value {
    rows.iter().map(|row| Value::from_iter(columns(row, rows))).collect()
}

/// The same as a table, with an empty field where there is nothing.
pub fn to_csv(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        let (names, values): (Vec<String>, Vec<Value>) = columns(row, rows).into_iter().unzip();
        let field = |value: &Value| match value {
            Value::Null => String::new(),
            Value::String(name) => name.clone(),
            other => other.to_string(),
        };
        if text.is_empty() {
            text += &(names.join(",") + "\n");
        }
        text += &(values.iter().map(field).collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

/// The columns of the table.
fn columns(row: &Row, rows: &[Row]) -> Vec<(String, Value)> {
    let of = figures(row, rows);
    let named = |(name, value): (&str, Value)| (name.to_owned(), value);
    let mut columns: Vec<(String, Value)> = of_case(&row.case).map(named).into();
    columns.push(named(("policy", row.policy.name().into())));
    columns.push(named(("scenes", row.scenes.len().into())));
    let worst = of.worst_bps.map(|value| Figure { value, interval: None });
    for (name, figure) in [
        ("outage", Some(of.outage)),
        ("handovers_per_min", Some(of.handovers)),
        ("beams_per_min", Some(of.beams)),
        ("lost_commands_per_min", Some(of.lost_commands)),
        ("recoveries_per_min", Some(of.recoveries)),
        ("ping_pongs_per_min", Some(of.ping_pongs)),
        ("needless", Some(of.needless)),
        ("worst_1_percent_bps", worst),
        ("gap_to_a3_closed", of.gap_to_a3),
        ("gap_to_conditional_closed", of.gap_to_conditional),
    ] {
        let interval = figure.and_then(|figure| figure.interval);
        columns.push(named((name, json!(figure.map(|figure| figure.value)))));
        columns.push((format!("{name}_low"), json!(interval.map(|[low, _]| low))));
        columns.push((format!("{name}_high"), json!(interval.map(|[_, high]| high))));
    }
    columns
}

fn of_case(case: &Case) -> [(&'static str, Value); 7] {
    [
        ("people", case.people.into()),
        ("access_points", case.access_points.into()),
        ("carrier_ghz", json!(case.carrier_ghz)),
        ("margin_db", json!(case.margin_db)),
        ("interruption_ms", json!(case.interruption_ms)),
        ("predictor", json!(predictor(case))),
        ("truth", case.truth.name().into()),
    ]
}

fn predictor(case: &Case) -> Option<&'static str> {
    PREDICTORS.into_iter().find(|(_, model)| case.predictor == Some(*model)).map(|(name, _)| name)
}

/// A case in words.
fn name_of(case: &Case) -> String {
    let or_site = |value: Option<f64>, unit: &str| match value {
        Some(value) => format!("{value} {unit}"),
        None => format!("{unit} of the site"),
    };
    format!(
        "{}, {} people, {} access points, margin {}, changes of {}, forecast by {}, truth by {}",
        or_site(case.carrier_ghz, "GHz"),
        case.people,
        case.access_points,
        or_site(case.margin_db, "dB"),
        or_site(case.interruption_ms, "ms"),
        predictor(case).unwrap_or("the site's model"),
        case.truth.name(),
    )
}

fn told(figure: Figure, times: f64) -> String {
    let value = times * figure.value;
    figure.interval.map_or(format!("{value:.2}"), |[low, high]| {
        format!("{value:.2} [{:.2}, {:.2}]", times * low, times * high)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Sweep;
    use crate::truth::TruthModel;

    #[test]
    fn the_gap_closed_is_between_the_policy_that_reacts_and_the_oracle() {
        let sweep = Sweep {
            people: 2,
            access_points: vec![4],
            carriers_ghz: vec![28.0],
            margins_db: Vec::new(),
            interruptions_ms: vec![25.0],
            predictors: Vec::new(),
            truths: vec![TruthModel::Edges],
        };
        let case = sweep.cases()[0];
        let row = |policy, out_ticks: usize| {
            let tally = Tally { ticks: 6000, out_ticks, handovers: 4, needless: 1, ..Tally::default() };
            Row { case, policy, scenes: vec![tally; 5] }
        };
        let rows = [
            row(Policy::A3(Tuning::Fast), 100),
            row(Policy::Conditional(Tuning::Fast), 80),
            row(Policy::Foreseen, 50),
            row(Policy::Oracle, 20),
        ];
        let of = figures(&rows[2], &rows);
        let gap = of.gap_to_a3.unwrap();
        assert_eq!((gap.value, gap.interval), (50.0 / 80.0, Some([50.0 / 80.0; 2])), "scenes alike");
        assert_eq!(of.gap_to_conditional.unwrap().value, 0.5);
        assert_eq!((of.handovers.value, of.needless.value, of.worst_bps), (4.0, 0.25, None));
        let text = to_text(&rows);
        assert!(
            text.starts_with("28 GHz, 2 people, 4 access points, margin dB of the site, changes of 25 ms"),
            "{text}"
        );
        assert!(text.contains("\nforecast                0.83 [0.83, 0.83]"), "{text}");
        let csv = to_csv(&rows);
        assert_eq!(csv.lines().count(), 5);
        assert!(
            csv.lines().all(|line| line.split(',').count() == csv.lines().next().unwrap().split(',').count())
        );
        assert!(to_json(&rows)[3]["gap_to_a3_closed"] == 1.0);
        assert!(figures(&rows[2], &rows[2..]).gap_to_a3.is_none(), "nobody reacts");
    }
}
