//! What a person reads in a terminal: 80 columns, the same four error figures everywhere, angles in degrees, as many digits as an
//! interval deserves.

use comfy_table::{ContentArrangement, Table, presets};
use console::style;
use discovery::diagnosis::Diagnosis;
use discovery::inference::estimate::Estimate;

/// Columns that are always there.
pub const COLUMNS: usize = 80;

/// A table that fits the terminal.
#[must_use]
pub fn table<H: Into<String>>(head: impl IntoIterator<Item = H>) -> Table {
    let mut t = Table::new();
    t.load_style(presets::UTF8_BORDERS_ONLY).set_content_arrangement(ContentArrangement::Dynamic).set_width(COLUMNS as u16);
    t.set_header(head.into_iter().map(Into::<String>::into));
    // The separator is a blank already: one more is enough.
    let last = t.column_count().saturating_sub(1);
    t.column_iter_mut().enumerate().for_each(|(i, c)| {
        c.set_padding((1, u16::from(i == last)));
    });
    t
}

/// A paragraph cut into lines of the terminal, all but the first set in.
#[must_use]
pub fn wrapped(text: &str, set_in: usize) -> String {
    wrapped_from(0, text, set_in)
}

/// The same where the first line begins at a column.
#[must_use]
pub fn wrapped_from(column: usize, text: &str, set_in: usize) -> String {
    let mut out = String::new();
    let (mut at, mut first) = (column, true);
    for word in text.split_whitespace() {
        let wide = word.chars().count();
        if !first && at + 1 + wide > COLUMNS {
            out.push('\n');
            out.extend(std::iter::repeat_n(' ', set_in));
            at = set_in;
        } else if !first {
            out.push(' ');
            at += 1;
        }
        out.push_str(word);
        (at, first) = (at + wide, false);
    }
    out
}

/// Lines as they are, but one that is wider than the terminal is cut at its words; what runs on is set in by two more.
#[must_use]
pub fn fitted(text: &str) -> String {
    let fit = |line: &str| {
        if console::measure_text_width(line) <= COLUMNS {
            return line.to_owned();
        }
        let set_in = line.len() - line.trim_start().len();
        format!("{:set_in$}{}", "", wrapped_from(set_in, line, set_in + 2))
    };
    text.lines().map(fit).collect::<Vec<_>>().join("\n")
}

/// What stands behind the options of a help, in lines of the terminal: examples as they are (a long one goes on in the next line, as a
/// shell reads it; its remark stands below), sentences filled.
#[must_use]
pub fn help_text(text: &str) -> String {
    let mut out: Vec<String> = Vec::new();
    // A line that is wider than the terminal was cut at the width of the source: the next goes on from it.
    let mut cut = false;
    for line in text.lines() {
        if line.starts_with("  ") {
            out.extend(example(line));
            cut = false;
        } else {
            match out.last_mut().filter(|_| cut) {
                Some(last) => *last += &format!(" {line}"),
                None => out.push(line.to_owned()),
            }
            cut = line.chars().count() > COLUMNS && !line.ends_with('.');
        }
    }
    out.iter().map(|l| if l.starts_with(' ') { l.clone() } else { wrapped(l, 0) }).collect::<Vec<_>>().join("\n")
}

/// An example in lines of the terminal.
fn example(line: &str) -> Vec<String> {
    if line.chars().count() <= COLUMNS {
        return vec![line.to_owned()];
    }
    let (line, remark) = line.trim_start().split_once("   ").unwrap_or((line.trim_start(), ""));
    let mut out = vec![String::from(" ")];
    for word in line.split(' ').filter(|w| !w.is_empty()) {
        let last = out.last().map_or(0, |l| l.chars().count());
        if last + 1 + word.chars().count() + 2 > COLUMNS {
            out.last_mut().into_iter().for_each(|l| l.push_str(" \\"));
            out.push("     ".into());
        }
        out.last_mut().into_iter().for_each(|l| *l += &format!(" {word}"));
    }
    let remark = remark.trim();
    out.extend((!remark.is_empty()).then(|| format!("      {}", wrapped_from(6, remark, 6))));
    out
}

/// Prints a line with its label, what runs on set in below.
pub fn row(label: &str, text: &str) {
    println!("{label:<15}{}", wrapped_from(15, text, 15));
}

/// Prints lines that fit the terminal.
pub fn say(text: &str) {
    println!("{}", fitted(text));
}

/// The depth-rate error of a flight, step by step. The names are those of every command and page.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// Of the vehicle file as it stands, m/s.
    pub as_given: f64,
    /// With its numbers refitted inside their tolerances, no effect added, m/s.
    pub recalibrated: Option<f64>,
    /// With these effects, m/s.
    pub with: Option<(String, f64)>,
    /// What ordinary water motion and sensor noise alone would leave, m/s, as a fit to the flight finds it; none: nothing was fitted.
    pub floor: Option<f64>,
    /// Whether the figures are of segments kept out of the fit.
    pub held_out: bool,
}

impl Ladder {
    /// That of a diagnosis.
    #[must_use]
    pub fn of(found: &Diagnosis) -> Self {
        let held_out = found.block_error_m_s[0].is_finite();
        let [as_given, recalibrated, after] = if held_out { found.block_error_m_s } else { found.fitted_error_m_s };
        let with = (!found.answer.is_empty()).then(|| (found.answer.join(" + "), after));
        Self { as_given, recalibrated: Some(recalibrated), with, floor: Some(found.noise_floor_m_s), held_out }
    }

    /// As bars.
    #[must_use]
    pub fn text(&self) -> String {
        let mut steps = vec![("as given".to_owned(), self.as_given)];
        steps.extend(self.recalibrated.map(|e| ("recalibrated".to_owned(), e)));
        steps.extend(self.with.iter().map(|(names, e)| (format!("with {names}"), *e)));
        steps.extend(self.floor.map(|e| ("floor".to_owned(), e)));
        let most = steps.iter().map(|s| s.1).filter(|e| e.is_finite()).fold(1e-9, f64::max);
        let wide = steps.iter().map(|s| s.0.chars().count()).max().unwrap_or(0).min(44);
        let of = if self.held_out { "segments kept out of the fit" } else { "fitted segments" };
        let mut out = format!("Depth-rate error in cm/s, {of}:\n");
        for (name, error) in steps {
            let bar = "█".repeat((24.0 * error / most).round().max(0.0) as usize);
            out += &format!("  {name:<wide$} {:>7.3}  {}\n", 100.0 * error, style(bar).cyan());
        }
        for remark in self.remarks() {
            out += &format!("{}\n", wrapped(remark, 0));
        }
        out
    }

    /// What a reader would stumble over: steps that are not in the order of a ladder.
    fn remarks(&self) -> Vec<&'static str> {
        let least = self.with.as_ref().map(|w| w.1).or(self.recalibrated).unwrap_or(self.as_given);
        let mut out = Vec::new();
        if self.recalibrated.is_some_and(|r| r > self.as_given) {
            out.push("Recalibrated is above as given: the fit is to all that was measured, not to this error alone.");
        }
        if self.floor.is_some_and(|floor| least < floor) {
            out.push("Below the floor: water or sensors were quieter than the vehicle file states.");
        }
        out
    }
}

/// A number with as many decimals as its interval deserves: two digits of its width.
#[must_use]
pub fn rounded(value: f64, low: f64, high: f64) -> String {
    let width = high - low;
    let places = if width.is_finite() && width > 0.0 { (1.0 - width.log10().floor()).clamp(0.0, 9.0) as usize } else { 4 };
    format!("{value:.places$}")
}

/// A parameter with its 90 % interval, angles in degrees.
#[must_use]
pub fn parameter(p: &Estimate) -> String {
    let (factor, unit) = if p.unit == "rad" { (1f64.to_degrees(), "°") } else { (1.0, p.unit) };
    let [value, low, high] = [p.value, p.low, p.high].map(|v| rounded(v * factor, p.low * factor, p.high * factor));
    let unit = match unit {
        "1" => String::new(),
        "°" => "°".to_owned(),
        unit => format!(" {unit}"),
    };
    format!("{} = {value}{unit} (90 %: {low} to {high})", p.name)
}

/// Where most of a finding's error is, in words or degrees.
#[must_use]
pub fn place(f: &discovery::criticism::localise::Finding) -> String {
    let yes = f.range.0 > 0.5;
    match (f.variable, yes) {
        ("dive_or_climb", true) => "dives".into(),
        ("dive_or_climb", false) => "climbs".into(),
        ("steady_or_turning", true) => "steady flight".into(),
        ("steady_or_turning", false) => "turns".into(),
        _ => range(f.range, f.unit),
    }
}

/// A parameter of an effect with the range a fit may reach, angles in degrees.
#[must_use]
pub fn parameter_range(p: &hydro::effects::Parameter) -> String {
    let (factor, unit) = if p.unit == "rad" { (1f64.to_degrees(), "°") } else { (1.0, p.unit) };
    let short = |v: f64| format!("{}", (v * factor * 1e3).round() / 1e3);
    let unit = if unit == "1" { "" } else { unit };
    format!("{}: {} to {} {unit}, off at {}, remarkable from about {}", p.name, short(p.low), short(p.high), short(p.off), short(p.typical))
}

/// A range of a variable, angles in degrees.
#[must_use]
pub fn range((low, high): (f64, f64), unit: &str) -> String {
    let (factor, unit) = if unit == "rad" { (1f64.to_degrees(), "°") } else { (1.0, unit) };
    let [a, b] = [low, high].map(|v| rounded(v * factor, low * factor, high * factor));
    match unit {
        "1" => format!("{a} to {b}"),
        "°" => format!("{a}° to {b}°"),
        unit => format!("{a} to {b} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_that_the_interval_deserves() {
        let p = |value, low, high, unit| parameter(&Estimate { name: "a.k".into(), value, low, high, unit });
        assert_eq!(p(31.9437, 20.2933, 43.594, "1/rad^2"), "a.k = 32 1/rad^2 (90 %: 20 to 44)");
        assert_eq!(p(0.0203, 0.0188, 0.0218, "rad"), "a.k = 1.16° (90 %: 1.08 to 1.25)");
        assert_eq!(p(0.4464, 0.44, 0.4528, "1"), "a.k = 0.446 (90 %: 0.440 to 0.453)");
        assert_eq!(range((-0.320, -0.220), "rad"), "-18.3° to -12.6°");
    }

    #[test]
    fn nothing_is_wider_than_the_terminal() {
        let text = wrapped(&"word and another ".repeat(30), 4);
        assert!(text.lines().count() > 3 && text.lines().all(|l| l.chars().count() <= COLUMNS), "{text}");
        let text = fitted(&format!("short   as it is\n    {}", "word and another ".repeat(30)));
        assert!(text.lines().count() > 3 && text.lines().all(|l| l.chars().count() <= COLUMNS), "{text}");
        assert!(text.starts_with("short   as it is\n    word") && text.lines().nth(2).is_some_and(|l| l.starts_with("      ")), "{text}");
        let ladder =
            Ladder { as_given: 0.01, recalibrated: Some(0.004), with: Some(("x".repeat(40), 0.002)), floor: Some(0.001), held_out: true };
        assert!(ladder.text().lines().all(|l| console::measure_text_width(l) <= COLUMNS), "{}", ladder.text());
    }

    #[test]
    fn a_help_keeps_its_examples_and_fills_its_sentences() {
        let long = format!("  glider add {}--out v2.json", "--flight may.csv ".repeat(6));
        let remarked = format!("  glider import raw/ --out flight          {}", "every file of a folder, ".repeat(3));
        let text = help_text(&format!(
            "Examples:\n  glider fly\n{long}\n{remarked}\n\nOne {}that a\nline cuts.\nExit code 1: none.",
            "word ".repeat(18)
        ));
        assert!(text.lines().all(|l| l.chars().count() <= COLUMNS), "{text}");
        assert!(text.starts_with("Examples:\n  glider fly\n  glider add --flight may.csv") && text.contains(" \\\n      "), "{text}");
        assert!(text.contains("\n  glider import raw/ --out flight\n      every file"), "{text}");
        assert!(text.ends_with("word that a line cuts.\nExit code 1: none."), "{text}");
    }

    #[test]
    fn steps_out_of_order_are_explained_and_others_are_not() {
        let ladder = |as_given, recalibrated, with, floor| Ladder {
            as_given,
            recalibrated: Some(recalibrated),
            with: Some(("stall".into(), with)),
            floor: Some(floor),
            held_out: true,
        };
        assert!(ladder(0.9, 0.5, 0.3, 0.2).remarks().is_empty());
        assert_eq!(ladder(0.9, 0.5, 0.1, 0.2).remarks().len(), 1);
        assert!(ladder(0.9, 0.5, 0.1, 0.2).text().contains("Below the floor"));
        assert!(ladder(0.4, 0.5, 0.3, 0.2).text().contains("above as given"));
        let alone = Ladder { recalibrated: None, with: None, floor: None, held_out: false, ..ladder(0.9, 0.5, 0.3, 0.2) };
        assert!(alone.text().contains("fitted segments") && !alone.text().contains("floor"), "{}", alone.text());
    }
}
