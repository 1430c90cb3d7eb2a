//! Flights opened in the workbench: what the model says of them with the
//! ticked effects on.

pub use super::requests::{Evaluate, File, Fit, Open, Overlay, Own};

use super::{Workbench, dropped, overlay};
use crate::pages::chart::map_of_means;
use crate::pages::track_map::way;
use crate::pages::{effect_list, flight_report};
use crate::score::diagnosis::write_case;
use crate::score::story;
use anyhow::{Context, bail};
use discovery::diagnosis::judged::{Judged, as_given_m_s, error_m_s};
use discovery::diagnosis::{Diagnosis, check_segments};
use discovery::likelihood::block_error::{self, blocks, modelled_m_s};
use discovery::model::branch::Branch;
use discovery::model::dynamics::Track;
use discovery::model::parameters::{State, law};
use discovery::preprocess::{Prepared, prepare, sanity};
use discovery::workbench::add;
use hydro::effects::{Active, CATALOGUE, Effect, by_name};
use logs::vehicle::expression;
use logs::{Flight, Vehicle};
use plant::trials::catalogue::{Effect as Truth, Strength};
use plant::trials::{Site, Spec, Wing, generate};
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
    pub(super) found: Mutex<Option<Arc<Diagnosis>>>,
    /// The mission that was planned after it.
    pub(super) planned: Mutex<Option<String>>,
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
        let (floor, found, planned) = (Mutex::default(), Mutex::default(), Mutex::default());
        let (branch, fitted) = (Mutex::default(), Mutex::default());
        let opened = Self { id, flight, vehicle, notes, prepared, judged, floor, found, planned, branch, fitted };
        // A flight too short to fit can still be looked at.
        if let Ok(calibrated) = add::add(&opened.flight, &opened.vehicle, &[], &[]) {
            opened.remember(&[], &calibrated.recalibrated, calibrated.branch);
            opened.floor_is(calibrated.noise_floor_m_s);
        }
        Ok(opened)
    }

    /// The text of its vehicle file with these effects fitted, or with none but recalibrated; and that vehicle, with the name of its file.
    fn with(&self, effects: &[&'static Effect]) -> anyhow::Result<(String, Vehicle)> {
        let parent = self.vehicle.document.to_string();
        let text = format!("{:#}\n", add::add(&self.flight, &self.vehicle, effects, parent.as_bytes())?.vehicle);
        let names: Vec<&str> = effects.iter().map(|e| e.name).collect();
        let what = if names.is_empty() { "calibrated".into() } else { format!("with-{}", names.join("-")) };
        let vehicle = logs::vehicle::parse_text(&text, Path::new(&format!("{}-{what}.json", self.vehicle.name)))?;
        Ok((text, vehicle))
    }

    fn summary(&self) -> Value {
        let hours = self.prepared.runs.iter().filter_map(|r| Some(r.time_s.last()? - r.time_s.first()?)).sum::<f64>() / 3600.0;
        let notes = [&self.notes[..], &self.prepared.notes].concat();
        // Counted as `glider import` counts them; `hours` are those in which the model is run.
        let segments = self.flight.segment.iter().collect::<BTreeSet<_>>().len();
        json!({"id": self.id, "name": self.flight.name, "rows": self.flight.len(), "segments": segments, "hours": hours,
               "speed": self.flight.speed_m_s.is_some(), "vehicle": self.vehicle.name, "notes": notes})
    }

    pub(super) fn floor_is(&self, floor_m_s: f64) {
        *self.floor.lock().unwrap_or_else(PoisonError::into_inner) = Some(floor_m_s).filter(|f| f.is_finite());
    }

    /// The last diagnosis.
    pub(super) fn diagnosis(&self) -> anyhow::Result<Arc<Diagnosis>> {
        let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found.clone().context("press \u{201c}Find what is missing\u{201d} first")
    }

    /// The mission that was planned after it.
    ///
    /// # Errors
    /// None was.
    pub fn planned(&self) -> anyhow::Result<String> {
        let planned = self.planned.lock().unwrap_or_else(PoisonError::into_inner);
        planned.clone().context("press \u{201c}Next flight\u{201d} first")
    }

    /// The state that the ticked effects mean: their values, with the calibration fitted together with them, where it was.
    fn state(&self, effects: &[Active]) -> State {
        if effects.is_empty() {
            return State::nominal();
        }
        let names: Vec<String> = effects.iter().map(|e| key(e.effect).to_owned()).collect();
        let calibration = self.fitted(&names).map_or(State::nominal().calibration, |s| s.calibration);
        State { calibration, effects: effects.to_vec(), wave: None }
    }

    /// Keeps a fit under the names of its effects. A wave's phase is known only in fitted segments: its amplitudes stay behind.
    pub(super) fn remember(&self, names: &[&str], state: &State, branch: Branch) {
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

    /// Usual length of its blocks, s.
    fn block_s(&self) -> f64 {
        block_error::block_s(block_error::sampled_every_s(&self.prepared.runs))
    }

    /// Error, traces by block, and L/D curve in a state.
    #[must_use]
    pub fn evaluation(&self, state: &State) -> Value {
        let (nominal, now) = (self.tracks(&State::nominal()), self.tracks(state));
        let calibrated = self.fitted(&[]);
        let refitted = calibrated.as_ref().map(|s| self.tracks(s));
        let as_given = Some(as_given_m_s(&self.prepared, &self.vehicle, self.judged.printed().0)).filter(|v| v.is_finite());
        let recalibrated = refitted.as_ref().and_then(|tracks| self.error(tracks));
        let clock = flight_report::under_way(&self.prepared);
        let way = way(&self.flight, &self.prepared.runs, &now);
        let names = ["t", "depth", "observed", "nominal", "recalibrated", "now", "alpha", "east", "north"];
        let mut columns: BTreeMap<&str, Vec<Option<f64>>> = names.iter().map(|n| (*n, Vec::new())).collect();
        let mut flown = Histogram::default();
        let runs = self.prepared.runs.iter().zip(&nominal).zip(&now).zip(&way.reckoned).zip(clock);
        for (k, ((((run, old), new), places), shift)) in runs.enumerate() {
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
                    refitted.as_ref().map_or(f64::NAN, |tracks| 100.0 * modelled_m_s(run, &block, &tracks[k].depth_m)),
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
        // Hardly moving, a vehicle has no angle of attack.
        let seen = |name: &str, v: f64| if name == "alpha" && v.abs() > 30.0 { f64::NAN } else { v };
        let column = |name: &str| -> Vec<f64> { columns[name].iter().map(|v| seen(name, v.unwrap_or(f64::NAN))).collect() };
        let minus = |model: &str| -> Vec<f64> { column("observed").iter().zip(column(model)).map(|(o, m)| o - m).collect() };
        let maps = [("alpha", "nominal", 12), ("alpha", "now", 12), ("t", "nominal", 24), ("t", "now", 24)];
        let maps = maps.map(|(x, model, nx)| map_of_means([&column(x), &column("depth"), &minus(model)], (nx, 8)));
        let values: Map<String, Value> =
            state.effects.iter().map(|e| (key(e.effect).to_owned(), json!(e.values[..e.effect.parameters.len()]))).collect();
        json!({
            "error": {"nominal": as_given, "recalibrated": recalibrated, "now": self.error(&now),
                      "floor": *self.floor.lock().unwrap_or_else(PoisonError::into_inner), "held_out": self.judged.printed().1},
            "fixes": {"east": way.fixes.iter().map(|f| f.0).collect::<Vec<_>>(), "north": way.fixes.iter().map(|f| f.1).collect::<Vec<_>>()},
            "effects": values, "blocks": columns, "block_s": self.block_s(), "maps": maps,
            "curve": curve([&self.vehicle, &self.refitted(state)], calibrated.as_ref(), state, &flown),
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
fn curve([given, refitted]: [&Vehicle; 2], calibrated: Option<&State>, state: &State, flown: &Histogram) -> Value {
    let degrees: Vec<f64> = (1..=80).map(|i| f64::from(i) * 0.25).collect();
    let ratio = |vehicle: &Vehicle, state: &State| flight_report::l_over_d(&law(vehicle, state), &degrees);
    let total = f64::from(flown.total.max(1));
    let shares: Vec<f64> = flown.bins.iter().take(20).map(|n| f64::from(*n) / total).collect();
    let middles: Vec<f64> = (0..20).map(|i| f64::from(i) + 0.5).collect();
    json!({"alpha": degrees, "nominal": ratio(given, &State::nominal()), "recalibrated": calibrated.map(|s| ratio(given, s)), "now": ratio(refitted, state), "flown_alpha": middles, "flown_share": shares})
}

/// The example: a simulated day on a lake whose vehicle glides with an effect that its file lacks.
fn example() -> anyhow::Result<(Flight, Vehicle, Vec<String>)> {
    let spec = Spec::single(Site::Lake, Wing::Standard, Truth::ClimbDrag, Strength::Strong);
    let scratch = dropped::Scratch::new()?;
    let case = write_case(&scratch.0, &generate(&spec, EXAMPLE_SEED, 0))?;
    let file = logs::vehicle::file_next_to(&case)?.context("the example has no vehicle file")?;
    let mut flight = logs::record::csv::flight(&case)?;
    flight.name = "example".into();
    Ok((flight, logs::vehicle::read(&file)?, vec!["simulated, with an effect that its vehicle file lacks".into()]))
}

/// Any will do.
const EXAMPLE_SEED: u64 = 5;

/// What the page calls an effect: its name, or the expression that somebody wrote.
fn key(effect: &Effect) -> &'static str {
    effect.expression.unwrap_or(effect.name)
}

/// The effect that the page calls so.
fn called(name: &str) -> anyhow::Result<&'static Effect> {
    /// Those that are written, each read once: they stay in memory.
    static WRITTEN: Mutex<BTreeMap<String, &'static Effect>> = Mutex::new(BTreeMap::new());
    if !expression::is_expression(name) {
        return by_name(name).with_context(|| format!("there is no effect named {name}"));
    }
    let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(effect) = written.get(name) {
        return Ok(effect);
    }
    anyhow::ensure!(written.len() < MOST_WRITTEN, "{MOST_WRITTEN} expressions were tried: start `glider serve` again for more");
    let effect: &'static Effect = expression::parse(name)?;
    written.insert(name.to_owned(), effect);
    Ok(effect)
}

/// Expressions that one server reads.
const MOST_WRITTEN: usize = 1000;

/// An effect as the page shows it.
fn offered(e: &'static Effect) -> Value {
    let (words, kind) = match e.expression {
        Some(text) => (text.to_owned(), effect_list::OWN),
        None => (effect_list::in_words(e.name), effect_list::kind(e)),
    };
    json!({"name": key(e), "words": words, "kind": kind, "physics": e.physics, "separated_by": e.separated_by,
           "parameters": effect_list::parameters(e)})
}

/// Effects by name and values, as the page sends them.
pub(super) fn active(effects: &BTreeMap<String, Vec<f64>>) -> anyhow::Result<Vec<Active>> {
    let mut out = Vec::new();
    for (name, values) in effects {
        let effect = called(name)?;
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

/// An effect that somebody wrote, as the page shows it.
///
/// # Errors
/// Where it cannot be read.
pub fn own(request: &Own) -> anyhow::Result<Value> {
    anyhow::ensure!(expression::is_expression(&request.expression), "write for example: cd += k*roll^2");
    Ok(offered(called(request.expression.trim())?))
}

/// What the page needs before any flight is open.
pub fn catalogue(bench: &Workbench) -> Value {
    let effects: Vec<Value> = CATALOGUE.iter().map(|e| offered(e)).collect();
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
        self.is_opening("Reading the files");
        let (flight, vehicle, notes) = match request.listed {
            Some(i) => {
                let path = self.offered.get(i).context("no such flight in the list")?;
                let own_file = logs::vehicle::file_next_to(path)?
                    .with_context(|| format!("{}: no vehicle.json or vehicle.toml beside it", path.display()))?;
                (logs::record::csv::flight(path)?, logs::vehicle::read(&own_file)?, Vec::new())
            }
            None if request.example => example()?,
            None => dropped::read(&request.files)?,
        };
        self.is_opening("Cutting it into dives and refitting the vehicle's numbers");
        let opened = Opened::new(0, flight, vehicle, notes)?;
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        let opened = Arc::new(Opened { id: open.len(), ..opened });
        open.push(opened.clone());
        Ok(opened.summary())
    }

    fn is_opening(&self, what: &'static str) {
        *self.opening.lock().unwrap_or_else(PoisonError::into_inner) = what;
    }

    /// What is done with the flight that is being opened.
    pub fn opening_now(&self) -> Value {
        json!({"text": *self.opening.lock().unwrap_or_else(PoisonError::into_inner)})
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
        let effects = request.effects.iter().map(|n| called(n)).collect::<anyhow::Result<Vec<_>>>()?;
        if let Some(known) = opened.fitted(&request.effects) {
            return Ok(opened.evaluation(&known));
        }
        let fit = add::add(&opened.flight, &opened.vehicle, &effects, &[])?;
        let names: Vec<&str> = effects.iter().map(|e| key(e)).collect();
        opened.remember(&names, &fit.after, fit.branch);
        opened.floor_is(fit.noise_floor_m_s);
        Ok(opened.evaluation(&fit.after))
    }

    /// New vehicle file and flight table, with the calibration and the ticked effects fitted.
    ///
    /// # Errors
    /// Nothing to fit.
    pub fn save(&self, request: &Evaluate) -> anyhow::Result<Value> {
        let opened = self.flight(request.flight)?;
        let effects: Vec<_> = active(&request.effects)?.iter().map(|a| a.effect).collect();
        let (text, refitted) = opened.with(&effects)?;
        let mut answer = json!({"vehicle": {"name": refitted.path, "text": text}});
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
    /// The vehicle as opened and as refitted with these effects, or with none but recalibrated, each with its flight table: as given, learnt;
    /// and the vehicle file that was learnt.
    ///
    /// # Errors
    /// Nothing to fit, or a vehicle that no table can be made of.
    pub fn learnt(&self, request: &Fit) -> anyhow::Result<([(Model, Built); 2], Vehicle)> {
        let opened = self.flight(request.flight)?;
        let effects = request.effects.iter().map(|n| called(n)).collect::<anyhow::Result<Vec<_>>>()?;
        let (text, refitted) = opened.with(&effects)?;
        let both =
            |vehicle: &Vehicle, text: &str| anyhow::Ok((Model::of_coefficients(vehicle, 0)?, story::table_of(vehicle, text.as_bytes())?));
        Ok(([both(&opened.vehicle, &opened.vehicle.document.to_string())?, both(&refitted, &text)?], refitted))
    }
}
