//! What is missing from an open flight, and what follows from that: the next mission, and the report.

use super::requests::Fit;
use super::{Sorry, Workbench, lines, streaming};
use crate::next_mission;
use crate::pages::{answer_charts, flight_report};
use anyhow::{anyhow, bail};
use axum::Json;
use axum::body::Body;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};
use std::sync::{Arc, PoisonError};

impl Workbench {
    /// The mission that would tell the best hypotheses of the last diagnosis apart.
    ///
    /// # Errors
    /// No diagnosis yet, or nothing that a mission could tell apart.
    pub fn next_flight(&self, request: &Fit) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let found = opened.diagnosis()?;
        let planned = next_mission::plan(&found, &opened.vehicle)?.map_err(|why| anyhow!("no mission is planned: {why}"))?;
        let tied = planned.tied.iter().map(|t| t.join(" with ")).collect::<Vec<_>>().join(" / ");
        if !planned.tells_apart() {
            bail!("no dives at other pitches and drives tell {tied} apart (expected chi² {:.1})", planned.expected_chi2());
        }
        let text = planned.mission(next_mission::wings(&opened.vehicle));
        *opened.planned.lock().unwrap_or_else(PoisonError::into_inner) = Some(text.clone());
        Ok(
            json!({"name": "next.toml", "text": text, "tied": tied, "expected_chi2": planned.expected_chi2(), "at_one_pitch": planned.default_separation}),
        )
    }

    /// The offline report of the last diagnosis.
    ///
    /// # Errors
    /// No diagnosis yet.
    pub fn report(&self, request: &Fit) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let found = opened.diagnosis()?;
        let page = flight_report::page(&found, &opened.vehicle, &opened.flight.name, crate::pages::Provenance::of_this_run());
        Ok(json!({"name": format!("{}.html", opened.flight.name), "text": page.to_html()}))
    }
}

/// Diagnoses an open flight; progress goes out as it comes.
///
/// # Errors
/// The flight is not open.
pub async fn diagnose(bench: axum::extract::State<Arc<Workbench>>, Json(request): Json<Fit>) -> Result<Response, Sorry> {
    let opened = bench.flight(request.flight)?;
    let (lines, body) = lines();
    streaming(lines, move |lines| {
        let found = discovery::diagnosis::diagnose(
            &opened.flight,
            &opened.vehicle,
            discovery::hypotheses::search::Depth::Pairs,
            &|what, share| {
                lines.send(&json!({"progress": share, "text": what}));
            },
        )?;
        opened.remember(&[], &found.recalibrated, found.branch);
        // What is found beside an effect of the file is a change of it, not all of it.
        let on = |name: &&str| opened.vehicle.effects.iter().any(|a| a.effect.name == *name);
        for c in found.candidates.iter().filter(|c| !c.effects.iter().any(on)) {
            opened.remember(&c.effects, &c.state, found.branch);
        }
        opened.floor_is(found.noise_floor_m_s);
        let mut result = discovery::diagnosis::report::document(&found, &opened.vehicle, &opened.flight.name);
        let charts =
            [answer_charts::parts(&found), vec![answer_charts::ladder(&found), flight_report::polar(&found, &opened.vehicle)]].concat();
        result["charts"] = json!(charts);
        lines.send(&json!({"result": result}));
        *opened.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(found));
        Ok(())
    });
    Ok(Body::from_stream(body).into_response())
}
