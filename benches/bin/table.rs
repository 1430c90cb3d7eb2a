//! The table of ratios in docs/performance.md, made from what the measurements left behind.
//!
//! ```text
//! performance-table                  prints it
//! performance-table --page FILE      puts it between the markers of FILE
//! ```
//! `benches/run --docs` measures everything first.

use anyhow::{Context, bail, ensure};
use benches::{Figure, figures};
use std::collections::BTreeMap;

/// Lines of the page between which the table stands.
const MARKERS: (&str, &str) = ("<!-- performance: made by `benches/run --docs` -->", "<!-- performance: end -->");
/// Clock of the board, Hz.
const BOARD_HZ: f64 = 16e6;
/// Bits on the line for one byte, and bits per second of it.
const LINE: (f64, f64) = (10.0, 115_200.0);
/// World seconds per control cycle of the HIL flights.
const CYCLE_S: f64 = rig::seats::CYCLE_S;
/// Operations of one step of the flight model, counted by hand in `discovery::model::dynamics`: four stages of about 120, flop.
const STEP_FLOPS: f64 = 480.0;
/// Nanoseconds in a second: criterion's unit.
const NS: f64 = 1e9;

struct Figures(BTreeMap<String, Figure>);

impl Figures {
    fn get(&self, key: &str) -> Option<&Figure> {
        self.0.get(key)
    }

    fn value(&self, key: &str) -> Option<f64> {
        self.get(key).map(|f| f.value)
    }

    /// Seconds of one of criterion's medians.
    fn seconds(&self, key: &str) -> Option<f64> {
        self.value(key).map(|ns| ns / NS)
    }
}

/// With thousands apart: 2739 is 2,739; three digits below a hundred.
fn number(x: f64) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    if x.abs() < 1e5 && x == x.trunc() && x.abs() >= 10.0 || x.abs() >= 99.95 && x.abs() < 100.0 {
        // Whole as it is.
    } else if x.abs() < 100.0 {
        let places = (2.0 - x.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
        return format!("{x:.places$}");
    }
    // Two digits less than the number has would be noise beyond a million.
    let rounded = if x.abs() >= 1e5 { (x / 1e3).round() * 1e3 } else { x.round() };
    let digits = format!("{rounded:.0}");
    let mut out = String::new();
    for (i, d) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(d);
    }
    out
}

/// A time as a person says it.
fn time(seconds: f64) -> String {
    match seconds {
        s if s >= 120.0 => format!("{} min", number(s / 60.0)),
        s if s >= 1.0 => format!("{} s", number(s)),
        s if s >= 1e-3 => format!("{} ms", number(s * 1e3)),
        s if s >= 1e-6 => format!("{} µs", number(s * 1e6)),
        s => format!("{} ns", number(s * 1e9)),
    }
}

/// "× 4.25", "× 830 (710 to 960)".
fn times(ratio: f64) -> String {
    format!("× {}", number(ratio))
}

type Row = [String; 5];

fn row(what: &str, measured: String, compared: String, ratio: String, bound: String) -> Row {
    [what.to_owned(), measured, compared, ratio, bound]
}

fn board(f: &Figures) -> Option<Vec<Row>> {
    let of = |variant: &str, key: &str| f.value(&format!("{variant}.{key}"));
    let pair = |key: &str| Some((of("flown", key)?, of("libm", key)?, of("model", key)?));
    let (mean, worst, look) = (pair("cycle_mean")?, pair("cycle_worst")?, pair("look_up")?);
    let (step, flash, decode) = (pair("step_worst")?, pair("flash")?, of("flown", "decode")?);
    let ram = |variant: &str| Some(of(variant, "statics")? + of(variant, "stack")?);
    let cycle = BOARD_HZ * CYCLE_S;
    let bytes = f.value("wire.out").unwrap_or(f64::NAN);
    let alternatives = |what: (f64, f64, f64)| format!("{} with libm, {} with the model for its table", number(what.1), number(what.2));
    let ratios = |what: (f64, f64, f64)| format!("{}, {}", times(what.1 / what.0), times(what.2 / what.0));
    Some(vec![
        row(
            "whole control cycle on Cortex-M4F (decode, seal, table, law, encode), mean",
            format!("{} instructions", number(mean.0)),
            alternatives(mean),
            ratios(mean),
            format!("{:.2} % of a {CYCLE_S:.0} s cycle at 16 MHz", 100.0 * mean.0 / cycle),
        ),
        row(
            "the same, worst (aim ≤ 40,000)",
            format!("{} instructions", number(worst.0)),
            alternatives(worst),
            ratios(worst),
            format!("{:.2} % of a {CYCLE_S:.0} s cycle (aim ≤ 1 %)", 100.0 * worst.0 / cycle),
        ),
        row(
            "of it the law, worst",
            format!("{} instructions", number(step.0)),
            alternatives(step),
            ratios(step),
            "one point of the pitch search".into(),
        ),
        row(
            "look-up of lift and drag on Cortex-M4F",
            format!("{} instructions", number(look.0)),
            format!("{} for the model itself in f32", number(look.2)),
            times(look.2 / look.0),
            "four grid points, cubic weights".into(),
        ),
        row(
            "flash of the image (aim ≤ 262,144)",
            format!("{} bytes", number(flash.0)),
            alternatives(flash),
            ratios(flash),
            "a quarter of the chip's 1 MiB".into(),
        ),
        row(
            "RAM with the proven worst stack (aim ≤ 65,536)",
            format!("{} bytes", number(ram("flown")?)),
            alternatives((ram("flown")?, ram("libm")?, ram("model")?)),
            ratios((ram("flown")?, ram("libm")?, ram("model")?)),
            "half of the chip's 128 KiB".into(),
        ),
        row(
            "decoding a sensor frame on Cortex-M4F",
            format!("{} instructions", number(decode)),
            format!("{} to receive its {bytes:.0} bytes", time(bytes * LINE.0 / LINE.1)),
            times(bytes * LINE.0 / LINE.1 * BOARD_HZ / decode),
            "line rate, 115,200 Bd".into(),
        ),
    ])
}

fn flights(f: &Figures) -> Option<Vec<Row>> {
    let seconds = f.value("mission.seconds")?;
    let bytes = f.value("wire.out")? + f.value("wire.back")?;
    let real = |seat: &str| Some(seconds / f.seconds(&format!("mission.{seat}"))?);
    let (own, plant, law) = (real("in-process")?, f.seconds("step.plant")?, f.seconds("step.control")? / f.value("mission.cycles")?);
    let line = CYCLE_S / (bytes * LINE.0 / LINE.1);
    let mut rows = vec![row(
        "plant and controller in one process (aim ≥ 100,000)",
        format!("{} × real time", number(own)),
        format!("a cycle: plant {}, law {}", time(plant), time(law)),
        String::new(),
        "the plant's 0.5 s steps; one core".into(),
    )];
    for (seat, name, aim, bound) in [
        ("pty", "lockstep through a pseudo-terminal", 10_000.0, "two wake-ups of a thread a cycle"),
        ("qemu", "lockstep with the image in QEMU", 100.0, "QEMU's serial line: one event of its main loop for a few bytes"),
    ] {
        let Some(times_real) = real(seat) else {
            rows.push(row(name, "not measured: no image or no QEMU".into(), String::new(), String::new(), String::new()));
            continue;
        };
        let trip = f.seconds(&format!("round-trip.{seat}"))?;
        rows.push(row(
            &format!("{name} (aim ≥ {})", number(aim)),
            format!("{} × real time", number(times_real)),
            format!("the line alone: {} a round trip", time(trip)),
            format!("{} a UART at 115,200 Bd", times(times_real / line)),
            bound.to_owned(),
        ));
    }
    Some(rows)
}

fn fits(f: &Figures) -> Option<Vec<Row>> {
    let error = |name: &str| f.value(&format!("fit.{name}.heldout")).map_or("–".to_owned(), |e| format!("{:.2} cm/s", 100.0 * e));
    let mut rows = Vec::new();
    for (ours, theirs, ratio, who, what) in [
        ("ours", "dynamic", "dynamic", "gliderflight, dynamic", "dynamic fit of a real flight of 4 h: calibration (aim ≥ 500)"),
        ("pair", "dynamic", "pair", "gliderflight, dynamic", "the same with the pair of effects that diagnosis ranks first"),
        ("ours", "steady", "steady", "gliderflight, steady", "calibration, compared with a steady fit"),
        ("ours", "sindy", "sindy", "pysindy", "calibration, compared with dynamics without physics"),
    ] {
        let of = |name: &str| f.get(&format!("fit.{name}"));
        let (Some(own), Some(other), Some(ratio)) = (of(ours), of(theirs), f.get(&format!("fit.{ratio}.ratio"))) else { continue };
        rows.push(row(
            what,
            format!("{}, held-out error {}", time(own.value), error(ours)),
            format!("{who}: {}, {}", time(other.value), error(theirs)),
            format!("× {} ({} to {})", number(ratio.value), number(ratio.low), number(ratio.high)),
            match (ours, theirs) {
                ("ours", "dynamic") => fit_bound(f).unwrap_or_default(),
                ("pair", _) => {
                    let calibrations = of("ours").map_or(f64::NAN, |o| own.value / o.value);
                    format!("{} calibrations: one, then each effect in turn with signatures taken anew", number(calibrations))
                }
                (_, "sindy") => "without physics it runs away when integrated".into(),
                _ => String::new(),
            },
        ));
    }
    Some(rows)
}

/// What one pass of the model over a 3 h log takes at the machine's own limits.
fn fit_bound(f: &Figures) -> Option<String> {
    let pass = f.seconds("3h-log.model-once")?;
    let (flight, vehicle) = benches::log(3.0, None).ok()?;
    let inputs: usize = discovery::preprocess::prepare(&flight, &vehicle).runs.iter().map(|r| r.inputs.len()).sum();
    // Two inputs a step: its ends are shared.
    let flops = inputs as f64 / 2.0 * STEP_FLOPS / f.value("limit.flops")?;
    let memory = (inputs * size_of::<discovery::preprocess::Input>()) as f64 / f.value("limit.bandwidth")?;
    Some(format!("a pass of the model over 3 h takes {}; its flops alone {}, its memory {}", time(pass), time(flops), time(memory)))
}

fn finding(f: &Figures) -> Option<Vec<Row>> {
    let three = f.seconds("3h-log.diagnose")?;
    let mut rows = vec![row(
        "diagnose a 3 h log, whole catalogue with pairs, one effect hidden (aim ≤ 1 s)",
        time(three),
        format!("a dynamic fit of it: {}", time(f.seconds("3h-log.dynamic-fit")?)),
        format!("{} fits", number(three / f.seconds("3h-log.dynamic-fit")?)),
        format!("{} passes of the model", number(three / f.seconds("3h-log.model-once")?)),
    )];
    if let Some(nothing) = f.seconds("3h-log.diagnose-nothing") {
        let passes = number(nothing / f.seconds("3h-log.model-once")?);
        rows.push(row(
            "the same with nothing missing",
            time(nothing),
            String::new(),
            String::new(),
            format!("{passes} passes of the model"),
        ));
    }
    if let (Some(median), Some(slowest), Some(count)) = (f.value("kinds.median"), f.value("kinds.slowest"), f.value("kinds.count")) {
        rows.push(row(
            &format!("each of {} effects hidden in turn, typical size", number(count)),
            format!("{} in the median, {} at most", time(median), time(slowest)),
            String::new(),
            String::new(),
            "how far the flight is from its model".into(),
        ));
    }
    if let (Some(day), Some(month), Some(base)) = (f.value("growth.24h"), f.value("growth.720h"), f.value("growth.3h")) {
        let exponent = |long: f64, short: f64, of: f64| (long / short).ln() / of.ln();
        rows.push(row(
            "one effect hidden, 24 h and 30 days",
            format!("{}, {}", time(day), time(month)),
            format!("3 h, once: {}", time(base)),
            format!("length^{:.2}, length^{:.2}", exponent(day, base, 8.0), exponent(month, day, 30.0)),
            "rows of the log".into(),
        ));
    }
    let cases = f.value("find.cases").unwrap_or(f64::NAN);
    let told = |name: &str| Some((f.value(&format!("find.{name}"))?, 100.0 * f.value(&format!("find.{name}.named"))?));
    if let Some((ours, share)) = told("ours") {
        for (name, who) in [("lasso", "scikit-learn LassoLarsIC"), ("abess", "abess")] {
            let Some((theirs, their_share)) = told(name) else { continue };
            rows.push(row(
                &format!("name the hidden effect, {cases:.0} sealed cases"),
                format!("{share:.0} % named, {}", time(ours)),
                format!("{who} on our signatures: {their_share:.0} %, {}", time(theirs)),
                times(theirs / ours),
                String::new(),
            ));
        }
    }
    Some(rows)
}

fn files(f: &Figures) -> Option<Vec<Row>> {
    let one = |what: &str, key: &str, note: &str| {
        let measured = f.seconds(key).map_or("not measured: no flights".to_owned(), time);
        row(what, measured, note.to_owned(), String::new(), String::new())
    };
    f.seconds("3h-log.compare")?;
    Some(vec![
        one("compare a 3 h log", "3h-log.compare", ""),
        one("write the report of a 3 h log", "3h-log.report", ""),
        one("import a 3 h log from NetCDF", "3h-log.import-netcdf", ""),
        one("import Slocum DBD and EBD files, 4 h", "real.import-dbd", ""),
        one("import a Seaglider dive (NetCDF)", "real.import-seaglider", ""),
    ])
}

fn main() -> anyhow::Result<()> {
    let f = Figures(figures()?);
    ensure!(!f.0.is_empty(), "nothing has been measured yet: `cargo bench -p benches`, `benches/on-target/run`, `benches/peers/run`");
    let mut text = String::from("| what | measured | compared with | ratio | bound |\n|---|---|---|---|---|\n");
    for rows in [board(&f), flights(&f), fits(&f), finding(&f), files(&f)].into_iter().flatten() {
        for r in rows {
            text += &format!("| {} |\n", r.join(" | "));
        }
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [] => print!("{text}"),
        ["--page", file] => {
            let before = std::fs::read_to_string(file).with_context(|| (*file).to_owned())?;
            let (head, rest) = before.split_once(MARKERS.0).with_context(|| format!("{file}: has no line `{}`", MARKERS.0))?;
            let (_, tail) = rest.split_once(MARKERS.1).with_context(|| format!("{file}: has no line `{}`", MARKERS.1))?;
            std::fs::write(file, format!("{head}{}\n\n{text}\n{}{tail}", MARKERS.0, MARKERS.1))?;
        }
        _ => bail!("performance-table [--page FILE]"),
    }
    Ok(())
}
