//! The one table of channels, `channels.toml`: what a channel is called in files of every origin, in which units it comes, what it can be.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

use serde::Deserialize;

/// A channel, by what it measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "channels.toml says what each is")]
pub enum Channel {
    Time,
    Segment,
    Pressure,
    Pitch,
    Roll,
    Heading,
    Ballast,
    Battery,
    Temperature,
    Density,
    GpsEast,
    GpsNorth,
    Speed,
    SteeringPressure,
    Depth,
    Salinity,
    AbsoluteSalinity,
    Conductivity,
    Latitude,
    Longitude,
    FixStatus,
    AboutLatitude,
    AboutLongitude,
    ReckonedLatitude,
    ReckonedLongitude,
    Fin,
    Thruster,
}

impl Channel {
    /// Those that are columns of the flight format.
    pub const OF_FLIGHT: [Self; 13] = [
        Self::Time,
        Self::Segment,
        Self::Pressure,
        Self::Pitch,
        Self::Roll,
        Self::Heading,
        Self::Ballast,
        Self::Battery,
        Self::Temperature,
        Self::Density,
        Self::GpsEast,
        Self::GpsNorth,
        Self::Speed,
    ];

    /// What the table says of it.
    #[must_use]
    pub fn usual(self) -> &'static Entry {
        &USUAL.entries[&self]
    }
}

/// A unit: factor to SI, what is taken off before, its spellings.
type Unit = (f64, f64, Vec<String>);

/// What a channel can be.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Column of the flight format.
    #[serde(default)]
    pub column: String,
    /// Usual names, best first; case does not matter.
    #[serde(default)]
    pub names: Vec<String>,
    /// CF standard names that a variable of any other name may have.
    #[serde(default)]
    pub standard: Vec<String>,
    #[serde(default)]
    units: String,
    /// Names whose unit is known though the file states none, with it.
    #[serde(default)]
    pub stated: Vec<(String, String)>,
    possible: Option<[f64; 2]>,
    #[serde(skip)]
    spellings: Vec<Unit>,
}

impl Entry {
    /// What it can be in SI, in the sea or a lake; values outside are no measurements.
    #[must_use]
    pub fn possible(&self) -> RangeInclusive<f64> {
        let [low, high] = self.possible.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        low..=high
    }

    /// What is taken off a number in `unit`, and by what it is multiplied then, to be in SI; none of a unit that is not known.
    #[must_use]
    pub fn in_si(&self, unit: &str) -> Option<(f64, f64)> {
        let known = self.spellings.iter().find(|u| u.2.iter().any(|s| s.eq_ignore_ascii_case(unit)))?;
        Some((known.1, known.0))
    }

    /// The same by a name that states its unit.
    #[must_use]
    pub fn by_name(&self, name: &str) -> Option<(f64, f64)> {
        self.stated.iter().find(|s| s.0.eq_ignore_ascii_case(name)).and_then(|s| self.in_si(&s.1))
    }

    /// All names, best first.
    pub fn all_names(&self) -> impl Iterator<Item = &str> {
        let usual = |name: &str| self.names.iter().any(|n| n.eq_ignore_ascii_case(name));
        self.names.iter().map(String::as_str).chain(self.stated.iter().map(|s| s.0.as_str()).filter(move |n| !usual(n)))
    }

    /// Whether a file may call it so.
    #[must_use]
    pub fn is_called(&self, name: &str) -> bool {
        self.all_names().any(|n| n.eq_ignore_ascii_case(name))
    }
}

/// The table.
#[derive(Clone, Debug, Deserialize)]
pub struct Channels {
    #[serde(default)]
    units: BTreeMap<String, Vec<Unit>>,
    /// Names by what they mean that is known, and that nothing is made of.
    #[serde(default)]
    unused: BTreeMap<String, Vec<String>>,
    #[serde(flatten)]
    entries: BTreeMap<Channel, Entry>,
}

static USUAL: LazyLock<Channels> = LazyLock::new(|| {
    let mut table: Channels = toml::from_str(include_str!("channels.toml")).expect("the table of this crate, which its tests read");
    table.spell();
    table
});

impl Channels {
    /// The table of this crate.
    #[must_use]
    pub fn usual() -> &'static Self {
        &USUAL
    }

    fn spell(&mut self) {
        for entry in self.entries.values_mut() {
            entry.spellings = self.units.get(&entry.units).cloned().unwrap_or_default();
        }
    }

    /// With what a lab's own table states, which comes first.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn with(&self, lab: &str) -> Result<Self, String> {
        let lab: Self = toml::from_str(lab).map_err(|e| e.to_string())?;
        let mut out = self.clone();
        for (kind, units) in lab.units {
            out.units.entry(kind).or_default().extend(units);
        }
        out.unused.extend(lab.unused);
        for (channel, own) in lab.entries {
            let Some(entry) = out.entries.get_mut(&channel) else { continue };
            entry.names.splice(0..0, own.names);
            entry.standard.splice(0..0, own.standard);
            entry.stated.splice(0..0, own.stated);
            entry.possible = own.possible.or(entry.possible);
        }
        out.spell();
        Ok(out)
    }

    /// Whether something of this name, standard name or source may be a channel.
    #[must_use]
    pub fn knows(&self, name: &str, standard: &str, source: &str) -> bool {
        let sensor = || self.of(Channel::Ballast).names.iter().any(|n| n.eq_ignore_ascii_case(source));
        self.entries.values().any(|e| e.is_called(name) || e.standard.iter().any(|s| s == standard)) || sensor()
    }

    /// What of these names is known and not used, in words; none of files without any.
    #[must_use]
    pub fn unused<'a>(&self, names: impl Iterator<Item = &'a str>) -> Option<String> {
        let names: Vec<&str> = names.collect();
        let of = |(what, known): (&String, &Vec<String>)| {
            let there: Vec<&str> = names.iter().copied().filter(|n| known.iter().any(|k| k.eq_ignore_ascii_case(n))).collect();
            (!there.is_empty()).then(|| format!("{what} ({})", there.join(", ")))
        };
        let all: Vec<String> = self.unused.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| format!("known and not used: {}", all.join(", ")))
    }

    /// What is known of a channel.
    #[must_use]
    pub fn of(&self, channel: Channel) -> &Entry {
        &self.entries[&channel]
    }
}

/// Names of the flight format's columns that state their units, with the factor to SI; of one channel the best first.
pub fn named() -> impl Iterator<Item = (&'static str, Channel, f64)> {
    Channel::OF_FLIGHT.into_iter().flat_map(|channel| {
        let entry = channel.usual();
        entry.stated.iter().filter_map(move |(name, unit)| Some((name.as_str(), channel, entry.in_si(unit)?.1)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_the_table_has_a_unit_that_is_known() {
        for (channel, entry) in &Channels::usual().entries {
            assert!(!entry.spellings.is_empty() && !entry.column.is_empty(), "{channel:?}");
            assert!(entry.stated.iter().all(|s| entry.in_si(&s.1).is_some()), "{channel:?}");
        }
        assert!(Channel::OF_FLIGHT.into_iter().all(|c| named().any(|n| n.1 == c)));
        assert_eq!(Channel::Temperature.usual().in_si("degF"), Some((32.0, 5.0 / 9.0)));
        assert_eq!(Channel::Pitch.usual().by_name("Pitch_DEG"), Some((0.0, std::f64::consts::PI / 180.0)));
    }

    #[test]
    fn what_is_known_and_not_used_is_listed_once() {
        let said = |names: &[&str]| Channels::usual().unused(names.iter().copied());
        assert_eq!(
            said(&["M_Altitude", "m_vacuum", "m_pitch", "x"]).as_deref(),
            Some("known and not used: altimeter (M_Altitude), vacuum (m_vacuum)")
        );
        assert_eq!(said(&["m_pitch", "sci_water_pressure"]), None);
        let usual = Channels::usual();
        assert!(usual.unused.values().flatten().all(|n| !usual.knows(n, "", "")), "what is used is not unused");
    }

    #[test]
    fn a_lab_s_own_names_and_units_come_first() {
        let lab = "[units]\nvolume = [[2e-6, 0, [\"strokes\"]]]\n[ballast]\nstated = [[\"pump\", \"strokes\"]]\n";
        let table = Channels::usual().with(lab).expect("a table");
        assert_eq!(table.of(Channel::Ballast).by_name("PUMP"), Some((0.0, 2e-6)));
        assert!(table.of(Channel::Ballast).is_called("m_de_oil_vol"));
        assert!(Channels::usual().with("[balast]\nnames = []").is_err() && Channels::usual().with("[ballast]\nname = []").is_err());
    }
}
