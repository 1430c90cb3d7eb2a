//! `sg_calib_constants.m`: the numbers that a Seaglider's MATLAB file of constants assigns.
//!
//! Read are literals and + − * / ^ ( ) of earlier names; nothing is run. What of the vehicle's own numbers cannot be read is a problem.

use std::collections::BTreeMap;

use crate::import::report::shown;

/// What such a file states.
#[derive(Debug, Default)]
pub struct Constants {
    /// Numbers by name, dots as underscores.
    pub numbers: BTreeMap<String, f64>,
    /// Number of the glider they are of, by `id_str`.
    pub glider: Option<u32>,
    /// Numbers of the vehicle that stand there and cannot be read.
    pub problems: Vec<String>,
}

/// Names that make the vehicle.
const OF_THE_VEHICLE: [&str; 13] = [
    "mass",
    "mass_comp",
    "volmax",
    "vbdbias",
    "rho0",
    "hd_a",
    "hd_b",
    "hd_c",
    "hd_s",
    "abs_compress",
    "therm_expan",
    "temp_ref",
    "glider_length",
];

impl Constants {
    /// Reads the text of such a file.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let mut out = Self::default();
        let mut blocks = 0_u32;
        for line in statements(text) {
            for statement in line.split(';').map(str::trim) {
                let first_word = statement.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
                blocks += u32::from(["if", "for", "while", "switch", "try"].contains(&first_word));
                out.assign(statement, blocks > 0);
                if statement == "end" || [" end", ",end"].iter().any(|end| statement.ends_with(end)) {
                    blocks = blocks.saturating_sub(1);
                }
            }
        }
        out
    }

    /// Takes over one assignment; of those that a condition decides none can be known.
    fn assign(&mut self, statement: &str, conditional: bool) {
        let Some((name, value)) = statement.split_once('=') else { return };
        let (name, value) = (name.trim().replace('.', "_"), value.trim());
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let last_word = name.rsplit(|c: char| !word(c)).next().unwrap_or_default();
        let asked = OF_THE_VEHICLE.contains(&last_word);
        if conditional && asked {
            self.numbers.remove(last_word);
            self.problems.push(format!("{last_word} stands in a condition or loop, which is not run: write it outside of it"));
        }
        if conditional || name.starts_with("override_") || value.len() > 200 || !name.chars().all(word) {
            return;
        }
        if name == "id_str" {
            self.glider = value.trim_matches(['\'', '"', ' ']).parse().ok();
        }
        let literal = !value.contains(['[', '\'', '"', '{']);
        let number = if literal { Sum { text: value, at: 0, known: &self.numbers, depth: 0 }.whole() } else { None };
        match number.filter(|v| v.is_finite()) {
            Some(number) => _ = self.numbers.insert(name, number),
            // NaN says that it is not known.
            None if asked => {
                self.numbers.remove(&name);
                if !value.eq_ignore_ascii_case("nan") {
                    self.problems.push(format!("{name} = {} is no number that can be read", shown(value)));
                }
            }
            None => {}
        }
    }
}

/// Lines without comments, those of a block (`%{` to `%}`) too; one that ends in `...` goes on in the next.
fn statements(text: &str) -> Vec<String> {
    let (mut lines, mut blocks, mut open) = (Vec::<String>::new(), 0_u32, false);
    for line in text.lines().take(MOST_LINES) {
        match line.trim() {
            "%{" => blocks += 1,
            "%}" => blocks = blocks.saturating_sub(1),
            _ if blocks > 0 => {}
            _ => {
                let line = without_comment(line).trim_end();
                // What stands behind the dots is a comment.
                let dots = line.find("...").filter(|at| line[..*at].matches(['\'', '"']).count().is_multiple_of(2));
                let (line, goes_on) = dots.map_or((line, false), |at| (&line[..at], true));
                match lines.last_mut().filter(|_| open) {
                    Some(before) => before.push_str(line),
                    None => lines.push(line.to_owned()),
                }
                open = goes_on;
            }
        }
    }
    lines
}

/// A sum of numbers and names, read from left to right.
struct Sum<'a> {
    text: &'a str,
    at: usize,
    known: &'a BTreeMap<String, f64>,
    depth: usize,
}

/// Brackets and signs within one another; more is damage.
const DEEPEST: usize = 40;

impl Sum<'_> {
    /// All of the text, none if something is left over.
    fn whole(mut self) -> Option<f64> {
        let value = self.sum()?;
        self.rest().trim().is_empty().then_some(value)
    }

    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// The next sign if it is one of `signs`.
    fn sign(&mut self, signs: &[char]) -> Option<char> {
        let blanks = self.rest().len() - self.rest().trim_start().len();
        let next = self.rest().trim_start().chars().next().filter(|c| signs.contains(c))?;
        self.at += blanks + next.len_utf8();
        Some(next)
    }

    fn sum(&mut self) -> Option<f64> {
        let mut value = self.product()?;
        while let Some(sign) = self.sign(&['+', '-']) {
            let next = self.product()?;
            value = if sign == '+' { value + next } else { value - next };
        }
        Some(value)
    }

    fn product(&mut self) -> Option<f64> {
        let mut value = self.power()?;
        while let Some(sign) = self.sign(&['*', '/']) {
            let next = self.power()?;
            value = if sign == '*' { value * next } else { value / next };
        }
        Some(value)
    }

    fn power(&mut self) -> Option<f64> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        if let Some(sign) = self.sign(&['+', '-']) {
            let value = self.power()?;
            return Some(if sign == '-' { -value } else { value });
        }
        let base = self.atom()?;
        let value = if self.sign(&['^']).is_some() { base.powf(self.power()?) } else { base };
        self.depth -= 1;
        Some(value)
    }

    fn atom(&mut self) -> Option<f64> {
        if self.sign(&['(']).is_some() {
            let value = self.sum()?;
            return self.sign(&[')']).map(|_| value);
        }
        self.at += self.rest().len() - self.rest().trim_start().len();
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let rest = self.rest();
        let mut end = rest.find(|c: char| !word(c)).unwrap_or(rest.len());
        let number = rest.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        // The sign of an exponent belongs to the number.
        if number && rest[..end].ends_with(['e', 'E']) && rest[end..].starts_with(['+', '-']) {
            end += 1 + rest[end + 1..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - end - 1);
        }
        let token = rest[..end].to_owned();
        self.at += end;
        if number { token.parse().ok() } else { self.known.get(&token.replace('.', "_")).copied() }
    }
}

/// A file of constants has some hundred lines.
const MOST_LINES: usize = 5000;

/// The line up to its `%`, or Octave's `#`, outside of quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (k, c) in line.char_indices() {
        match (quote, c) {
            (None, '%' | '#') => return &line[..k],
            (None, '\'' | '"') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            _ => {}
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_numbers_and_sums_of_earlier_ones_only() {
        let text = "id_str = '099';\nmass = 54.12 ; % (kg)\n%mass = 99.9;\nrho0=1027.5; hd_a = 3.8e-3;\nhalf = 0.5;\nabs_compress = 8.2e-6*half;\n\
            override.RHO = 1.03;\nm = [1 2; 3 4];\nlate = never + 1;\na.b = (1+2)^2\nx = system('rm');\n\
            deep = ((((1e-3 - -2E+0))))/4; open = (1; two = 1 2;\n%{\nmass = 2;\n%}\nvolmax = ... in cm3\n 53285.5;";
        let got = Constants::parse(text).numbers;
        assert_eq!((got.get("mass"), got.get("volmax")), (Some(&54.12), Some(&53285.5)));
        assert_eq!(got.get("a_b"), Some(&9.0));
        assert!((got["abs_compress"] - 4.1e-6).abs() < 1e-18 && got["hd_a"] == 3.8e-3 && got["rho0"] == 1027.5);
        assert_eq!(got.get("deep"), Some(&(2.001 / 4.0)));
        assert!(!got.contains_key("open") && !got.contains_key("two"));
        assert!(!got.contains_key("late") && !got.contains_key("override_RHO") && !got.contains_key("m") && !got.contains_key("x"));
    }

    #[test]
    fn regress_numbers_of_the_vehicle_that_cannot_be_read_are_named() {
        let read = |text: &str| Constants::parse(text);
        for text in ["mass = 54,12;", "mass = '54.12';", "mass = [54.12];", "mass = scale - tare;", "mass = 1;\nmass = 5 4;"] {
            let got = read(text);
            assert!(got.problems.len() == 1 && got.problems[0].starts_with("mass = "), "{text}: {:?}", got.problems);
            assert!(!got.numbers.contains_key("mass"), "{text}");
        }
        for text in ["if true, vbdbias = 12.5; end;", "if true\nvbdbias = 12.5;\nend", "vbdbias = 1; if x, vbdbias = 12.5, end"] {
            let got = read(&format!("{text}\nmass = 54; # (kg)\n#mass = 99;"));
            assert!(got.problems.len() == 1 && got.problems[0].starts_with("vbdbias stands in a condition"), "{text}: {:?}", got.problems);
            assert!(!got.numbers.contains_key("vbdbias") && got.numbers["mass"] == 54.0, "{text}");
        }
        assert!(read("volmax = NaN; calibcomm = 'SBE s/n 1'; last = a(end); t_g = 'x';").problems.is_empty());
        assert_eq!((read("id_str = '099';").glider, read("id_str=99").glider, read("id_str = 'x'").glider), (Some(99), Some(99), None));
    }
}
