//! The first vehicle file of a glider: every number with the reason why it stands there.
//!
//! What the flight's own files state is taken from them; the rest are the class's usual numbers with tolerances so wide that a
//! sister vehicle lies inside. It is a start for a fit, not a calibrated model, and says so.

use std::fmt::Write as _;

/// A vehicle file in the making: keys of the flight format's vehicle, values, reasons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft {
    /// What the head of the file says.
    pub about: Vec<String>,
    entries: Vec<Entry>,
    /// The same with the other of two sets of lift and drag, and what this one's and that one's are called: the flight is to decide.
    pub other: Option<(Box<Self>, [&'static str; 2])>,
}

#[derive(Clone, Debug, PartialEq)]
struct Entry {
    key: String,
    value: Value,
    why: String,
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    Number(f64),
    Text(String),
}

impl Draft {
    /// States a number; the one stated before under this key goes.
    pub fn set(&mut self, key: &str, value: f64, why: &str) {
        self.put(key, Value::Number(value), why);
    }

    /// States a text.
    pub fn say(&mut self, key: &str, text: &str, why: &str) {
        self.put(key, Value::Text(text.into()), why);
    }

    fn put(&mut self, key: &str, value: Value, why: &str) {
        let entry = Entry { key: key.into(), value, why: why.replace('\n', " ") };
        match self.entries.iter_mut().find(|e| e.key == key) {
            Some(old) => *old = entry,
            None => self.entries.push(entry),
        }
    }

    /// The number under `key`.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        self.entries.iter().find(|e| e.key == key).and_then(|e| if let Value::Number(v) = e.value { Some(v) } else { None })
    }

    /// The file: tables in the order of first mention, a reason behind each number.
    #[must_use]
    pub fn toml(&self) -> String {
        let mut text = String::new();
        for line in &self.about {
            let _ = writeln!(text, "# {line}");
        }
        let table = |e: &Entry| e.key.rsplit_once('.').map_or(String::new(), |(t, _)| t.to_owned());
        let mut tables: Vec<String> = Vec::new();
        for t in self.entries.iter().map(table) {
            if !tables.contains(&t) {
                tables.push(t);
            }
        }
        // Keys without a table must come first.
        tables.sort_by_key(|t| !t.is_empty());
        for t in tables {
            if !t.is_empty() {
                let _ = writeln!(text, "\n[{t}]");
            }
            for e in self.entries.iter().filter(|e| table(e) == t) {
                let key = e.key.rsplit('.').next().unwrap_or_default();
                let value = match &e.value {
                    Value::Number(v) => format!("{:?}", nine_digits(*v)),
                    Value::Text(s) => format!("{s:?}"),
                };
                let stated = format!("{key} = {value}");
                let _ = if e.why.is_empty() { writeln!(text, "{stated}") } else { writeln!(text, "{stated:<42} # {}", e.why) };
            }
        }
        text
    }
}

/// The number without the digits that only arithmetic gave it.
fn nine_digits(v: f64) -> f64 {
    format!("{v:.8e}").parse().unwrap_or(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draft_is_read_as_a_vehicle() {
        for class in super::super::classes::Class::ALL {
            let mut draft = class.draft();
            draft.set("hull_volume_m3", 0.0601 / 0.99999, "test");
            draft.about.push("one line".into());
            let text = draft.toml();
            let vehicle = crate::vehicle::parse_text(&text, std::path::Path::new("vehicle.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert!(vehicle.assumed.iter().all(|a| !a.starts_with("tolerance") && !a.starts_with("hydro")), "{:?}", vehicle.assumed);
            assert_eq!(Some(vehicle.constants.mass_kg), draft.get("mass_kg"));
        }
    }

    #[test]
    fn the_last_word_stands() {
        let mut draft = Draft::default();
        draft.set("a.b", 1.0, "first");
        draft.set("c", 2.0 / 3.0, "");
        draft.set("a.b", 4.1e-10, "second");
        assert_eq!(draft.toml(), "c = 0.666666667\n\n[a]\nb = 4.1e-10                                # second\n");
    }
}
