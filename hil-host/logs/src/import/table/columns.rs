//! Columns of a table: numbers, each read once, and the fields that are none.

use super::super::report::shown;
use crate::record::csv::no_value;

/// Larger numbers are fills or damage: they count as texts, which say that there is no value.
const LARGEST_NUMBER: f64 = 1e30;

/// The number of a field; none of a field that is no finite number, or one that nothing measures.
fn number(field: &str) -> Option<f64> {
    field.parse::<f64>().ok().filter(|v| v.abs() < LARGEST_NUMBER)
}

/// One column, row by row.
#[derive(Debug)]
pub(super) enum Column<'a> {
    /// Numbers, NaN where there is none; and what stands where there is none, by row.
    Numbers { numbers: Vec<f64>, texts: Vec<(u32, &'a str)> },
    /// Times, segments, names: as they stand.
    Fields(Vec<&'a str>),
}

impl<'a> Column<'a> {
    /// An empty one, with room for so many rows.
    pub fn new(as_fields: bool, rows: usize) -> Self {
        if as_fields {
            Self::Fields(Vec::with_capacity(rows))
        } else {
            Self::Numbers { numbers: Vec::with_capacity(rows), texts: Vec::new() }
        }
    }

    pub fn push(&mut self, field: &'a str) {
        match self {
            Self::Fields(fields) => fields.push(field),
            Self::Numbers { numbers, texts } => {
                let value = number(field);
                // Of a table of all sensors most fields are none.
                if value.is_none() && !field.is_empty() && !field.eq_ignore_ascii_case("nan") {
                    texts.push((numbers.len() as u32, field));
                }
                numbers.push(value.unwrap_or(f64::NAN));
            }
        }
    }

    /// What stands in a row and is no number of [`number`].
    pub fn text(&self, row: usize) -> &'a str {
        match self {
            Self::Fields(fields) => Some(fields[row]).filter(|f| number(f).is_none()).unwrap_or_default(),
            Self::Numbers { texts, .. } => texts.binary_search_by_key(&(row as u32), |t| t.0).map_or("", |at| texts[at].1),
        }
    }

    /// The number of a row.
    pub fn number(&self, row: usize) -> f64 {
        match self {
            Self::Fields(fields) => number(fields[row]).unwrap_or(f64::NAN),
            Self::Numbers { numbers, .. } => numbers[row],
        }
    }

    /// All fields as they stand, of a column that is kept so.
    pub fn fields(&self) -> &[&'a str] {
        if let Self::Fields(fields) = self { fields } else { &[] }
    }

    /// Fields that are no numbers, with their rows.
    pub fn texts(&self) -> Vec<(u32, &'a str)> {
        let is_text = |t: &(u32, &str)| !t.1.is_empty();
        match self {
            Self::Fields(all) => (0..).zip(all.iter().copied()).filter(|t| is_text(t) && number(t.1).is_none()).collect(),
            Self::Numbers { texts, .. } => texts.iter().copied().filter(is_text).collect(),
        }
    }

    /// How many fields are numbers.
    pub fn count(&self) -> usize {
        match self {
            Self::Fields(all) => all.iter().filter(|f| number(f).is_some()).count(),
            Self::Numbers { numbers, .. } => numbers.iter().filter(|v| !v.is_nan()).count(),
        }
    }

    /// Whether a row has nothing in it.
    pub fn is_empty(&self, row: usize) -> bool {
        match self {
            Self::Fields(fields) => fields[row].is_empty(),
            Self::Numbers { .. } => self.number(row).is_nan() && self.text(row).is_empty(),
        }
    }

    /// Whether a row has a value.
    pub fn has(&self, row: usize) -> bool {
        !self.number(row).is_nan() || !no_value(self.text(row))
    }

    /// Empties the field of a row.
    pub fn clear(&mut self, row: usize) {
        match self {
            Self::Fields(fields) => fields[row] = "",
            Self::Numbers { numbers, texts } => {
                numbers[row] = f64::NAN;
                if let Ok(at) = texts.binary_search_by_key(&(row as u32), |t| t.0) {
                    texts[at].1 = "";
                }
            }
        }
    }

    /// Whether two rows hold the same.
    pub fn same(&self, a: usize, b: usize) -> bool {
        self.number(a).to_bits() == self.number(b).to_bits() && self.text(a) == self.text(b)
    }

    /// Those rows alone, in this order; each once.
    pub fn take(&mut self, rows: &[usize]) {
        match self {
            Self::Fields(fields) => *fields = rows.iter().map(|r| fields[*r]).collect(),
            Self::Numbers { numbers, texts } => {
                if !texts.is_empty() {
                    let mut place = vec![u32::MAX; numbers.len()];
                    (0..).zip(rows).for_each(|(k, r)| place[*r] = k);
                    texts.iter_mut().for_each(|t| t.0 = place[t.0 as usize]);
                    texts.retain(|t| t.0 != u32::MAX);
                    texts.sort_unstable_by_key(|t| t.0);
                }
                *numbers = rows.iter().map(|r| numbers[*r]).collect();
            }
        }
    }

    /// Takes out its numbers, with how many of its fields are none, of how many, and the first of them.
    pub fn take_numbers(&mut self) -> (Vec<f64>, Option<(usize, usize, String)>) {
        let texts = self.texts();
        let fields = self.count() + texts.len();
        let mut none = texts.iter().filter(|t| !no_value(t.1));
        let first = none.next().map(|t| shown(t.1));
        let said = first.map(|first| (1 + none.count(), fields, first));
        let numbers = match self {
            Self::Fields(all) => all.iter().map(|f| number(f).unwrap_or(f64::NAN)).collect(),
            Self::Numbers { numbers, .. } => std::mem::take(numbers),
        };
        (numbers, said)
    }
}
