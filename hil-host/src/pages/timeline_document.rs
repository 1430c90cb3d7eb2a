//! The document of `glider timeline`: dives, changes, and what each dive says compared with those before it.

use discovery::diagnosis::report::number;
use discovery::history::kinds::KINDS;
use discovery::history::mission::Compared;
use discovery::history::numbers::ALL;
use discovery::history::shown::{LEVELS_SHOWN, name_and_unit, place};
use discovery::workbench::timeline::{Event, Level, Row, Timeline};
use serde_json::{Value, json};
use std::path::Path;

fn level(l: &Level) -> Value {
    json!({"value": number(l.value), "low": number(l.low), "high": number(l.high)})
}

/// What `glider timeline --json` prints, of a mission judged by this vehicle file.
#[must_use]
pub fn document(done: &Timeline, vehicle: &Path) -> Value {
    let levels = |all: &[Level]| -> Value {
        let list = LEVELS_SHOWN.iter().zip(all).map(|(t, l)| {
            let mut v = level(l);
            v["unit"] = t.unit.into();
            (t.name.to_owned(), v)
        });
        Value::Object(list.collect())
    };
    let change = |e: &Event| {
        let t = &LEVELS_SHOWN[place(e.change.kind.number)];
        let moved: Vec<Value> = e
            .several
            .iter()
            .map(|(column, size)| {
                let (name, unit) = name_and_unit(*column);
                json!({"number": name, "size": level(size), "unit": unit})
            })
            .collect();
        let others: Vec<Value> = e
            .others
            .iter()
            .map(|(c, size)| {
                let t = &LEVELS_SHOWN[place(c.kind.number)];
                json!({"kind": c.kind.name, "number": t.name, "dive": c.onset + 1, "size": level(size), "unit": t.unit})
            })
            .collect();
        json!({
            "kind": e.name(), "about": e.about(), "number": t.name, "shape": e.change.kind.shape.id(),
            "dive": e.dive, "dive_low": e.between.0, "dive_high": e.between.1, "day": number(e.day),
            "size": level(&e.size), "unit": t.unit, "per_day": e.per_day.map(number), "range_percent": e.range_percent.map(number),
            "strength_sigma": number(e.change.strength), "equivalent": others, "moved": moved,
        })
    };
    let dives: Vec<Value> = done
        .rows
        .iter()
        .map(|r| {
            json!({
                "dive": r.number, "flight": r.flight, "segment": r.segment, "day": number(r.day), "depth_m": number(r.depth_m),
                "rows": r.rows, "levels": levels(&r.levels),
            })
        })
        .collect();
    let scatter: serde_json::Map<String, Value> =
        LEVELS_SHOWN.iter().zip(done.scatter).map(|(t, s)| (t.name.to_owned(), number(s))).collect();
    json!({
        "vehicle": vehicle.display().to_string(), "dives": dives, "changes": done.events.iter().map(change).collect::<Vec<_>>(),
        "start": levels(&done.start), "scatter_1sigma": scatter, "threshold_sigma": number(done.threshold),
        "expected_false_alarms": number(done.expected_false_alarms),
        "false_alarms_per_1000_dives": number(1000.0 * done.expected_false_alarms / done.rows.len().max(1) as f64),
        "kinds": KINDS.iter().map(|k| k.name).collect::<Vec<_>>(),
        "history": done.rows.iter().map(history).collect::<Vec<_>>(),
        "notes": done.notes,
    })
}

/// What a dive says compared with the quiet ones before it.
fn history(r: &Row) -> Value {
    let class = |c: &Compared| c.judgement.class.iter().map(|i| ALL[*i].effect).collect::<Vec<_>>();
    json!({
        "dive": r.number, "id": format!("{} {}", r.flight, r.segment), "day": number(r.day), "departs": r.departs(),
        "class": r.compared.as_ref().map(class),
        "chance": r.compared.as_ref().map(|c| json!({"p": number(c.chance.0), "floor": number(c.chance.1)})),
    })
}
