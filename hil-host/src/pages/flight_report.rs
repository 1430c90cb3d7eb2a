//! The page of one flight: how wrong the model is, where, why, what next; then
//! everything a person would check before believing it.

use crate::pages::answer_charts;
use crate::pages::chart::map_of_means;
use crate::pages::{Axis, Chart, Item, Mark, Page, Provenance, Section, Series, Table};
use crate::terminal::place;
use discovery::criticism::localise::{Residual, VARIABLES, residuals};
use discovery::diagnosis::report;
use discovery::diagnosis::{Diagnosis, Ranked};
use discovery::likelihood::block_error::{blocks, modelled_m_s};
use discovery::model::dynamics::Track;
use discovery::model::parameters::{NINETY, State, law};
use discovery::preprocess::Prepared;
use hydro::effects::{Active, Constants, Flow, ForceModel};
use logs::Vehicle;

/// Group of charts that share the time axis.
const TIME: &str = "time";

/// Builds the page.
#[must_use]
pub fn page(found: &Diagnosis, vehicle: &Vehicle, flight: &str, provenance: Provenance) -> Page {
    let (nominal, recalibrated, after) = (State::nominal(), &found.recalibrated, &found.after);
    let seen = Seen::new(found, vehicle, &[&nominal, recalibrated, after]);
    Page {
        title: format!("{flight}: model against measurement"),
        answer: answer(found, vehicle),
        sections: vec![
            four_parts(found),
            traces(&seen, found.block_s),
            where_it_fails(&seen),
            why(found),
            glide(found, vehicle, &seen),
            Section { title: "Notes".into(), lead: String::new(), items: found.notes.iter().map(|n| n.as_str().into()).collect() },
        ],
        provenance,
    }
}

/// What a person reads a unit in, and the factor to it.
fn shown_in(unit: &str) -> (f64, &str) {
    if unit == "rad" { (1f64.to_degrees(), "°") } else { (1.0, unit) }
}

/// Decimals that show three digits of the larger end of a range: no bin is finer.
fn places(low: f64, high: f64) -> usize {
    (2.0 - low.abs().max(high.abs()).max(1e-3).log10().floor()).clamp(0.0, 5.0) as usize
}

/// With a large first letter and a full stop.
fn in_a_sentence(text: &str) -> String {
    let (first, rest) = text.split_at(text.chars().next().map_or(0, char::len_utf8));
    format!("{}{}.", first.to_uppercase(), rest.trim_end_matches('.'))
}

fn answer(found: &Diagnosis, vehicle: &Vehicle) -> Vec<(String, String)> {
    let heldout = found.block_error_m_s[0].is_finite();
    let [nominal, recalibrated, after] = if heldout { found.block_error_m_s } else { found.fitted_error_m_s }.map(|e| e * 100.0);
    let data = if heldout { "on segments kept out of the fit" } else { "on the fitted segments" };
    let mut how = format!("{nominal:.3} cm/s as given, {recalibrated:.3} recalibrated");
    if !found.answer.is_empty() {
        how += &format!(", {after:.3} with {}", found.answer.join(" + "));
    }
    how += &format!(" ({data}); floor {:.3}", found.noise_floor_m_s * 100.0);
    let worst = report::where_it_fails(found, vehicle, &found.recalibrated).first().map_or_else(
        || "Nowhere in particular.".to_owned(),
        |f| {
            let chance = if f.p_value > 0.05 { " – chance would do as well" } else { "" };
            let variable = f.variable.replace('_', " ");
            format!(
                "{variable}, {}, {}: {:.0} % of the squared error of the recalibrated model{chance}",
                place(f),
                f.phase,
                100.0 * f.share_of_error
            )
        },
    );
    let parts = report::four_parts(found).map(|(part, text)| (part, in_a_sentence(&text)));
    [("How wrong", how), ("Where", worst)].into_iter().chain(parts).map(|(k, v)| (k.to_owned(), v)).collect()
}

/// What to take from each run's time so that the time axis shows only time under way, with a minute between runs.
#[must_use]
pub fn under_way(prepared: &Prepared) -> Vec<f64> {
    const PAUSE_S: f64 = 60.0;
    let mut next = 0.0;
    let mut shifts = Vec::with_capacity(prepared.runs.len());
    for run in &prepared.runs {
        let (first, last) = (run.time_s.first().copied().unwrap_or(0.0), run.time_s.last().copied().unwrap_or(0.0));
        shifts.push(first - next);
        next += last - first + PAUSE_S;
    }
    shifts
}

/// Whether blocks were dropped before each of these (times of their starts): no line is to be drawn across.
#[must_use]
pub fn gaps(starts_s: &[f64]) -> Vec<bool> {
    let steps: Vec<f64> = starts_s.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = logs::record::plausible::quantile(&steps, 0.5);
    std::iter::once(false).chain(steps.iter().map(|s| *s > 2.5 * usual)).take(starts_s.len()).collect()
}

/// What the models said, block by block.
struct Seen {
    /// Time from the start, s; a gap after each run.
    time_s: Vec<f64>,
    depth_m: Vec<f64>,
    observed: Vec<f64>,
    /// Of each state, cm/s.
    modelled: Vec<Vec<f64>>,
    /// Residuals of the first and of the last state.
    before: Vec<Residual>,
    after: Vec<Residual>,
    /// Measured depth rate of each residual, m/s.
    sink_m_s: Vec<f64>,
    /// Moment of each residual on the time axis, s.
    moments_s: Vec<f64>,
    alpha_deg: Vec<f64>,
}

impl Seen {
    fn new(found: &Diagnosis, vehicle: &Vehicle, states: &[&State]) -> Self {
        let mut seen = Self {
            time_s: Vec::new(),
            depth_m: Vec::new(),
            observed: Vec::new(),
            modelled: vec![Vec::new(); states.len()],
            before: Vec::new(),
            after: Vec::new(),
            sink_m_s: Vec::new(),
            moments_s: Vec::new(),
            alpha_deg: Vec::new(),
        };
        for (run, shift) in found.prepared.runs.iter().zip(under_way(&found.prepared)) {
            let tracks: Vec<Track> = found.branch.tracks(run, vehicle, states);
            let cut = blocks(run);
            let starts: Vec<f64> = cut.iter().map(|b| run.time_s[b.rows[0]]).collect();
            for (b, gap) in cut.iter().zip(gaps(&starts)) {
                let middle = b.rows[b.rows.len() / 2];
                if gap {
                    seen.gap_at(run.time_s[b.rows[0]] - shift);
                }
                seen.time_s.push(run.time_s[middle] - shift);
                seen.moments_s.push(run.time_s[middle] - shift);
                seen.sink_m_s.push(b.observed_m_s);
                seen.depth_m.push(run.depth_m[middle]);
                seen.observed.push(100.0 * b.observed_m_s);
                for (column, t) in seen.modelled.iter_mut().zip(&tracks) {
                    column.push(100.0 * modelled_m_s(run, b, &t.depth_m));
                }
                seen.alpha_deg.push(tracks[0].alpha_rad[middle].to_degrees().abs());
            }
            if let (Some(first), Some(last)) = (tracks.first(), tracks.last()) {
                seen.before.extend(residuals(run, &cut, first));
                seen.after.extend(residuals(run, &cut, last));
            }
            // A gap, so that no line joins two segments.
            seen.gap_at(run.time_s.last().map_or(f64::NAN, |t| t - shift));
        }
        seen
    }

    /// L/D of steady dives by whole degrees of angle of attack: its mean, and the 90 % interval of that.
    fn measured_l_over_d(&self) -> Vec<(f64, [f64; 3])> {
        /// Fewest blocks that a mean is taken of.
        const FEWEST: usize = 5;
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (r, sink) in self.after.iter().zip(&self.sink_m_s).filter(|(r, _)| r.down && r.steady) {
            let (alpha_deg, speed) = (r.values[0].to_degrees().abs(), r.values[1]);
            if *sink > 0.0 && speed > *sink && alpha_deg < 20.0 {
                points.push((alpha_deg, (speed * speed - sink * sink).sqrt() / sink));
            }
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let groups = points.chunk_by(|a, b| a.0.floor() == b.0.floor()).filter(|g| g.len() >= FEWEST);
        let mean = |g: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| g.iter().map(of).sum::<f64>() / g.len() as f64;
        groups.map(|g| (mean(g, |p| p.0), with_interval(&g.iter().map(|p| p.1).collect::<Vec<_>>()))).collect()
    }

    fn gap_at(&mut self, time_s: f64) {
        self.time_s.push(time_s);
        self.depth_m.push(f64::NAN);
        self.observed.push(f64::NAN);
        self.modelled.iter_mut().for_each(|m| m.push(f64::NAN));
    }
}

/// What moved and what could hide, as the figure of `glider plot forest`.
fn four_parts(found: &Diagnosis) -> Section {
    Section {
        title: "What moved, what could hide".into(),
        lead: "Each number with its 90 % interval, and the least size of each effect that this flight would have shown.".into(),
        items: answer_charts::parts(found).into_iter().map(Into::into).collect(),
    }
}

fn traces(seen: &Seen, block_s: f64) -> Section {
    let time = || Axis::new("time under way", "s");
    let depth =
        Chart::new("Depth", Mark::Line, time(), Axis::new("depth", "m").down()).with(Series::new("measured", &seen.time_s, &seen.depth_m));
    let names = ["model as given", "recalibrated", "after"];
    let mut rate = Chart::new(&format!("Depth rate in {block_s:.0} s blocks"), Mark::Line, time(), Axis::new("depth rate", "cm/s"))
        .with(Series::new("measured", &seen.time_s, &seen.observed));
    let mut residual = Chart::new("Residual (measured minus model)", Mark::Line, time(), Axis::new("residual", "cm/s"));
    for (name, model) in names.iter().zip(&seen.modelled) {
        rate = rate.with(Series::new(name, &seen.time_s, model));
        let r: Vec<f64> = seen.observed.iter().zip(model).map(|(o, m)| o - m).collect();
        residual = residual.with(Series::new(name, &seen.time_s, &r));
    }
    Section {
        title: "Traces".into(),
        lead: "Drag to zoom, double-click to see all; with the keyboard: tab to a chart, plus and minus.".into(),
        items: [depth, rate, residual].into_iter().map(|c| c.grouped(TIME).into()).collect(),
    }
}

/// Mean of blocks and its 90 % interval; neighbouring blocks are alike, so the interval is widened by half.
fn with_interval(values: &[f64]) -> [f64; 3] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let half = NINETY * 1.5 * (variance / n).sqrt();
    [mean, mean - half, mean + half]
}

/// Bins of equal count of one variable: centre, mean residual and its 90 % interval, cm/s.
fn binned(residuals: &[Residual], variable: usize, factor: f64) -> (Vec<String>, Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut pairs: Vec<(f64, f64)> = residuals
        .iter()
        .map(|r| (factor * r.values[variable], 100.0 * r.residual_m_s))
        .filter(|(v, r)| v.is_finite() && r.is_finite())
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = pairs.len().div_ceil(8).max(1);
    let (mut names, mut mean, mut low, mut high) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for bin in pairs.chunks(size).filter(|b| b.len() > 2) {
        let [m, l, h] = with_interval(&bin.iter().map(|p| p.1).collect::<Vec<_>>());
        let (from, to) = (bin[0].0, bin[bin.len() - 1].0);
        let places = places(from, to);
        names.push(format!("{from:.places$} – {to:.places$}"));
        mean.push(m);
        low.push(l);
        high.push(h);
    }
    (names, mean, low, high)
}

fn where_it_fails(seen: &Seen) -> Section {
    let alpha =
        |list: &[Residual]| -> (Vec<f64>, Vec<f64>) { list.iter().map(|r| (r.values[0].to_degrees(), 100.0 * r.residual_m_s)).unzip() };
    let (bx, by) = alpha(&seen.before);
    let (ax, ay) = alpha(&seen.after);
    let scatter =
        Chart::new("Residual against angle of attack", Mark::Point, Axis::new("angle of attack", "°"), Axis::new("residual", "cm/s"))
            .with(Series::new("as given", &bx, &by))
            .with(Series::new("after", &ax, &ay))
            .following(TIME, seen.moments_s.clone(), Vec::new());
    let column = |k: usize, factor: f64| -> Vec<f64> { seen.before.iter().map(|r| factor * r.values[k]).collect() };
    let residual: Vec<f64> = seen.before.iter().map(|r| 100.0 * r.residual_m_s).collect();
    let map = |title: &str, x: (Axis, Vec<f64>), y: (Axis, Vec<f64>), cells: (usize, usize)| {
        let means = map_of_means([&x.1, &y.1, &residual], cells);
        Chart::new(title, Mark::Map, x.0, y.0).with(means).following(TIME, seen.moments_s.clone(), vec![x.1, y.1])
    };
    let alpha = (Axis::new("angle of attack", "°"), column(0, 1f64.to_degrees()));
    let (speed, depth) = ((Axis::new("speed", "m/s"), column(1, 1.0)), (Axis::new("depth", "m").down(), column(2, 1.0)));
    let time = (Axis::new("time under way", "s"), seen.moments_s.clone());
    let mut items: Vec<Item> = vec![
        scatter.into(),
        map("Mean residual of the model as given", alpha, speed, (14, 8)).into(),
        map("Mean residual of the model as given, by time and depth", time, depth, (28, 8)).into(),
    ];
    for (k, (name, unit)) in VARIABLES.iter().enumerate().take(7) {
        let (factor, unit) = shown_in(unit);
        let (names, mean, low, high) = binned(&seen.before, k, factor);
        if names.len() > 1 {
            let title = format!("Mean residual of the model as given by {} ({unit})", name.replace('_', " "));
            items.push(Chart::bars(&title, Axis::new("residual", "cm/s"), names, "mean", &mean, &low, &high).into());
        }
    }
    Section {
        title: "Where it fails".into(),
        lead: "Bars are means of bins of equal count with 90 % intervals; a bar whose interval leaves zero is where the model as given is wrong.".into(),
        items,
    }
}

fn name_of(c: &Ranked) -> String {
    c.effects.join(" + ")
}

fn why(found: &Diagnosis) -> Section {
    let rows = found
        .candidates
        .iter()
        .map(|c| {
            let numbers: Vec<String> = c
                .parameters
                .iter()
                .map(|p| {
                    format!("{} = {:.4} [{:.4}, {:.4}] {}", p.name, p.value, p.low, p.high, if p.unit == "1" { "" } else { p.unit })
                        .trim_end()
                        .to_owned()
                })
                .collect();
            let cm = |v: f64| if v.is_finite() { format!("{:.3}", 100.0 * v) } else { "–".into() };
            vec![
                name_of(c),
                format!("{:.1} %", 100.0 * c.probability),
                format!("{:+.1}", c.log_odds),
                cm(c.error_fitted_m_s),
                cm(c.error_check_m_s),
                numbers.join("; "),
            ]
        })
        .take(40)
        .collect();
    let head = ["effects", "probability", "log odds", "error fitted (cm/s)", "error held out (cm/s)", "parameters with 90 % interval"];
    let table = Table { caption: "All that was asked, best first".into(), head: head.map(Into::into).to_vec(), rows };
    let mut items: Vec<Item> = vec![answer_charts::ladder(found).into()];
    if found.equivalent.len() > 1 {
        let tied: Vec<String> = found.equivalent.iter().map(|e| e.join(" + ")).collect();
        items.push(format!("Cannot be distinguished with this flight: {}.", tied.join("; ")).as_str().into());
    }
    items.push(table.into());
    Section { title: "Why".into(), lead: format!("Verdict: {}.", found.verdict.name()), items }
}

/// L/D in a dive at 0.3 m/s over angles of attack.
pub(crate) fn l_over_d((constants, effects): &(Constants, Vec<Active>), degrees: &[f64]) -> Vec<f64> {
    let model = ForceModel::new(*constants, effects);
    // 0.3 m/s: a shallow glider's speed, where a speed-dependent effect is at its reference.
    let at = |d: &f64| model.coefficients(&Flow { climb_m_s: -0.1, ..Flow::steady(d.to_radians(), 0.3) });
    degrees.iter().map(at).map(|c| c.cl / c.cd).collect()
}

/// L/D as given, recalibrated with its 90 % band, and with what was found, and what the flight itself measured.
#[must_use]
pub fn polar(found: &Diagnosis, vehicle: &Vehicle) -> Chart {
    polar_by(found, vehicle, &Seen::new(found, vehicle, &[&found.after]))
}

fn polar_by(found: &Diagnosis, vehicle: &Vehicle, seen: &Seen) -> Chart {
    let degrees: Vec<f64> = (1..=80).map(|i| f64::from(i) * 0.25).collect();
    let of = |name: &str, state: &State| Series::new(name, &degrees, &l_over_d(&law(vehicle, state), &degrees));
    let band = found.parts.polar.iter().map(|(alpha, ends)| (alpha.to_degrees(), *ends));
    let measured = Series::intervals("measured depth rate at the model's speed, 90 %", Mark::Interval, seen.measured_l_over_d());
    Chart::new("L/D in a dive at 0.3 m/s", Mark::Line, Axis::new("angle of attack", "°"), Axis::new("L/D", ""))
        .with(of("as given", &State::nominal()))
        .with(of("after", &found.after))
        .with(Series::intervals("90 %", Mark::Band, band))
        .with(measured)
}

fn glide(found: &Diagnosis, vehicle: &Vehicle, seen: &Seen) -> Section {
    let curve = polar_by(found, vehicle, seen);
    let share: Vec<f64> = (0..20)
        .map(|i| {
            let inside = seen.alpha_deg.iter().filter(|a| (f64::from(i)..f64::from(i + 1)).contains(a)).count();
            100.0 * inside as f64 / seen.alpha_deg.len().max(1) as f64
        })
        .collect();
    let names = (0..20).map(|i| format!("{i}–{} °", i + 1)).collect();
    let flown = Chart::bars(
        "Where the flight was: |angle of attack| of the model",
        Axis::new("share of blocks", "%"),
        names,
        "share",
        &share,
        &[],
        &[],
    );
    Section {
        title: "Glide".into(),
        lead: "What the finding means for lift-to-drag ratio, and which angles this flight has tried.".into(),
        items: vec![curve.into(), flown.into()],
    }
}
