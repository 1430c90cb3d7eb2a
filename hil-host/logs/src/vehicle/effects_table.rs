//! The effects that a vehicle file has switched on: read and checked, taken out, and the key that a new one goes by.

use crate::record::csv::ReadError;
use crate::vehicle::Vehicle;
use crate::vehicle::catalogue;
use crate::vehicle::expression;
use hydro::effects::{Active, Effect};
use serde_json::{Map, Value};

type Table = Map<String, Value>;

/// Reads the table of effects of a vehicle file. `bad` makes an error of a key and what is wrong with it.
///
/// # Errors
/// Unknown effect or parameter, a value that is no number or outside what is possible.
pub(crate) fn read(table: &Value, bad: impl Fn(&str, String) -> ReadError) -> Result<Vec<Active>, ReadError> {
    let table = table.as_object().ok_or_else(|| bad("effects", "is not a table of effect name to parameters".into()))?;
    table.iter().map(|(name, entry)| one(name, entry, &bad)).collect()
}

fn one(name: &str, entry: &Value, bad: &impl Fn(&str, String) -> ReadError) -> Result<Active, ReadError> {
    let key = format!("effects.{name}");
    let entry = entry.as_object().ok_or_else(|| bad(&key, "is not a table of parameters".into()))?;
    let effect: &'static Effect = match (catalogue::by_name(name), entry.get("expression").and_then(Value::as_str)) {
        (Some(effect), _) => effect,
        (None, Some(text)) => expression::parse(text).map_err(|e| bad(&format!("{key}.expression"), e.to_string()))?,
        (None, None) => {
            let all: Vec<&str> = catalogue::all().map(|e| e.name).collect();
            return Err(bad(&key, format!("no such effect; there are {}", all.join(", "))));
        }
    };
    let mut active = Active::off(effect);
    let parameters = effect.parameters;
    // Of a law of the user's own nothing is usual: a name without a number is a slip in another one.
    if let Some(p) = parameters.iter().find(|p| effect.expression.is_some() && !entry.contains_key(p.name)) {
        return Err(bad(
            &format!("{key}.{}", p.name),
            "is missing: the expression names it; state its number, or is it a slip in a variable?".into(),
        ));
    }
    // A text is a remark, but not under the name of a parameter.
    for (of, stated) in entry.iter().filter(|(of, stated)| !stated.is_string() || parameters.iter().any(|p| p.name == *of)) {
        let key = format!("{key}.{of}");
        let Some(k) = parameters.iter().position(|p| p.name == of) else {
            let all: Vec<&str> = parameters.iter().map(|p| p.name).collect();
            return Err(bad(&key, format!("no such parameter; there are {}", all.join(", "))));
        };
        let (p, stated) = (&parameters[k], stated.get("value").unwrap_or(stated));
        let value = stated.as_f64().filter(|x| x.is_finite()).ok_or_else(|| bad(&key, format!("`{stated}` is not a number")))?;
        if !(p.low..=p.high).contains(&value) {
            return Err(bad(&key, format!("is {value} {}; physical is {} to {}", p.unit, p.low, p.high)));
        }
        active.values[k] = value;
    }
    // Without its size it would be off.
    if let Some(size) = parameters.first().filter(|p| !entry.contains_key(p.name)) {
        return Err(bad(&format!("{key}.{}", size.name), "is missing: without its size the effect is off".into()));
    }
    Ok(active)
}

/// Whether an entry of the table is of this effect: one of the user's own is known by its expression.
fn is_of(key: &str, entry: &Value, effect: &Effect) -> bool {
    effect.expression.map_or(key == effect.name, |text| entry.get("expression").and_then(Value::as_str) == Some(text))
}

/// Whether two effects are the same law.
fn is_same(a: &Effect, b: &Effect) -> bool {
    a.name == b.name && a.expression == b.expression
}

/// The key that an effect is to go by in a table that has none of it: its name, and a number where that is taken.
#[must_use]
pub fn new_key(on: &Table, effect: &Effect) -> String {
    let name = effect.name;
    let numbered = std::iter::once(name.to_string()).chain((2..).map(|k| format!("{name}_{k}")));
    let mut free = numbered.filter(|key| !on.contains_key(key));
    free.next().unwrap_or_else(|| name.to_string())
}

impl Vehicle {
    /// An effect as the file has it switched on, if it has.
    #[must_use]
    pub fn switched_on(&self, effect: &Effect) -> Option<Active> {
        self.effects.iter().find(|a| is_same(a.effect, effect)).copied()
    }

    /// The vehicle without what its file says of these effects: who fits or sets one means all of it, not a change of it.
    #[must_use]
    pub fn without(&self, effects: &[&'static Effect]) -> Self {
        let mut left = self.clone();
        left.effects.retain(|a| !effects.iter().any(|e| is_same(a.effect, e)));
        if let Some(on) = left.document.get_mut("effects").and_then(Value::as_object_mut) {
            on.retain(|key, entry| !effects.iter().any(|e| is_of(key, entry, e)));
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read_table(table: &Value) -> Result<Vec<Active>, String> {
        read(table, |key, why| ReadError::Content { path: "v.json".into(), line: 0, column: key.into(), why }).map_err(|e| e.to_string())
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_key_and_the_way_out() {
        let refused = |table: Value, says: [&str; 2]| {
            let why = read_table(&table).expect_err("refused");
            assert!(says.iter().all(|s| why.contains(s)), "{table}: {why}");
        };
        refused(json!([]), ["effects", "is not a table"]);
        refused(json!({"magic": {}}), ["effects.magic", "no such effect; there are"]);
        refused(json!({"side_edge_lift": 2.0}), ["effects.side_edge_lift", "is not a table"]);
        refused(json!({"side_edge_lift": {"K": 2.0}}), ["effects.side_edge_lift.K", "no such parameter; there are k"]);
        refused(json!({"side_edge_lift": {}}), ["effects.side_edge_lift.k", "is missing: without its size"]);
        refused(json!({"stall": {"loss": 0.5}}), ["effects.stall.", "is missing: without its size"]);
        refused(json!({"side_edge_lift": {"k": -2.0}}), ["effects.side_edge_lift.k", "is -2 "]);
        refused(json!({"side_edge_lift": {"k": {"value": 2e3}}}), ["effects.side_edge_lift.k", "physical is 0 to"]);
        refused(json!({"side_edge_lift": {"k": null}}), ["effects.side_edge_lift.k", "is not a number"]);
        refused(json!({"side_edge_lift": {"k": "2.0"}}), ["effects.side_edge_lift.k", "is not a number"]);
        refused(json!({"own_cd": {"expression": "cd += k*", "k": 1.0}}), ["effects.own_cd.expression", "character"]);
        refused(json!({"own_cd": {"expression": "cd += k*gain", "k": 1.0}}), ["effects.own_cd.gain", "is missing"]);
        refused(json!({"own_cd": {"expression": "cd += k*U", "k": {"value": null}}}), ["effects.own_cd.k", "is not a number"]);
    }

    #[test]
    fn numbers_tables_and_remarks_are_read() {
        for (table, name, value) in [
            (json!({"side_edge_lift": {"k": {"value": 2.0, "low": 1.0, "unit": "1"}, "why": "tank test"}}), "side_edge_lift", 2.0),
            (json!({"own_cd": {"expression": "cd += k*U", "k": 0.5}}), "own_cd", 0.5),
        ] {
            let on = read_table(&table).expect("reads");
            assert_eq!((on.len(), on[0].effect.name, on[0].values[0]), (1, name, value));
        }
    }

    #[test]
    fn two_expressions_of_one_target_keep_a_key_each() {
        let [first, second] = ["cd += k*U", "cd += k*roll^2"].map(|t| expression::parse(t).expect("parses"));
        let mut on = Table::new();
        assert_eq!(new_key(&on, first), "own_cd");
        on.insert("own_cd".into(), json!({"expression": "cd += k*U", "k": 1.0}));
        assert_eq!(new_key(&on, second), "own_cd_2");
        assert!(is_of("own_cd", &on["own_cd"], first) && !is_of("own_cd", &on["own_cd"], second) && !is_same(first, second));
    }
}
