//! The rows that a run makes, frame by frame, and their tables.

use std::path::Path;

use umbracast::{Error, Outcome, Site};

use crate::rows::{self, BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, TrackRow};
use crate::tables::TableWriter;

/// The rows of one frame, or of several one after the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OutcomeRows {
    /// Everybody seen.
    pub detections: Vec<DetectionRow>,
    /// Everybody followed, with where they will be.
    pub tracks: Vec<TrackRow>,
    /// Every link.
    pub links: Vec<LinkRow>,
    /// What each of them loses, where its access point has a radio.
    pub losses: Vec<LossRow>,
    /// Who may carry which device that was heard.
    pub bindings: Vec<BindingRow>,
    /// What to do about each device, where the site says what changes cost.
    pub decisions: Vec<DecisionRow>,
}

impl OutcomeRows {
    /// Of one frame of a scene.
    pub fn of(scene: u32, outcome: &Outcome) -> Self {
        let mut made = Self::default();
        made.add(scene, outcome);
        made
    }

    /// Adds those of the next frame.
    pub fn add(&mut self, scene: u32, outcome: &Outcome) {
        rows::of_outcome(scene, outcome, &mut self.tracks, &mut self.links);
        self.detections.extend(rows::detections(scene, outcome));
        self.losses.extend(rows::losses(scene, outcome));
        self.bindings.extend(rows::bindings(scene, outcome));
        self.decisions.extend(rows::decisions(scene, outcome));
    }

    /// Of memory.
    pub fn bytes(&self) -> usize {
        let Self { detections, tracks, links, losses, bindings, decisions } = self;
        size_of_val(&**detections)
            + size_of_val(&**tracks)
            + size_of_val(&**links)
            + size_of_val(&**losses)
            + size_of_val(&**bindings)
            + size_of_val(&**decisions)
    }
}

/// The tables of a run; those of the radio where the site has one.
#[derive(Debug)]
pub struct OutcomeTables {
    detections: Option<TableWriter<DetectionRow>>,
    tracks: TableWriter<TrackRow>,
    links: TableWriter<LinkRow>,
    losses: Option<TableWriter<LossRow>>,
    bindings: Option<TableWriter<BindingRow>>,
    decisions: Option<TableWriter<DecisionRow>>,
}

impl OutcomeTables {
    /// Begins them in a folder, over whatever is there. `detections` tells whether there will be any.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(folder: &Path, site: &Site, csv: bool, detections: bool) -> Result<Self, Error> {
        let names: Vec<String> = site.access_points.iter().map(|ap| ap.name.clone()).collect();
        Ok(Self {
            detections: detections.then(|| TableWriter::create(folder, &names, csv)).transpose()?,
            tracks: TableWriter::create(folder, &names, csv)?,
            links: TableWriter::create(folder, &names, csv)?,
            losses: site.has_radio().then(|| TableWriter::create(folder, &names, csv)).transpose()?,
            bindings: site.has_radio().then(|| TableWriter::create(folder, &names, csv)).transpose()?,
            decisions: site.has_decisions().then(|| TableWriter::create(folder, &names, csv)).transpose()?,
        })
    }

    /// Adds rows in their order.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn write(&mut self, rows: &OutcomeRows) -> Result<(), Error> {
        self.detections.as_mut().map_or(Ok(()), |table| table.write(&rows.detections))?;
        self.tracks.write(&rows.tracks)?;
        self.links.write(&rows.links)?;
        self.losses.as_mut().map_or(Ok(()), |table| table.write(&rows.losses))?;
        self.bindings.as_mut().map_or(Ok(()), |table| table.write(&rows.bindings))?;
        self.decisions.as_mut().map_or(Ok(()), |table| table.write(&rows.decisions))
    }

    /// Writes the ends of the files; without them they cannot be read.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn finish(self) -> Result<(), Error> {
        self.detections.map_or(Ok(()), TableWriter::finish)?;
        self.tracks.finish()?;
        self.links.finish()?;
        self.losses.map_or(Ok(()), TableWriter::finish)?;
        self.bindings.map_or(Ok(()), TableWriter::finish)?;
        self.decisions.map_or(Ok(()), TableWriter::finish)
    }
}
