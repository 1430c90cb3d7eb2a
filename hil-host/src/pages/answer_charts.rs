//! The charts of an answer, the same on the page, in the report and in print: what moved, what could hide, and how the error falls as
//! effects are added.

use crate::pages::chart::{Axis, Chart, Mark, Series};
use crate::pages::figure::Figure;
use discovery::diagnosis::Diagnosis;

/// Most effects of which it is drawn what could hide.
const MOST_HIDDEN: usize = 16;
/// Usual sizes of an effect beyond which a bar is cut: it could be of any size that matters.
const LONGEST_BAR: f64 = 3.0;

/// Names with blanks.
fn spaced(name: &str) -> String {
    name.replace('_', " ")
}

/// Forest plot of the numbers of the vehicle: beside its earlier dives where a history of it decides, else beside its file.
fn forest(found: &Diagnosis) -> Chart {
    let by_history = found.answered_by();
    let rows: Vec<(&str, [f64; 3], String)> = match by_history {
        Some(said) => said.moved().collect(),
        None => found.parts.moved_in_tolerances().collect(),
    };
    let (title, axis) = match by_history {
        Some(_) => ("What moved beside this vehicle's earlier dives", "from their mean, in standard deviations between dives (shaded: 1)"),
        None => ("What moved: vehicle file and this flight", "from the file's value, in tolerances of the file (shaded: 1)"),
    };
    let along = || (0..rows.len()).map(|i| i as f64);
    let known = Series::intervals("known scatter", Mark::Band, along().map(|i| (i, [0.0, -1.0, 1.0])));
    let here = Series::intervals("this flight, 90 %", Mark::Interval, along().zip(&rows).map(|(i, r)| (i, r.1)));
    let mut chart = Chart::new(title, Mark::Interval, "", Axis::new(axis, "")).with(known).with(here);
    chart.categories = rows.iter().map(|r| spaced(r.0)).collect();
    chart.labels = rows.into_iter().map(|r| r.2).collect();
    chart
}

/// The smallest size of each effect that this flight would have shown, in usual sizes of it.
fn hidden(found: &Diagnosis) -> Chart {
    let all = &found.parts.hidden[..found.parts.hidden.len().min(MOST_HIDDEN)];
    let rows = || all.iter().enumerate().map(|(i, h)| (i as f64, h));
    let usual = Series::intervals("usual size", Mark::Band, rows().map(|(i, _)| (i, [1.0, 0.0, 1.0])));
    let axis = Axis::new("least size named in 19 flights of 20, in usual sizes (shaded: 1; cut at 3)", "");
    let mut chart = Chart::new("What could hide", Mark::Bar, "", axis).with(usual).plus(
        "could hide",
        Mark::Bar,
        rows().map(|(i, h)| (i, (h.least / h.typical).min(LONGEST_BAR))),
    );
    chart.categories = all.iter().map(|h| spaced(h.effect)).collect();
    chart.labels = all.iter().map(|h| h.size_in_words()).collect();
    chart
}

/// Error as given, recalibrated, with each of the best hypotheses, and the floor.
#[must_use]
pub fn ladder(found: &Diagnosis) -> Chart {
    let heldout = found.block_error_m_s[0].is_finite();
    let errors = if heldout { found.block_error_m_s } else { found.fitted_error_m_s };
    let mut steps = vec![("as given".to_owned(), errors[0]), ("recalibrated".to_owned(), errors[1])];
    let of = |c: &discovery::diagnosis::Ranked| if heldout { c.error_check_m_s } else { c.error_fitted_m_s };
    // A hypothesis that was not refitted has no error of its own.
    let asked = found.candidates.iter().filter(|c| !c.effects.is_empty() && of(c).is_finite());
    steps.extend(asked.take(8).map(|c| (format!("with {}", spaced(&c.effects.join(" + "))), of(c))));
    steps.push(("floor: water and sensors alone".to_owned(), found.noise_floor_m_s));
    let (names, values): (Vec<String>, Vec<f64>) = steps.into_iter().map(|(name, error)| (name, 100.0 * error)).unzip();
    let title = format!("Error as effects are added, {} segments", if heldout { "held-out" } else { "fitted" });
    Chart::bars(&title, Axis::new("depth-rate error", "cm/s"), names, "error", &values, &[], &[])
}

/// What moved and what could hide, as far as anything is known of either.
#[must_use]
pub fn parts(found: &Diagnosis) -> Vec<Chart> {
    [forest(found), hidden(found)].into_iter().filter(|c| !c.categories.is_empty()).collect()
}

/// What moved and what could hide, one figure.
#[must_use]
pub fn forest_figure(found: &Diagnosis, flight: &str) -> Figure {
    let caption = format!(
        "Flight {flight}: {}. Points: this flight with 90 % intervals; what each number was and is stands at the right.",
        found.verdict.name()
    );
    Figure { panels: parts(found), caption }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pages::plots::Paper;
    use crate::score::diagnosis::write_case;
    use discovery::diagnosis::{diagnose, report};
    use discovery::hypotheses::search::Depth;
    use plant::trials::catalogue::{Effect, Strength};
    use plant::trials::{Site, Spec, Wing, generate};

    #[test]
    fn the_charts_of_an_answer_have_its_numbers() {
        let folder = std::env::temp_dir().join(format!("glider-answer-charts-{}", std::process::id()));
        let spec = Spec::single(Site::Lake, Wing::Standard, Effect::ClimbDrag, Strength::Strong);
        let case = write_case(&folder, &generate(&spec, 5, 0)).expect("a case can be written");
        let flight = logs::record::csv::flight(&case).expect("our own case reads");
        let vehicle = logs::vehicle::read(&case.join("vehicle.json")).expect("our own vehicle reads");
        std::fs::remove_dir_all(&folder).ok();
        let found = diagnose(&flight, &vehicle, Depth::Singles, &|_, _| {}).expect("it can be diagnosed");
        let document = report::document(&found, &vehicle, "case");
        let moved: Vec<&serde_json::Value> =
            document["moved"].as_array().expect("numbers").iter().filter(|n| n["low"].is_number()).collect();
        let chart = forest(&found);
        assert!(moved.len() >= 8 && moved.len() == chart.categories.len(), "{:?}", chart.categories);
        for (i, n) in moved.iter().enumerate() {
            assert_eq!(n["name"].as_str().map(spaced).as_deref(), Some(chart.categories[i].as_str()));
            let (z, [y, low, high]) =
                (n["tolerances"].as_f64().expect("a number"), [chart.series[1].y[i], chart.series[1].low[i], chart.series[1].high[i]]);
            assert!((y - z).abs() < 1e-3 * z.abs().max(1.0) && low < y && y < high, "{n}: {low} {y} {high}");
        }
        assert!(
            found.parts.polar.len() == 20 && found.parts.polar.iter().all(|(_, [v, low, high])| low <= v && v <= high),
            "{:?}",
            found.parts.polar
        );
        let hides = hidden(&found);
        assert_eq!(hides.labels[0], found.parts.hidden[0].size_in_words());
        let steps = ladder(&found);
        assert!((steps.series[0].y.last().expect("a floor") - document["error"]["noise_floor"].as_f64().expect("a floor")).abs() < 1e-4);
        let svg = forest_figure(&found, "case").svg(&Paper::SCREEN).expect("drawn");
        for name in chart.categories.iter().chain(&hides.categories) {
            assert!(svg.contains(name), "{name}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
