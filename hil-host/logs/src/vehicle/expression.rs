//! The user's own effect: `TARGET += EXPRESSION` over named variables, with parameters to fit.
//!
//! ```text
//! cd += k*abs(roll)*U            drag coefficient on S         alpha U roll climb phase t
//! cl += k*alpha^3                lift coefficient              the same
//! cn += k*alpha*abs(alpha)       force normal to the body      the same
//! volume_cc += a*exp(-p/1e5)     displaced volume              p z T rho ballast pitch t
//! pitch_rad += b*pitch           true minus measured pitch     the same
//! density_kg_m3 += c*(T-10)      true minus measured density   the same
//! water_up_m_s += a*sin(w*t)     vertical water motion         z H t
//! ```
//! Units: rad, m/s, s, Pa, m, °C, kg/m³, cm³ (`ballast`); `phase` is +1 climbing and −1 diving. Every other name is a parameter,
//! fitted from zero (the first) and from one (the others). Evaluated by the `exmex` crate; functions: sin cos tan exp ln sqrt abs …

use exmex::{Express as _, FlatEx};
use hydro::effects::{Constants, Effect, Flow, MAX_PARAMETERS, Parameter, Place, Sensed};

/// Functions that the evaluator knows, of one value; beside these `ln`, `log`, `log2`, `log10` and, of two, `min`, `max`, `atan2`.
const FUNCTIONS: [&str; 26] = [
    "sin", "cos", "tan", "exp", "ln", "log", "log2", "log10", "sqrt", "cbrt", "abs", "signum", "min", "max", "asin", "acos", "atan",
    "atan2", "sinh", "cosh", "tanh", "floor", "ceil", "round", "trunc", "fract",
];

/// What an expression is added to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    Drag,
    Lift,
    Normal,
    Volume,
    Pitch,
    Density,
    Water,
}

const TARGETS: [(&str, Target); 7] = [
    ("cd", Target::Drag),
    ("cl", Target::Lift),
    ("cn", Target::Normal),
    ("volume_cc", Target::Volume),
    ("pitch_rad", Target::Pitch),
    ("density_kg_m3", Target::Density),
    ("water_up_m_s", Target::Water),
];

const FLOW: &[&str] = &["alpha", "U", "roll", "climb", "phase", "t"];
const SENSED: &[&str] = &["p", "z", "T", "rho", "ballast", "pitch", "t"];
const PLACE: &[&str] = &["z", "H", "t"];

impl Target {
    fn variables(self) -> &'static [&'static str] {
        match self {
            Self::Drag | Self::Lift | Self::Normal => FLOW,
            Self::Volume | Self::Pitch | Self::Density => SENSED,
            Self::Water => PLACE,
        }
    }
}

/// An effect made of an expression.
#[derive(Debug)]
struct Custom {
    target: Target,
    expression: FlatEx<f64>,
    /// For each variable of the expression, in its order: a given variable or a parameter.
    slots: Vec<Slot>,
}

#[derive(Clone, Copy, Debug)]
enum Slot {
    Given(usize),
    Fitted(usize),
}

/// Longest text of an expression, bytes, and deepest brackets: the evaluator reads the one by its square and the other by recursion.
const LONGEST: usize = 1000;
const DEEPEST_BRACKET: usize = 32;

/// A text that is no expression of a person: where it is too much, and why.
fn beyond_bounds(text: &str) -> Option<(usize, String)> {
    if text.len() > LONGEST {
        return Some((0, format!("is longer than {LONGEST} bytes")));
    }
    let mut open = 0_usize;
    let deepest = text.char_indices().find(|(_, c)| {
        open = (open + usize::from(*c == '(')).saturating_sub(usize::from(*c == ')'));
        open > DEEPEST_BRACKET
    })?;
    Some((deepest.0, format!("brackets are more than {DEEPEST_BRACKET} deep here")))
}

/// Why a name that is no variable of a target is no parameter either: it is a variable of another place, or nearly one. A number of its own
/// (`alpha0`) is no slip.
fn no_parameter(name: &str, head: &str, target: Target) -> Option<String> {
    let mut known = [target.variables(), FLOW, SENSED, PLACE].into_iter().flatten().copied();
    let all = target.variables().join(", ");
    if known.clone().any(|v| v == name) {
        return Some(format!("`{name}` is not known where `{head}` is formed; there are {all}"));
    }
    let own = |v: &str| name.strip_prefix(v).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '_'));
    // Two slips in a long word that begins alike: `alfa`.
    let slips = |v: &str| if v.len() >= 5 && name.len() >= 4 && name.starts_with(&v[..1]) { 2 } else { 1 };
    let meant = known.find(|v| v.len() > 2 && (1..=slips(v)).contains(&strsim::levenshtein(name, v)) && !own(v))?;
    Some(format!("`{name}` is no variable; did you mean `{meant}`? There are {all}; a parameter needs a name of its own"))
}

/// A syntax error with the place it was found.
#[derive(Debug)]
pub struct SyntaxError {
    text: String,
    at: usize,
    why: String,
}

impl std::fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "expression, character {}: {}", self.at + 1, self.why)?;
        writeln!(f, "    {}", self.text)?;
        write!(f, "    {}^", " ".repeat(self.at))
    }
}

impl std::error::Error for SyntaxError {}

impl SyntaxError {
    fn new(text: &str, at: usize, why: String) -> Self {
        let text = if text.len() > LONGEST { text.chars().take(60).chain(['…']).collect() } else { text.to_owned() };
        Self { text, at, why }
    }
}

/// What evaluates a body, or what is wrong at which byte of it.
fn evaluator(body: &str) -> Result<FlatEx<f64>, (usize, String)> {
    if let Some(found) = ambiguous(body) {
        return Err(found);
    }
    let syntax = |e: exmex::ExError| locate(body).unwrap_or((body.len(), e.to_string().lines().collect::<Vec<_>>().join(" ")));
    exmex::parse::<f64>(&without_exponents(body)).map_err(syntax)
}

/// A formula of variables that somebody else has the values of.
#[derive(Clone, Debug)]
pub struct Formula(FlatEx<f64>);

impl Formula {
    /// Reads it; `is_known` says which variables there are.
    ///
    /// # Errors
    /// What is wrong at which character.
    pub fn parse(text: &str, is_known: impl Fn(&str) -> bool) -> Result<Self, SyntaxError> {
        let read = || beyond_bounds(text).map_or_else(|| evaluator(text), Err);
        let formula = Self(read().map_err(|(at, why)| SyntaxError::new(text, at, why))?);
        match formula.0.var_names().iter().find(|name| !is_known(name)) {
            Some(name) => Err(SyntaxError::new(text, find_word(text, name).unwrap_or(0), format!("`{name}` is no signal here"))),
            None => Ok(formula),
        }
    }

    /// Its value; NaN where it has none.
    #[must_use]
    pub fn value(&self, of: impl Fn(&str) -> f64) -> f64 {
        let values: Vec<f64> = self.0.var_names().iter().map(|name| of(name)).collect();
        self.0.eval(&values).unwrap_or(f64::NAN)
    }
}

/// Whether an argument is an expression rather than the name of an effect.
#[must_use]
pub fn is_expression(argument: &str) -> bool {
    argument.contains("+=")
}

/// Makes an effect of `TARGET += EXPRESSION`. It lives as long as the program: effects are known by reference everywhere.
///
/// # Errors
/// What is wrong at which character.
pub fn parse(text: &str) -> Result<&'static Effect, SyntaxError> {
    let bad = |at: usize, why: String| SyntaxError::new(text, at, why);
    if let Some((at, why)) = beyond_bounds(text) {
        return Err(bad(at, why));
    }
    let Some(split) = text.find("+=") else {
        return Err(bad(0, "expected `TARGET += EXPRESSION`, for example `cd += k*roll^2`".into()));
    };
    let head = text[..split].trim();
    let Some((_, target)) = TARGETS.iter().find(|(n, _)| *n == head) else {
        let all: Vec<&str> = TARGETS.iter().map(|t| t.0).collect();
        return Err(bad(0, format!("`{head}` cannot be added to; there are {}", all.join(", "))));
    };
    let body = &text[split + 2..];
    let expression = evaluator(body).map_err(|(at, why)| bad(split + 2 + at, why))?;
    let mut slots = Vec::new();
    let mut names: Vec<(usize, String)> = Vec::new();
    for v in expression.var_names() {
        match target.variables().iter().position(|g| g == v) {
            Some(k) => slots.push(Slot::Given(k)),
            None => {
                let place = find_word(body, v).unwrap_or(0);
                if let Some(why) = no_parameter(v, head, *target) {
                    return Err(bad(split + 2 + place, why));
                }
                names.push((place, v.clone()));
                slots.push(Slot::Fitted(usize::MAX));
            }
        }
    }
    if names.is_empty() {
        return Err(bad(text.len(), "there is no parameter to fit; write for example `cd += k*roll^2`".into()));
    }
    if names.len() > MAX_PARAMETERS {
        let (at, extra) = &names[MAX_PARAMETERS];
        return Err(bad(split + 2 + at, format!("`{extra}` is one parameter too many; at most {MAX_PARAMETERS} can be fitted")));
    }
    // The parameter written first is the size.
    names.sort();
    let mut parameters = Vec::new();
    for (k, (_, n)) in names.iter().enumerate() {
        parameters.push(Parameter {
            name: Box::leak(n.clone().into_boxed_str()),
            unit: "of the expression",
            off: if k == 0 { 0.0 } else { 1.0 },
            low: -1e6,
            high: 1e6,
            typical: 1.0,
            source: "the user's expression",
        });
    }
    let var_names: Vec<String> = expression.var_names().to_vec();
    for (slot, v) in slots.iter_mut().zip(&var_names) {
        if let Slot::Fitted(k) = slot {
            *k = names.iter().position(|(_, n)| n == v).unwrap_or(0);
        }
    }
    let custom = Custom { target: *target, expression, slots };
    if let Some((at, why)) = custom.does_nothing(&names) {
        return Err(bad(split + 2 + at, why));
    }
    let about = Effect {
        name: Box::leak(format!("own_{head}").into_boxed_str()),
        physics: "the user's own expression",
        separated_by: "legs that differ in the variables of the expression",
        expression: Some(Box::leak(text.to_string().into_boxed_str())),
        parameters: Box::leak(parameters.into_boxed_slice()),
        ..Effect::NONE
    };
    Ok(Box::leak(Box::new(Box::leak(Box::new(custom)).effect(about))))
}

/// Usual values of the variables of each place, in two states.
const USUAL: [(&[&str], [&[f64]; 2]); 3] = [
    (FLOW, [&[0.06, 0.31, 0.05, -0.14, -1.0, 700.0], &[-0.05, 0.27, -0.04, 0.12, 1.0, 2300.0]]),
    (SENSED, [&[4e5, 40.0, 12.0, 1024.0, -210.0, -0.4, 700.0], &[1.1e5, 11.0, 17.0, 1022.0, 190.0, 0.37, 2300.0]]),
    (PLACE, [&[40.0, 120.0, 700.0], &[11.0, 120.0, 2300.0]]),
];

/// The text with `1e5` written out: the evaluator knows no exponents.
fn without_exponents(text: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let (mut out, mut rest) = (String::new(), text);
    while let Some(start) = rest.find(is_word) {
        out += &rest[..start];
        rest = &rest[start..];
        let mut end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        // The sign of an exponent belongs to its number.
        let number = rest.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        if number && rest[..end].ends_with(['e', 'E']) && rest[end..].starts_with(['+', '-']) {
            end += 1 + rest[end + 1..].find(|c| !is_word(c)).unwrap_or(rest.len() - end - 1);
        }
        let word = &rest[..end];
        match word.parse::<f64>() {
            Ok(v) if number && word.contains(['e', 'E']) => out += &format!("{v}"),
            _ => out += word,
        }
        rest = &rest[end..];
    }
    out + rest
}

/// Where a word stands in a text by itself.
pub(crate) fn find_word(text: &str, word: &str) -> Option<usize> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word)
        .map(|(i, _)| i)
        .find(|&i| !text[..i].chars().next_back().is_some_and(is_word) && !text[i + word.len()..].chars().next().is_some_and(is_word))
}

/// Where two programs read an expression differently: a sign before a power, a power of a power; the evaluator takes (-x)^2 and (x^2)^3.
fn ambiguous(text: &str) -> Option<(usize, String)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let after_operand = |from: usize| -> Option<usize> {
        let mut at = from + text[from..].find(|c: char| c != ' ')?;
        // A function's name, or the operand itself; then its bracket.
        at += text[at..].find(|c| !is_word(c)).unwrap_or(text.len() - at);
        if text[at..].starts_with('(') {
            let mut open = 0;
            let closes = |(k, c): (usize, char)| {
                open += i32::from(c == '(') - i32::from(c == ')');
                (open == 0).then_some(k + 1)
            };
            at += text[at..].char_indices().find_map(closes)?;
        }
        Some(at)
    };
    let power_next = |at: usize| text[at..].trim_start().starts_with('^');
    let mut before = None;
    for (i, c) in text.char_indices().filter(|(_, c)| *c != ' ') {
        let sign = c == '-' && before.is_none_or(|b| matches!(b, '(' | ',' | '*' | '/' | '^' | '+' | '-'));
        // The sign of an exponent of ten belongs to its number.
        if (sign || c == '^') && after_operand(i + 1).is_some_and(power_next) {
            let why = if sign { "is it (-x)^n or -(x^n)? Write the brackets" } else { "is it (x^n)^m or x^(n^m)? Write the brackets" };
            return Some((i, why.into()));
        }
        before = Some(c);
    }
    None
}

/// The character at which an expression goes wrong: operators and operands must take turns, brackets must close.
fn locate(text: &str) -> Option<(usize, String)> {
    let mut open: Vec<usize> = Vec::new();
    let mut operand_next = true;
    // The last word, if nothing came after it.
    let mut word = (0, "");
    let mut chars = text.char_indices().peekable();
    while let Some((i, c)) = chars.next() {
        match c {
            ' ' | '\t' => {}
            '(' => {
                match word {
                    (start, name) if !operand_next && !FUNCTIONS.contains(&name) => {
                        let no_function = || format!("`{name}` is no function; there are {}", FUNCTIONS.join(", "));
                        let named = name.starts_with(char::is_alphabetic);
                        return Some(if named { (start, no_function()) } else { (i, "an operator is missing before this".into()) });
                    }
                    _ => {}
                }
                open.push(i);
                operand_next = true;
            }
            ')' => {
                if open.pop().is_none() {
                    return Some((i, "this bracket closes nothing".into()));
                }
                if operand_next {
                    return Some((i, "a value is missing before this bracket".into()));
                }
                word = (i, "");
            }
            '+' | '-' => operand_next = true,
            '*' | '/' | '^' => {
                if operand_next {
                    return Some((i, format!("a value is missing before `{c}`")));
                }
                operand_next = true;
            }
            c if c.is_alphanumeric() || c == '_' || c == '.' => {
                if !operand_next {
                    return Some((i, "an operator is missing before this".into()));
                }
                let (mut last, mut end) = (c, i + c.len_utf8());
                while let Some(&(at, n)) = chars.peek() {
                    let exponent = (n == '+' || n == '-') && (last == 'e' || last == 'E') && c.is_ascii_digit();
                    if n.is_alphanumeric() || n == '_' || n == '.' || exponent {
                        (last, end) = (n, at + n.len_utf8());
                        chars.next();
                    } else {
                        break;
                    }
                }
                word = (i, &text[i..end]);
                operand_next = false;
            }
            _ => return Some((i, format!("`{c}` means nothing here"))),
        }
    }
    if let Some(i) = open.pop() {
        return Some((i, "this bracket is never closed".into()));
    }
    operand_next.then(|| (text.len(), "a value is missing at the end".into()))
}

impl Custom {
    /// Which of the parameters (with their places) changes nothing, and why; none where each of them does.
    fn does_nothing(&self, names: &[(usize, String)]) -> Option<(usize, String)> {
        let states = USUAL.iter().find(|u| u.0 == self.target.variables())?.1;
        let raw = |p: &[f64], given: &[f64]| {
            let slot = |s: &Slot| match *s {
                Slot::Given(k) => given[k],
                Slot::Fitted(k) => p[k],
            };
            let values: Vec<f64> = self.slots.iter().map(slot).collect();
            self.expression.eval(&values).unwrap_or(f64::NAN)
        };
        let tried = [0.31, 0.72, 1.3];
        let mut anywhere = false;
        for (k, (at, name)) in names.iter().enumerate() {
            let mut changes = false;
            for given in states {
                let of = |v: f64| {
                    let p: Vec<f64> = (0..names.len()).map(|j| if j == k { v } else { 0.87 }).collect();
                    raw(&p, given)
                };
                let seen: Vec<f64> = tried.iter().map(|v| of(*v)).filter(|v| v.is_finite()).collect();
                anywhere |= !seen.is_empty();
                changes |= seen.windows(2).any(|w| w[0] != w[1]);
            }
            if anywhere && !changes {
                return Some((*at, format!("`{name}` changes nothing here: whatever it is, the expression is the same")));
            }
        }
        (!anywhere)
            .then(|| (0, "this is no number for any usual values of its variables (a division by zero, a logarithm of none?)".into()))
    }

    fn value(&self, p: &[f64], given: &[f64]) -> f64 {
        let mut values = [0.0; 16];
        for (v, slot) in values.iter_mut().zip(&self.slots) {
            *v = match *slot {
                Slot::Given(k) => given[k],
                Slot::Fitted(k) => p[k],
            };
        }
        let out = self.expression.eval(&values[..self.slots.len()]).unwrap_or(0.0);
        if out.is_finite() { out } else { 0.0 }
    }

    fn at_flow(&self, p: &[f64], at: &Flow) -> f64 {
        let phase = if at.climb_m_s > 0.0 { 1.0 } else { -1.0 };
        self.value(p, &[at.alpha_rad, at.speed_m_s, at.roll_rad, at.climb_m_s, phase, at.time_s])
    }

    /// The row of its effect, from one without hooks.
    fn effect(&'static self, about: Effect) -> Effect {
        // Of any target: whether pitch stays a straight line is not known of an expression, and points depend on that.
        let about = Effect { sensed: Some(Box::leak(Box::new(|p: &[f64], s: &mut Sensed| self.sensed(p, s)))), ..about };
        match self.target {
            Target::Drag => {
                Effect { drag: Some(Box::leak(Box::new(|p: &[f64], at: &Flow, _: f64, _: &Constants| self.at_flow(p, at)))), ..about }
            }
            Target::Lift => {
                Effect { lift: Some(Box::leak(Box::new(|p: &[f64], at: &Flow, _: f64, _: &Constants| self.at_flow(p, at)))), ..about }
            }
            Target::Normal => Effect { normal_force: Some(Box::leak(Box::new(|p: &[f64], at: &Flow| self.at_flow(p, at)))), ..about },
            Target::Volume | Target::Pitch | Target::Density => about,
            Target::Water => {
                let up = |p: &[f64], at: &Place| self.value(p, &[at.depth_m, at.water_depth_m, at.time_s]);
                Effect { water_up_m_s: Some(Box::leak(Box::new(up))), ..about }
            }
        }
    }

    fn sensed(&self, p: &[f64], s: &mut Sensed) {
        let add: fn(&mut Sensed, f64) = match self.target {
            Target::Volume => |s, v| s.ballast_m3 += v * 1e-6,
            Target::Pitch => |s, v| s.pitch_rad += v,
            Target::Density => |s, v| s.density_kg_m3 += v,
            _ => return,
        };
        let depth = s.pressure_pa / (1015.0 * 9.81);
        let given = [s.pressure_pa, depth, s.temperature_degc, s.density_kg_m3, s.ballast_m3 * 1e6, s.pitch_rad, s.time_s];
        add(s, self.value(p, &given));
    }
}

#[cfg(test)]
mod tests;
