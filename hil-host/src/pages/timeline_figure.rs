//! The numbers of a vehicle from dive to dive, drawn from what `glider timeline --json` prints.

use crate::pages::chart::{Chart, Mark, Series};
use crate::pages::figure::Figure;
use anyhow::Context as _;
use serde_json::Value;

/// Numbers that are drawn, from the first: drag, lift, trim, pitch, compressibility.
const DRAWN: usize = 5;

/// A panel for each number, missions one after another with a gap between them, changes that are named as lines.
///
/// # Errors
/// No timeline, or one without dives.
pub fn figure(missions: &[Value]) -> anyhow::Result<Figure> {
    let levels = missions.first().and_then(|m| m.pointer("/dives/0/levels")).and_then(Value::as_object);
    let levels = levels.context("no dives in it: name what `glider timeline --json` printed")?;
    let panels = levels.iter().take(DRAWN).map(|(name, level)| panel(missions, name, level["unit"].as_str().unwrap_or_default())).collect();
    let changes = missions.iter().flat_map(|m| m["changes"].as_array().into_iter().flatten());
    let named: Vec<String> = changes.map(sentence).collect();
    let named = if named.is_empty() { "No change is named.".to_owned() } else { named.join(" ") };
    Ok(Figure { panels, caption: format!("Levels relative to the vehicle file; bands hold 90 %. {named}") })
}

/// A change that is named, or the numbers that moved together without a name.
fn sentence(change: &Value) -> String {
    let size = |of: &Value| {
        let [number, unit] = ["number", "unit"].map(|key| of[key].as_str().unwrap_or_default().replace('_', " "));
        let [value, low, high] = ["value", "low", "high"].map(|key| of["size"][key].as_f64().unwrap_or(f64::NAN));
        format!("{number} {value:+.3} {unit} (90 %: {low:.3} to {high:.3})")
    };
    let moved: Vec<String> = change["moved"].as_array().into_iter().flatten().map(size).collect();
    let what = if moved.is_empty() { size(change) } else { moved.join("; ") };
    format!("{} from dive {}: {what}.", change["kind"].as_str().unwrap_or_default().replace('_', " "), change["dive"])
}

fn panel(missions: &[Value], name: &str, unit: &str) -> Chart {
    let title = name.replace('_', " ");
    let (mut value, mut lines, mut before) = (Vec::new(), Vec::new(), 0.0);
    for mission in missions {
        let first = before;
        for dive in mission["dives"].as_array().into_iter().flatten() {
            let of = |key: &str| dive["levels"][name][key].as_f64().unwrap_or(f64::NAN);
            before = first + dive["dive"].as_f64().unwrap_or(f64::NAN);
            value.push((before, [of("value"), of("low"), of("high")]));
        }
        value.push((f64::NAN, [f64::NAN; 3]));
        let changes = mission["changes"].as_array().into_iter().flatten().filter(|c| c["number"] == name);
        lines.extend(changes.filter_map(|c| {
            let dive = c["dive"].as_f64()?;
            Some((format!("{} from dive {dive}", c["kind"].as_str()?.replace('_', " ")), first + dive - 0.5))
        }));
    }
    let ends =
        value.iter().flat_map(|v| v.1).filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
    let chart = Chart::lines(&title, "dive", format!("{title}, {unit}").as_str())
        .plus("dive by dive", Mark::Line, value.iter().map(|v| (v.0, v.1[0])))
        .with(Series::intervals("90 %", Mark::Band, value));
    lines.into_iter().fold(chart, |chart, (name, x)| chart.plus(&name, Mark::Dashed, [(x, ends.0), (x, ends.1)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pages::plots::Paper;
    use serde_json::json;

    #[test]
    fn missions_follow_each_other_with_their_intervals_and_changes() {
        let dive =
            |n: u32, drag: f64| json!({"dive": n, "levels": {"drag": {"value": drag, "low": drag - 1.0, "high": drag + 2.0, "unit": "%"}}});
        let change = json!({"kind": "fouling", "number": "drag", "dive": 2, "size": {"value": 9.0, "low": 7.0, "high": 11.0}, "unit": "%"});
        let june = json!({"dives": [dive(1, 0.0), dive(2, 9.0)], "changes": [change]});
        let july = json!({"dives": [dive(1, 8.0), dive(2, null())], "changes": []});
        let drawn = figure(&[june, july]).expect("a figure");
        let [chart] = &drawn.panels[..] else { panic!("{} panels", drawn.panels.len()) };
        let dives: Vec<f64> = chart.series[0].x.iter().copied().filter(|x| x.is_finite()).collect();
        assert_eq!(dives, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!((chart.series[1].low[1], chart.series[1].high[1]), (8.0, 11.0));
        assert_eq!((chart.series[2].name.as_str(), chart.series[2].x[0]), ("fouling from dive 2", 1.5));
        assert!(drawn.caption.contains("fouling from dive 2: drag +9.000 % (90 %: 7.000 to 11.000)"), "{}", drawn.caption);
        assert!(drawn.svg(&Paper::SCREEN).expect("drawn").contains("fouling from dive 2"));
        assert!(figure(&[json!({"dives": []})]).is_err() && figure(&[]).is_err());
    }

    fn null() -> f64 {
        f64::NAN
    }
}
