//! The flights of one vehicle that are open, dive by dive: what changed, and when.

use super::Workbench;
use super::flights::Opened;
use super::requests::Fit;
use crate::pages::timeline_document::document;
use crate::pages::timeline_figure::figure;
use discovery::history::kinds::DIVES_PER_ALARM;
use discovery::workbench::mission_clock::{When, one_clock};
use discovery::workbench::timeline::Mission;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, PoisonError};

impl Workbench {
    /// The timeline of all open flights of this flight's vehicle, in the order in which they were opened, judged by its vehicle file.
    ///
    /// # Errors
    /// Fewer dives than a change can be told from.
    pub fn timeline(&self, request: &Fit) -> anyhow::Result<Value> {
        let this = self.flight(request.flight)?;
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let mut seen = BTreeSet::new();
        let wanted = |o: &&Arc<Opened>| o.vehicle.name == this.vehicle.name && seen.insert(o.flight.name.clone());
        let flights: Vec<_> = open.iter().filter(wanted).collect();
        let clock = one_clock(&flights.iter().map(|f| When::of(&f.flight, None)).collect::<Vec<_>>());
        let mut mission = Mission::new(&this.vehicle);
        for (which, zero_s) in &clock.flights {
            mission.add(&flights[*which].flight, *zero_s);
        }
        let mut done = mission.finish(DIVES_PER_ALARM)?;
        done.notes.splice(0..0, clock.notes);
        let names: Vec<&str> = flights.iter().map(|f| f.flight.name.as_str()).collect();
        let drawn = figure(&[document(&done, Path::new(&this.vehicle.name))])?;
        Ok(json!({"flights": names, "dives": done.rows.len(), "caption": drawn.caption, "charts": drawn.panels, "notes": done.notes}))
    }
}
