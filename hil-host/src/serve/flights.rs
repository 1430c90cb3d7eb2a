//! Flights opened in the workbench: what the model says of them with the
//! ticked effects on.

pub use super::requests::{Evaluate, File, Fit, Open, Overlay};
use super::track_map::way;
use super::{Sorry, Workbench, dropped, overlay};
use crate::next_mission;
use crate::pages::{effect_list, flight_report};
use crate::score::story;
use anyhow::{Context, bail};
use axum::Json;
use axum::body::Body;
use axum::response::{IntoResponse, Response};
use discovery::diagnosis::judged::{Judged, as_given_m_s, error_m_s};
use discovery::diagnosis::{Diagnosis, check_segments};
use discovery::likelihood::block_error::{blocks, modelled_m_s};
use discovery::model::branch::Branch;
use discovery::model::dynamics::Track;
use discovery::model::parameters::{State, law};
use discovery::preprocess::{Prepared, prepare, sanity};
use discovery::workbench::add;
use hydro::effects::{Active, CATALOGUE, Flow, ForceModel, by_name};
use logs::{Flight, Vehicle};
use rig::flight::mission_file;
use rig::flight::tables::Built;
use rig::flight::vehicles::Model;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// A flight in memory, ready for the model.
#[derive(Debug)]
pub struct Opened {
    /// Its number in this run of the server.
    pub id: usize,
    /// As read.
    pub flight: Flight,
    /// Its nominal vehicle.
    pub vehicle: Vehicle,
    /// What is to be said of how it was read.
    notes: Vec<String>,
    /// Cleaned and cut.
    pub prepared: Prepared,
    /// The blocks the error is read from, as a diagnosis reads it.
    judged: Judged,
    /// What ordinary water motion and sensors alone would leave of the error, m/s, by the last fit.
    floor: Mutex<Option<f64>>,
    /// The last diagnosis.
    found: Mutex<Option<Arc<Diagnosis>>>,
    /// Which branch the model takes beyond the valid angle of attack, as the last fit took it.
    branch: Mutex<Branch>,
    /// Fitted states by the effects that are on (sorted names); the empty list is recalibration alone.
    fitted: Mutex<BTreeMap<Vec<String>, State>>,
}

impl Opened {
    fn new(id: usize, flight: Flight, vehicle: Vehicle, notes: Vec<String>) -> anyhow::Result<Self> {
        let prepared = prepare(&flight, &vehicle);
        if prepared.runs.is_empty() {
            bail!("{}: no stretch of this flight is long enough for the model: {}", flight.name, prepared.notes.join("; "));
        }
        if let Err(why) = sanity::check(&prepared, &vehicle) {
            bail!("{}: {why}", flight.name);
        }
        let judged = Judged::of(&prepared, &vehicle, &check_segments(&vehicle, &prepared, &mut Vec::new()));
        let (floor, found) = (Mutex::default(), Mutex::default());
        let (branch, fitted) = (Mutex::default(), Mutex::default());
        let opened = Self { id, flight, vehicle, notes, prepared, judged, floor, found, branch, fitted };
        // A flight too short to fit can still be looked at.
        if let Ok(calibrated) = add::add(&opened.flight, &opened.vehicle, &[], &[]) {
            opened.remember(&[], &calibrated.recalibrated, calibrated.branch);
            opened.floor_is(calibrated.noise_floor_m_s);
        }
        Ok(opened)
    }

    fn summary(&self) -> Value {
        let hours = self.prepared.runs.iter().filter_map(|r| Some(r.time_s.last()? - r.time_s.first()?)).sum::<f64>() / 3600.0;
        let notes = [&self.notes[..], &self.prepared.notes].concat();
        // Counted as `glider import` counts them; `hours` are those in which the model is run.
        let segments = self.flight.segment.iter().collect::<BTreeSet<_>>().len();
        json!({"id": self.id, "name": self.flight.name, "rows": self.flight.len(), "segments": segments, "hours": hours,
               "speed": self.flight.speed_m_s.is_some(), "vehicle": self.vehicle.name, "notes": notes})
    }

    fn floor_is(&self, floor_m_s: f64) {
        *self.floor.lock().unwrap_or_else(PoisonError::into_inner) = Some(floor_m_s).filter(|f| f.is_finite());
    }

    /// The last diagnosis.
    fn diagnosis(&self) -> anyhow::Result<Arc<Diagnosis>> {
        let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found.clone().context("press \u{201c}Find what is missing\u{201d} first")
    }

    /// The state that the ticked effects mean: their values, with the calibration fitted together with them, where it was.
    fn state(&self, effects: &[Active]) -> State {
        if effects.is_empty() {
            return State::nominal();
        }
        let names: Vec<String> = effects.iter().map(|e| e.effect.name.to_owned()).collect();
        let calibration = self.fitted(&names).map_or(State::nominal().calibration, |s| s.calibration);
        State { calibration, effects: effects.to_vec(), wave: None }
    }

    /// Keeps a fit under the names of its effects. A wave's phase is known only in fitted segments: its amplitudes stay behind.
    fn remember(&self, names: &[&str], state: &State, branch: Branch) {
        *self.branch.lock().unwrap_or_else(PoisonError::into_inner) = branch;
        let mut names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        names.sort_unstable();
        self.fitted.lock().unwrap_or_else(PoisonError::into_inner).insert(names, State { wave: None, ..state.clone() });
    }

    fn fitted(&self, names: &[String]) -> Option<State> {
        let mut names = names.to_vec();
        names.sort_unstable();
        self.fitted.lock().unwrap_or_else(PoisonError::into_inner).get(&names).cloned()
    }

    /// The vehicle that a state's effects stand beside: ticked ones are meant as a whole, whatever the file says of them.
    fn refitted(&self, state: &State) -> Vehicle {
        self.vehicle.without(&state.effects.iter().map(|a| a.effect).collect::<Vec<_>>())
    }

    fn tracks(&self, state: &State) -> Vec<Track> {
        let branch = *self.branch.lock().unwrap_or_else(PoisonError::into_inner);
        let vehicle = self.refitted(state);
        self.prepared.runs.iter().map(|run| branch.track(run, &vehicle, state)).collect()
    }

    /// Error on the judged blocks of a model's tracks, one a run, m/s.
    fn error(&self, tracks: &[Track]) -> Option<f64> {
        Some(error_m_s(&self.prepared, self.judged.printed().0, |k| tracks[k].depth_m.clone())).filter(|v| v.is_finite())
    }

    /// Error, traces by block, and L/D curve in a state.
    #[must_use]
    pub fn evaluation(&self, state: &State) -> Value {
        let (nominal, now) = (self.tracks(&State::nominal()), self.tracks(state));
        let as_given = Some(as_given_m_s(&self.prepared, &self.vehicle, self.judged.printed().0)).filter(|v| v.is_finite());
        let recalibrated = self.fitted(&[]).and_then(|s| self.error(&self.tracks(&s)));
        let clock = flight_report::under_way(&self.prepared);
        let way = way(&self.flight, &self.prepared.runs, &now);
        let names = ["t", "depth", "observed", "nominal", "now", "alpha", "east", "north"];
        let mut columns: BTreeMap<&str, Vec<Option<f64>>> = names.iter().map(|n| (*n, Vec::new())).collect();
        let mut flown = Histogram::default();
        for ((((run, old), new), places), shift) in self.prepared.runs.iter().zip(&nominal).zip(&now).zip(&way.reckoned).zip(clock) {
            let cut = blocks(run);
            let starts: Vec<f64> = cut.iter().map(|b| run.time_s[b.rows[0]]).collect();
            for (block, gap) in cut.into_iter().zip(flight_report::gaps(&starts)) {
                if gap {
                    names.iter().for_each(|n| columns.entry(n).or_default().push((*n == "t").then(|| run.time_s[block.rows[0]] - shift)));
                }
                let (first, middle) = (block.rows[0], block.rows[block.rows.len() / 2]);
                let alpha = new.alpha_rad.get(middle).copied().unwrap_or(f64::NAN).to_degrees();
                flown.count(alpha.abs());
                let row = [
                    run.time_s[first] - shift,
                    run.depth_m[middle],
                    100.0 * block.observed_m_s,
                    100.0 * modelled_m_s(run, &block, &old.depth_m),
                    100.0 * modelled_m_s(run, &block, &new.depth_m),
                    alpha,
                    places[middle].0,
                    places[middle].1,
                ];
                for (name, value) in names.iter().zip(row) {
                    columns.entry(name).or_default().push(value.is_finite().then_some(value));
                }
            }
            // A gap between segments, so that no line joins them.
            for name in names {
                let end = (name == "t").then(|| run.time_s.last().map(|t| t - shift)).flatten();
                columns.entry(name).or_default().push(end);
            }
        }
        let values: Map<String, Value> =
            state.effects.iter().map(|e| (e.effect.name.to_owned(), json!(e.values[..e.effect.parameters.len()]))).collect();
        json!({
            "error": {"nominal": as_given, "recalibrated": recalibrated, "now": self.error(&now),
                      "floor": *self.floor.lock().unwrap_or_else(PoisonError::into_inner), "held_out": self.judged.printed().1},
            "fixes": {"east": way.fixes.iter().map(|f| f.0).collect::<Vec<_>>(), "north": way.fixes.iter().map(|f| f.1).collect::<Vec<_>>()},
            "effects": values, "blocks": columns, "curve": curve([&self.vehicle, &self.refitted(state)], state, &flown),
        })
    }
}

/// Share of time by whole degrees of angle of attack.
#[derive(Default)]
struct Histogram {
    bins: [u32; 30],
    total: u32,
}

impl Histogram {
    fn count(&mut self, degrees: f64) {
        if degrees.is_finite() {
            self.total += 1;
            if let Some(bin) = self.bins.get_mut(degrees as usize) {
                *bin += 1;
            }
        }
    }
}

/// L/D of a dive against angle of attack at 0.3 m/s, a shallow glider's speed, of a vehicle as given and of one in a state.
fn curve([given, refitted]: [&Vehicle; 2], state: &State, flown: &Histogram) -> Value {
    let degrees: Vec<f64> = (1..=80).map(|i| f64::from(i) * 0.25).collect();
    let ratio = |vehicle: &Vehicle, state: &State| -> Vec<f64> {
        let (constants, effects) = law(vehicle, state);
        let model = ForceModel::new(constants, &effects);
        let at = |d: &f64| model.coefficients(&Flow { climb_m_s: -0.1, ..Flow::steady(d.to_radians(), 0.3) });
        degrees.iter().map(at).map(|c| c.cl / c.cd).collect()
    };
    let total = f64::from(flown.total.max(1));
    let shares: Vec<f64> = flown.bins.iter().take(20).map(|n| f64::from(*n) / total).collect();
    let middles: Vec<f64> = (0..20).map(|i| f64::from(i) + 0.5).collect();
    json!({"alpha": degrees, "nominal": ratio(given, &State::nominal()), "now": ratio(refitted, state), "flown_alpha": middles, "flown_share": shares})
}

/// Effects by name and values, as the page sends them.
pub(super) fn active(effects: &BTreeMap<String, Vec<f64>>) -> anyhow::Result<Vec<Active>> {
    let mut out = Vec::new();
    for (name, values) in effects {
        let effect = by_name(name).with_context(|| format!("there is no effect named {name}"))?;
        let mut one = Active::off(effect);
        if values.len() != effect.parameters.len() {
            bail!("{name} has {} parameters, not {}", effect.parameters.len(), values.len());
        }
        for ((slot, value), p) in one.values.iter_mut().zip(values).zip(effect.parameters) {
            if !(p.low..=p.high).contains(value) {
                bail!("{name}.{} = {value} {} is outside {} to {}", p.name, p.unit, p.low, p.high);
            }
            *slot = *value;
        }
        out.push(one);
    }
    Ok(out)
}

/// What the page needs before any flight is open.
pub fn catalogue(bench: &Workbench) -> Value {
    let effects: Vec<Value> = CATALOGUE
        .iter()
        .map(|e| {
            let parameters: Vec<Value> = e
                .parameters
                .iter()
                .map(|p| json!({"name": p.name, "unit": p.unit, "off": p.off, "low": p.low, "high": p.high, "typical": p.typical}))
                .collect();
            json!({"name": e.name, "words": effect_list::in_words(e.name), "kind": effect_list::kind(e), "physics": e.physics,
                   "separated_by": e.separated_by, "parameters": parameters})
        })
        .collect();
    let flights: Vec<String> = bench.offered.iter().map(|p| p.display().to_string()).collect();
    let open: Vec<Value> = bench.open.lock().unwrap_or_else(PoisonError::into_inner).iter().map(|o| o.summary()).collect();
    json!({"effects": effects, "kinds": effect_list::KINDS, "flights": flights, "open": open, "missions": mission_file::BUILT_IN,
           "faults": super::live::fault_buttons()})
}

impl Workbench {
    /// The open flight with this number.
    ///
    /// # Errors
    /// There is none.
    pub fn flight(&self, id: usize) -> anyhow::Result<Arc<Opened>> {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.get(id).cloned().with_context(|| format!("flight {id} is not open in this run of the server: open it again"))
    }

    /// Opens dropped files or an offered flight.
    ///
    /// # Errors
    /// What is wrong with the files, and where.
    pub fn open_flight(&self, request: &Open) -> anyhow::Result<Value> {
        let (flight, vehicle, notes) = match request.listed {
            Some(i) => {
                let path = self.offered.get(i).context("no such flight in the list")?;
                let own_file = logs::vehicle::file_next_to(path)?
                    .with_context(|| format!("{}: no vehicle.json or vehicle.toml beside it", path.display()))?;
                (logs::record::csv::flight(path)?, logs::vehicle::read(&own_file)?, Vec::new())
            }
            None => dropped::read(&request.files)?,
        };
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let opened = Arc::new(Opened::new(open.len(), flight, vehicle, notes)?);
        open.push(opened.clone());
        Ok(opened.summary())
    }

    /// Error, traces and curve with the ticked effects.
    ///
    /// # Errors
    /// Unknown flight or effect, value out of range.
    pub fn evaluate(&self, request: &Evaluate) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        Ok(opened.evaluation(&opened.state(&active(&request.effects)?)))
    }

    /// The measured traces of a second flight, and its depth rate minus this one's at this one's moments.
    ///
    /// # Errors
    /// Unknown flight.
    pub fn overlay(&self, request: &Overlay) -> anyhow::Result<Value> {
        let [this, second] = [self.flight(request.flight)?, self.flight(request.second)?];
        let [a, b] = [&this, &second].map(|f| f.evaluation(&State::nominal())["blocks"].take());
        let column =
            |blocks: &Value, key: &str| -> Vec<Option<f64>> { blocks[key].as_array().into_iter().flatten().map(Value::as_f64).collect() };
        let [t, rate, second_t, second_rate] = [(&a, "t"), (&a, "observed"), (&b, "t"), (&b, "observed")].map(|(f, key)| column(f, key));
        let difference = overlay::difference((&t, &rate), (&second_t, &second_rate));
        Ok(json!({"name": second.flight.name, "t": second_t, "depth": b["depth"], "observed": second_rate,
                  "difference": {"t": t, "observed": difference}}))
    }

    /// The same, with the ticked effects and the calibration fitted first.
    ///
    /// # Errors
    /// Unknown flight or effect, or nothing to fit.
    pub fn fit(&self, request: &Fit) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let effects = request.effects.iter().map(|n| by_name(n).with_context(|| format!("there is no effect named {n}")));
        let effects: Vec<_> = effects.collect::<anyhow::Result<_>>()?;
        if let Some(known) = opened.fitted(&request.effects) {
            return Ok(opened.evaluation(&known));
        }
        let fit = add::add(&opened.flight, &opened.vehicle, &effects, &[])?;
        let names: Vec<&str> = effects.iter().map(|e| e.name).collect();
        opened.remember(&names, &fit.after, fit.branch);
        opened.floor_is(fit.noise_floor_m_s);
        Ok(opened.evaluation(&fit.after))
    }

    /// New vehicle file and flight table with the ticked effects fitted.
    ///
    /// # Errors
    /// Nothing ticked, or nothing to fit.
    pub fn save(&self, request: &Evaluate) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let effects: Vec<_> = active(&request.effects)?.iter().map(|a| a.effect).collect();
        if effects.is_empty() {
            bail!("tick at least one effect: the vehicle as given is the file you opened");
        }
        let parent = opened.vehicle.document.to_string();
        let added = add::add(&opened.flight, &opened.vehicle, &effects, parent.as_bytes())?;
        let text = format!("{:#}\n", added.vehicle);
        let name = format!("{}-with-{}.json", opened.vehicle.name, effects.iter().map(|e| e.name).collect::<Vec<_>>().join("-"));
        let refitted = logs::vehicle::parse_text(&text, Path::new(&name))?;
        let mut answer = json!({"vehicle": {"name": name, "text": text}});
        match story::table_of(&refitted, text.as_bytes()) {
            Ok(table) => {
                let bytes: Vec<u8> = table.bytes;
                answer["table"] = json!({"name": "table.bin", "bytes": bytes.len(), "values": bytes});
            }
            Err(e) => answer["note"] = json!(format!("no flight table: {e:#}")),
        }
        Ok(answer)
    }
}

impl Workbench {
    /// The vehicle as opened and with these effects added and refitted, each with its flight table: as given, learnt.
    ///
    /// # Errors
    /// Nothing ticked, nothing to fit, or a vehicle that no table can be made of.
    pub fn learnt(&self, request: &Fit) -> anyhow::Result<[(Model, Built); 2]> {
        let opened = self.flight(request.flight)?;
        let effects = request.effects.iter().map(|n| by_name(n).with_context(|| format!("there is no effect named {n}")));
        let effects: Vec<_> = effects.collect::<anyhow::Result<_>>()?;
        if effects.is_empty() {
            bail!("tick at least one effect: the learnt world is that of the ticked effects");
        }
        let parent = opened.vehicle.document.to_string();
        let text = format!("{:#}\n", add::add(&opened.flight, &opened.vehicle, &effects, parent.as_bytes())?.vehicle);
        let refitted = logs::vehicle::parse_text(&text, Path::new("learnt.json"))?;
        let both =
            |vehicle: &Vehicle, text: &str| anyhow::Ok((Model::of_coefficients(vehicle, 0)?, story::table_of(vehicle, text.as_bytes())?));
        Ok([both(&opened.vehicle, &parent)?, both(&refitted, &text)?])
    }

    /// The mission that would tell the best hypotheses of the last diagnosis apart.
    ///
    /// # Errors
    /// No diagnosis yet, or nothing that a mission could tell apart.
    pub fn next_flight(&self, request: &Fit) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let found = opened.diagnosis()?;
        let planned = next_mission::plan(&found, &opened.vehicle)?.context("there are no two hypotheses left to tell apart")?;
        let tied = planned.tied.iter().map(|t| t.join(" with ")).collect::<Vec<_>>().join(" / ");
        if !planned.tells_apart() {
            bail!("no dives at other pitches and drives tell {tied} apart (expected chi² {:.1})", planned.expected_chi2());
        }
        let text = planned.mission(next_mission::wings(&opened.vehicle));
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
    let (lines, body) = super::lines();
    super::streaming(lines, move |lines| {
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
        lines.send(&json!({"result": discovery::diagnosis::report::document(&found, &opened.vehicle, &opened.flight.name)}));
        *opened.found.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(found));
        Ok(())
    });
    Ok(Body::from_stream(body).into_response())
}
