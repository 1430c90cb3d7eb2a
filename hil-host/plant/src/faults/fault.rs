//! One fault to come, and its text form.

use super::{Kind, Target, catalogue, sizes};
use serde::{Deserialize, Serialize};
use signals::Phase;

/// One fault to come.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fault {
    /// What fails.
    pub target: Target,
    /// How.
    pub kind: Kind,
    /// Size, meaning by entry of [`catalogue`].
    pub size: f64,
    /// Begins when the controller first enters this phase; none: at the start.
    pub phase: Option<Phase>,
    /// Delay after that, s.
    pub delay_s: f64,
    /// Duration, s; none: for good.
    pub duration_s: Option<f64>,
}

impl Fault {
    /// A fault of default size from the start, for good; none when there is no such fault.
    #[must_use]
    pub fn new(target: Target, kind: Kind) -> Option<Self> {
        let (_, _, size, _) = catalogue().find(|e| e.0 == target && e.1 == kind)?;
        Some(Self { target, kind, size, phase: None, delay_s: 0.0, duration_s: None })
    }

    /// The same fault with the other sign; none: its size has no sign.
    #[must_use]
    pub fn mirrored(self) -> Option<Self> {
        sizes(self.target, self.kind).contains(&-self.size).then_some(Self { size: -self.size, ..self }).filter(|f| f.size != 0.0)
    }

    /// The same fault when a phase begins, `delay_s` later.
    #[must_use]
    pub const fn at(self, phase: Phase, delay_s: f64) -> Self {
        Self { phase: Some(phase), delay_s, ..self }
    }

    /// The same fault for a limited time.
    #[must_use]
    pub const fn lasting(self, duration_s: f64) -> Self {
        Self { duration_s: Some(duration_s), ..self }
    }
}

const PHASES: [(&str, Phase); 8] = [
    ("surface", Phase::Surface),
    ("dive", Phase::Dive),
    ("inflect_low", Phase::InflectLow),
    ("climb", Phase::Climb),
    ("inflect_high", Phase::InflectHigh),
    ("comms", Phase::Comms),
    ("done", Phase::Done),
    ("safe", Phase::Safe),
];

fn seconds(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (digits, factor) = match text.strip_suffix('s') {
        Some(d) => (d, 1.0),
        None => text.strip_suffix('m').map_or((text, 1.0), |d| (d, 60.0)),
    };
    digits
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|v| v.is_finite() && *v >= 0.0)
        .map(|v| v * factor)
        .ok_or_else(|| format!("'{text}' is not a time such as 120s or 5m"))
}

/// Whether a '+' after this is one of the size (`=+5`, `=1e+3`), not the one before the delay (`garbage+109s`).
fn belongs_to_the_size(before: &str) -> bool {
    before.split_once('=').is_some_and(|(_, size)| size.is_empty() || size.ends_with(['e', 'E']))
}

impl std::str::FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fail = |why: String| format!("fault '{text}': {why}");
        let (head, duration) = text.split_once(',').map_or((text, None), |(h, d)| (h, Some(d)));
        let (target, rest) = head.split_once(':').ok_or_else(|| fail("expected target:kind, such as depth:stuck".into()))?;
        // A '+' may also stand in the size (1e+3, =+5): the delay's one follows the phase, or is the last one.
        let (kind, mut phase, mut delay) = (rest, None, None);
        let mut body = kind;
        if let Some((before, after)) = body.split_once('@') {
            body = before;
            let (p, d) = after.split_once('+').map_or((after, None), |(p, d)| (p, Some(d)));
            phase = Some(p);
            delay = d;
        } else if let Some(at) = body.rfind('+').filter(|at| !belongs_to_the_size(&body[..*at])) {
            delay = Some(&body[at + 1..]);
            body = &body[..at];
        }
        let (kind, size) = body.split_once('=').map_or((body, None), |(k, s)| (k, Some(s)));
        let target = target.trim();
        let target = Target::from_name(target).ok_or_else(|| {
            let mut names: Vec<_> = catalogue().map(|e| e.0.name()).collect();
            names.dedup();
            names.sort_unstable();
            names.dedup();
            fail(format!("nothing is called '{target}'; there are {}", names.join(", ")))
        })?;
        let kinds = || catalogue().filter(|e| e.0 == target);
        let mut fault = Kind::from_name(kind.trim()).and_then(|k| Self::new(target, k)).ok_or_else(|| {
            fail(format!(
                "{} cannot fail by '{}'; it can by {}",
                target.name(),
                kind.trim(),
                kinds().map(|e| e.1.name()).collect::<Vec<_>>().join(", ")
            ))
        })?;
        if let Some(size) = size {
            fault.size = size
                .trim()
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| fail(format!("'{size}' is not a finite number")))?;
            let range = sizes(fault.target, fault.kind);
            if !range.contains(&fault.size) {
                let (low, high) = (range.start(), range.end());
                let meaning = kinds().find(|e| e.1 == fault.kind).map_or("", |e| e.3);
                return Err(fail(match meaning {
                    "" => format!("{} takes no size", fault.kind.name()),
                    meaning => format!("size {} ({meaning}) is outside {low} to {high}", fault.size),
                }));
            }
        }
        if let Some(phase) = phase {
            let name = phase.trim();
            fault.phase = Some(
                PHASES
                    .iter()
                    .find(|p| p.0 == name)
                    .map(|p| p.1)
                    .ok_or_else(|| fail(format!("no phase is called '{name}'; there are {}", PHASES.map(|p| p.0).join(", "))))?,
            );
        }
        if let Some(delay) = delay {
            fault.delay_s = seconds(delay).map_err(&fail)?;
        }
        if let Some(duration) = duration {
            fault.duration_s = Some(seconds(duration).map_err(&fail)?);
        }
        Ok(fault)
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.target.name(), self.kind.name())?;
        if Self::new(self.target, self.kind).is_none_or(|d| d.size != self.size) {
            write!(f, "={}", self.size)?;
        }
        if let Some(name) = self.phase.and_then(|phase| PHASES.iter().find(|p| p.1 == phase)).map(|p| p.0) {
            write!(f, "@{name}")?;
        }
        if self.delay_s != 0.0 {
            write!(f, "+{}s", self.delay_s)?;
        }
        if let Some(d) = self.duration_s {
            write!(f, ",{d}s")?;
        }
        Ok(())
    }
}

impl TryFrom<String> for Fault {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_fault_is_written_and_read_back() {
        let mut n = 0;
        for (target, kind, _, _) in catalogue() {
            let plain = Fault::new(target, kind).unwrap();
            assert!(plain.size.is_finite(), "{plain}");
            let range = sizes(target, kind);
            assert!(range.contains(&plain.size), "{plain}");
            let ends = [*range.start(), *range.end()].map(|size| Fault { size, delay_s: 60.0, ..plain });
            for f in [plain, plain.at(Phase::Climb, 12.5).lasting(300.0), Fault { delay_s: 109.0, ..plain }].into_iter().chain(ends) {
                assert_eq!(f.to_string().parse::<Fault>(), Ok(f), "{f}");
            }
            for beyond in [range.start() - 0.5 * range.start().abs() - 1e-9, range.end() + 0.5 * range.end().abs() + 1e-9] {
                let text = Fault { size: beyond, ..plain }.to_string();
                assert!(text.parse::<Fault>().is_err_and(|e| e.contains("size")), "{text}");
            }
            n += 1;
        }
        assert_eq!(n, 13 * 13 + 41);
    }

    #[test]
    fn the_documented_texts_mean_what_is_said() {
        let f: Fault = "depth:stuck@dive+120s,300s".parse().unwrap();
        assert_eq!(f, Fault::new(Target::Depth, Kind::Stuck).unwrap().at(Phase::Dive, 120.0).lasting(300.0));
        let f: Fault = "pitch:bias=0.1+60s".parse().unwrap();
        assert_eq!((f.size, f.delay_s, f.phase, f.duration_s), (0.1, 60.0, None, None));
        let f: Fault = "pump:runaway=-1@climb".parse().unwrap();
        assert_eq!((f.size, f.phase), (-1.0, Some(Phase::Climb)));
        for (text, size, delay_s) in [
            ("depth:bias=1e+1+5s", 10.0, 5.0),
            ("depth:bias=+5", 5.0, 0.0),
            ("depth:bias=+5+7", 5.0, 7.0),
            ("pitch:garbage+109s", 0.0, 109.0),
        ] {
            let f: Fault = text.parse().unwrap();
            assert_eq!((f.size, f.delay_s), (size, delay_s), "{text}");
        }
        assert_eq!("depth:off,5m".parse::<Fault>().unwrap().duration_s, Some(300.0));
        for (bad, named) in [
            ("dept:off", "depth2"),
            ("depth:offf", "sentinel"),
            ("depth:bias=x", "finite"),
            ("depth:off@div", "inflect_low"),
            ("depth:off,1h", "time"),
            ("depth", "target:kind"),
            ("vehicle:fouling=-1", "0 to 20"),
            ("depth:intermittent=7", "share missing"),
            ("depth:off=3", "no size"),
        ] {
            let e = bad.parse::<Fault>().unwrap_err();
            assert!(e.contains(named), "{bad}: {e}");
        }
    }
}
