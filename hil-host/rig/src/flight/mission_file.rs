//! Mission files: what a person writes, checked before anything flies.
//!
//! ```toml
//! wings = "low-ar"            # standard (default) | low-ar
//! max_duration_h = 6          # default 6, or as long as the legs may take
//! surface_every = 2           # dives between surfacings; 0 (default): only at the end
//!
//! [[leg]]                     # up to 8, flown in order
//! dives = 4                   # default 4
//! depth_min_m = 3             # default 3
//! depth_max_m = 27            # default 27
//! goal = "best-glide"         # default; best-range (hotel_w) | best-speed | current (along_track_m_s) | fixed-pitch (pitch_deg)
//! ballast_cc = 230            # default 230
//! heading_deg = 90            # default 0
//! ```

use crate::flight::file_kinds::{Kind, expect};
use crate::flight::toml_place;
use crate::spelling::meant_name_or_path;
use anyhow::{Context, anyhow, bail};
use logs::record::bounded;
use serde::Deserialize;
use signals::{Goal, Leg, MAX_LEGS, Mission, MissionError, Wings};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;

/// Names of the built-in missions.
pub const BUILT_IN: [&str; 4] = ["shallow", "sea", "deep", "sweep"];

/// What each built-in mission is, for a list.
pub const WHAT: [&str; 4] = [
    "four dives between 3 and 27 m at best glide",
    "two dives from the surface to 200 m at best glide",
    "one dive from the surface to 1000 m at best glide",
    "eight dives to 180 m, each with its own pitch, drive and heading: the flight that an effect is named from",
];

/// Pitch (degrees; none: the controller's best glide), drive (cm³) and heading (degrees) of the dives of `sweep`.
const SWEEP: [(Option<i8>, i16, i16); 8] = [
    (None, 230, 0),
    (Some(26), 150, 90),
    (Some(35), 200, 180),
    (Some(22), 125, 270),
    (None, 200, 45),
    (Some(24), 135, 200),
    (Some(18), 180, 120),
    (Some(30), 230, 310),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MissionFile {
    wings: Option<Spanned<String>>,
    max_duration_h: Option<Spanned<f64>>,
    surface_every: Option<Spanned<i64>>,
    #[serde(default)]
    leg: Vec<Spanned<LegFile>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LegFile {
    dives: Option<Spanned<i64>>,
    depth_min_m: Option<Spanned<f64>>,
    depth_max_m: Option<Spanned<f64>>,
    goal: Option<Spanned<String>>,
    hotel_w: Option<Spanned<f64>>,
    along_track_m_s: Option<Spanned<f64>>,
    pitch_deg: Option<Spanned<f64>>,
    ballast_cc: Option<Spanned<f64>>,
    heading_deg: Option<Spanned<f64>>,
}

/// What the vehicle can do, for the check.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Deepest depth a mission may ask for, m.
    pub working_depth_m: f32,
    /// Pump range either side of neutral, m³.
    pub pump_m3: f32,
}

/// A built-in mission by name, or a mission file. The vehicle's limits are
/// checked by the caller, who knows the controller's configuration.
///
/// # Errors
/// One line: file, line, key, what is wrong, what would be right.
pub fn load(name: &str, limits: impl Fn(&Mission) -> Limits) -> anyhow::Result<Mission> {
    if let Some(mission) = built_in(name) {
        return Ok(mission);
    }
    let path = Path::new(name);
    if !path.exists() {
        let meant = meant_name_or_path(name, BUILT_IN, path);
        bail!("{name}: no such mission file (built-in missions: {}){meant}", BUILT_IN.join(", "));
    }
    expect(path, Kind::Mission)?;
    let text = bounded::text(path, bounded::DOCUMENT).with_context(|| format!("{name}: cannot read this mission file"))?;
    parse(&text, name, limits)
}

/// A built-in mission.
#[must_use]
pub fn built_in(name: &str) -> Option<Mission> {
    if name == "sweep" {
        return Some(mission(Wings::Standard, &SWEEP.map(sweep_leg), 48 * 3600, 1));
    }
    let (leg, hours) = match name {
        "shallow" => (Leg::default(), 6),
        "sea" => (Leg { dives: 2, depth_min_m: 0.0, depth_max_m: 200.0, ..Leg::default() }, 12),
        "deep" => (Leg { dives: 1, depth_min_m: 0.0, depth_max_m: 1000.0, ..Leg::default() }, 24),
        _ => return None,
    };
    let surface_every = if name == "shallow" { 0 } else { 1 };
    Some(mission(Wings::Standard, &[leg], hours * 3600, surface_every))
}

/// One dive of the sweep, from surface to surface.
fn sweep_leg((pitch_deg, ballast_cc, heading_deg): (Option<i8>, i16, i16)) -> Leg {
    Leg {
        dives: 1,
        depth_max_m: 180.0,
        goal: pitch_deg.map_or(Goal::BestGlide, |pitch| Goal::FixedPitch { pitch_rad: f32::from(pitch).to_radians() }),
        ballast_m3: (f64::from(ballast_cc) * 1e-6) as f32,
        heading_rad: f32::from(heading_deg).to_radians(),
        ..Leg::default()
    }
}

fn mission(wings: Wings, legs: &[Leg], max_duration_s: u32, surface_every: u16) -> Mission {
    Mission { wings, legs: legs.iter().copied().take(MAX_LEGS).collect(), max_duration_s, surface_every }
}

/// Where in the text a value stands, and how to complain about it.
struct Place<'a> {
    text: &'a str,
    name: &'a str,
}

impl Place<'_> {
    fn wrong(&self, at: &Range<usize>, what: &str) -> anyhow::Error {
        toml_place::wrong(self.text, self.name, at.start, what)
    }

    /// A number in its range, or the default.
    fn number(&self, key: &str, unit: &str, value: Option<&Spanned<f64>>, range: Range<f64>, default: f64) -> anyhow::Result<f64> {
        let Some(v) = value else { return Ok(default) };
        let x = *v.get_ref();
        if x >= range.start && x <= range.end {
            return Ok(x);
        }
        Err(self.wrong(&v.span(), &format!("{key} = {x} is outside {} to {} {unit}", range.start, range.end)))
    }

    fn count(&self, key: &str, value: Option<&Spanned<i64>>, range: Range<i64>, default: u16) -> anyhow::Result<u16> {
        let Some(v) = value else { return Ok(default) };
        let x = *v.get_ref();
        u16::try_from(x)
            .ok()
            .filter(|_| x >= range.start && x <= range.end)
            .ok_or_else(|| self.wrong(&v.span(), &format!("{key} = {x} is outside {} to {}", range.start, range.end)))
    }
}

/// Reads a mission from TOML text; `name` is used in messages.
///
/// # Errors
/// One line: file, line, key, what is wrong, what would be right.
pub fn parse(text: &str, name: &str, limits: impl Fn(&Mission) -> Limits) -> anyhow::Result<Mission> {
    let place = Place { text, name };
    let file: MissionFile = toml::from_str(text).map_err(|e| toml_place::refused(text, name, &e))?;
    let wings = match &file.wings {
        None => Wings::Standard,
        Some(w) => parse_wings(w.get_ref())
            .ok_or_else(|| place.wrong(&w.span(), &format!("wings = \"{}\" is not standard or low-ar", w.get_ref())))?,
    };
    let hours = place.number("max_duration_h", "h", file.max_duration_h.as_ref(), 0.01..60.0 * 24.0, 6.0)?;
    let surface_every = place.count("surface_every", file.surface_every.as_ref(), 0..10_000, 0)?;
    if file.leg.is_empty() {
        return Err(anyhow!("{name}: no [[leg]]; add at least one, e.g. [[leg]] with dives = 4"));
    }
    if let Some(extra) = file.leg.get(MAX_LEGS) {
        return Err(place.wrong(&extra.span(), &format!("more than {MAX_LEGS} legs; split the mission")));
    }
    let legs = file.leg.iter().map(|l| leg(&place, l.get_ref())).collect::<anyhow::Result<Vec<_>>>()?;
    let mut out = mission(wings, &legs, (hours * 3600.0) as u32, surface_every);
    if file.max_duration_h.is_none() {
        // Not asked for: as long as these legs may take.
        out.max_duration_s = out.max_duration_s.max(out.least_duration_s().ceil() as u32 + 1);
    }
    let limits = limits(&out);
    for (flown, written) in legs.iter().zip(&file.leg) {
        let w = written.get_ref();
        if !(flown.depth_max_m <= limits.working_depth_m) {
            let at = w.depth_max_m.as_ref().map_or(written.span(), Spanned::span);
            return Err(place.wrong(
                &at,
                &format!("depth_max_m = {} is deeper than the working depth of {} m", flown.depth_max_m, limits.working_depth_m),
            ));
        }
        let least_m3 = Mission::LEAST_BALLAST_SHARE * limits.pump_m3;
        if !(flown.ballast_m3 >= least_m3) {
            let at = w.ballast_cc.as_ref().map_or(written.span(), Spanned::span);
            let (asked, least) = (flown.ballast_m3 * 1e6, least_m3 * 1e6);
            return Err(place.wrong(
                &at,
                &format!("ballast_cc = {asked:.0} is less than {least:.0} cc: layered water and a squeezed hull may take it all"),
            ));
        }
        if !(flown.ballast_m3 <= limits.pump_m3) {
            let at = w.ballast_cc.as_ref().map_or(written.span(), Spanned::span);
            let (asked, has) = (flown.ballast_m3 * 1e6, limits.pump_m3 * 1e6);
            return Err(place.wrong(&at, &format!("ballast_cc = {asked:.0} is more than the pump's {has:.0} cc either side of neutral")));
        }
    }
    out.validate(limits.working_depth_m, limits.pump_m3).map_err(|e| match (e, &file.max_duration_h) {
        (MissionError::TooShort(least_s), Some(written)) => {
            let least_h = (f64::from(least_s) / 36.0).ceil() / 100.0;
            place.wrong(
                &written.span(),
                &format!("max_duration_h = {hours}: a slow glide takes {least_h} h for these legs; give it more, or leave it out"),
            )
        }
        _ => anyhow!("{name}: not flyable: {e:?}"),
    })?;
    Ok(out)
}

fn leg(place: &Place<'_>, l: &LegFile) -> anyhow::Result<Leg> {
    let default = Leg::default();
    let depth_min_m = place.number("depth_min_m", "m", l.depth_min_m.as_ref(), 0.0..6000.0, f64::from(default.depth_min_m))?;
    let depth_max_m = place.number("depth_max_m", "m", l.depth_max_m.as_ref(), 0.0..6000.0, f64::from(default.depth_max_m))?;
    if !(depth_max_m - depth_min_m >= 5.0) {
        let at = l.depth_max_m.as_ref().or(l.depth_min_m.as_ref()).map_or(0..0, Spanned::span);
        return Err(place.wrong(&at, &format!("depth band {depth_min_m} to {depth_max_m} m is not at least 5 m high")));
    }
    let goal_name = l.goal.as_ref().map_or("best-glide", |g| g.get_ref().as_str());
    let at = || l.goal.as_ref().map_or(0..0, Spanned::span);
    let belongs = |key: &str, value: Option<&Spanned<f64>>, goal: &str| match value {
        Some(v) if goal != goal_name => {
            Err(place.wrong(&v.span(), &format!("{key} belongs to goal = \"{goal}\", the goal here is \"{goal_name}\"")))
        }
        _ => Ok(()),
    };
    belongs("hotel_w", l.hotel_w.as_ref(), "best-range")?;
    belongs("along_track_m_s", l.along_track_m_s.as_ref(), "current")?;
    belongs("pitch_deg", l.pitch_deg.as_ref(), "fixed-pitch")?;
    let needs = |key: &str, value: Option<&Spanned<f64>>| match value {
        None => Err(place.wrong(&at(), &format!("goal = \"{goal_name}\" needs {key}"))),
        some => Ok(some.is_some()),
    };
    let goal = match goal_name {
        "best-glide" => Goal::BestGlide,
        "best-speed" => Goal::BestSpeed,
        "best-range" => {
            needs("hotel_w", l.hotel_w.as_ref())?;
            Goal::BestRange { hotel_w: place.number("hotel_w", "W", l.hotel_w.as_ref(), 0.0..100.0, 0.0)? as f32 }
        }
        "current" => {
            needs("along_track_m_s", l.along_track_m_s.as_ref())?;
            Goal::Current { along_track_m_s: place.number("along_track_m_s", "m/s", l.along_track_m_s.as_ref(), -1.0..1.0, 0.0)? as f32 }
        }
        "fixed-pitch" => {
            needs("pitch_deg", l.pitch_deg.as_ref())?;
            Goal::FixedPitch { pitch_rad: place.number("pitch_deg", "deg", l.pitch_deg.as_ref(), 6.0..45.0, 20.0)?.to_radians() as f32 }
        }
        other => {
            return Err(
                place.wrong(&at(), &format!("goal = \"{other}\" is not best-glide, best-range, best-speed, current or fixed-pitch"))
            );
        }
    };
    let ballast_cc = place.number("ballast_cc", "cc", l.ballast_cc.as_ref(), 10.0..1000.0, 1e6 * f64::from(default.ballast_m3))?;
    Ok(Leg {
        dives: place.count("dives", l.dives.as_ref(), 1..10_000, default.dives)?,
        depth_min_m: depth_min_m as f32,
        depth_max_m: depth_max_m as f32,
        goal,
        ballast_m3: (ballast_cc * 1e-6) as f32,
        heading_rad: place.number("heading_deg", "deg", l.heading_deg.as_ref(), -360.0..360.0, 0.0)?.to_radians() as f32,
    })
}

/// `standard` or `low-ar` (also `low_ar`, as vehicle files write it).
#[must_use]
pub fn parse_wings(name: &str) -> Option<Wings> {
    match name {
        "standard" => Some(Wings::Standard),
        "low-ar" | "low_ar" => Some(Wings::LowAspectRatio),
        _ => None,
    }
}

/// The name [`parse_wings`] reads.
#[must_use]
pub fn wings_name(wings: Wings) -> &'static str {
    match wings {
        Wings::Standard => "standard",
        Wings::LowAspectRatio => "low-ar",
    }
}

/// Writes a mission as the text [`parse`] reads.
#[must_use]
pub fn write(mission: &Mission) -> String {
    use std::fmt::Write as _;
    let mut s = format!(
        "wings = \"{}\"\nmax_duration_h = {}\nsurface_every = {}\n",
        wings_name(mission.wings),
        f64::from(mission.max_duration_s) / 3600.0,
        mission.surface_every
    );
    for l in &mission.legs {
        // Rounded to what a person would have written: f32 holds 7 digits.
        let short = |x: f32, scale: f64| (f64::from(x) * scale * 1e4).round() / 1e4;
        let _ = writeln!(
            s,
            "\n[[leg]]\ndives = {}\ndepth_min_m = {}\ndepth_max_m = {}",
            l.dives,
            short(l.depth_min_m, 1.0),
            short(l.depth_max_m, 1.0)
        );
        let _ = match l.goal {
            Goal::BestGlide => writeln!(s, "goal = \"best-glide\""),
            Goal::BestSpeed => writeln!(s, "goal = \"best-speed\""),
            Goal::BestRange { hotel_w } => writeln!(s, "goal = \"best-range\"\nhotel_w = {}", short(hotel_w, 1.0)),
            Goal::Current { along_track_m_s } => writeln!(s, "goal = \"current\"\nalong_track_m_s = {}", short(along_track_m_s, 1.0)),
            Goal::FixedPitch { pitch_rad } => writeln!(s, "goal = \"fixed-pitch\"\npitch_deg = {}", short(pitch_rad, 1f64.to_degrees())),
        };
        let _ = writeln!(s, "ballast_cc = {}\nheading_deg = {}", short(l.ballast_m3, 1e6), short(l.heading_rad, 1f64.to_degrees()));
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Mission, String> {
        parse(text, "m.toml", |_| Limits { working_depth_m: 200.0, pump_m3: 236e-6 }).map_err(|e| format!("{e:#}"))
    }

    #[test]
    fn an_empty_leg_is_the_default_leg_and_legs_come_in_order() {
        let m = read("[[leg]]\n[[leg]]\ndives = 2\ngoal = \"fixed-pitch\"\npitch_deg = 20\nheading_deg = 90\n").unwrap();
        assert_eq!(m.legs[0], Leg::default());
        assert_eq!(m.legs[1].dives, 2);
        assert!(matches!(m.legs[1].goal, Goal::FixedPitch { pitch_rad } if (pitch_rad - 20f32.to_radians()).abs() < 1e-6));
        assert!((m.legs[1].heading_rad - 90f32.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn prop_what_is_written_is_read_back() {
        for name in BUILT_IN {
            let m = built_in(name).unwrap();
            let most = m.legs.iter().map(|l| l.ballast_m3).fold(0.0, f32::max);
            let again = parse(&write(&m), "m.toml", |_| Limits { working_depth_m: 1000.0, pump_m3: most }).unwrap();
            assert_eq!(m, again, "{name}");
        }
        let text = "wings = \"low-ar\"\n[[leg]]\ngoal = \"best-range\"\nhotel_w = 2\n[[leg]]\ngoal = \"current\"\nalong_track_m_s = -0.1\n";
        let m = read(text).unwrap();
        assert_eq!(m.wings, Wings::LowAspectRatio);
        assert_eq!(read(&write(&m)).unwrap(), m);
    }

    #[test]
    fn each_mistake_is_named_with_its_line_and_the_fix_on_one_line() {
        for (text, line, word) in [
            ("wings = \"big\"\n[[leg]]\n", "m.toml:1:9", "low-ar"),
            ("[[leg]]\ndives = 0\n", "m.toml:2:9", "1 to 10000"),
            ("[[leg]]\ndives = 1.5\n", "m.toml:2:9", "whole number"),
            ("[[leg]]\ndepth_max_m = nan\n", "m.toml:2:15", "outside"),
            ("[[leg]]\ndepth_max_m = 4\n", "m.toml:2:15", "5 m"),
            ("[[leg]]\ndepth_max_m = 500\n", "m.toml:2:15", "working depth"),
            ("[[leg]]\nballast_cc = 400\n", "m.toml:2:14", "pump"),
            ("[[leg]]\nballast_cc = 90\n", "m.toml:2:14", "94 cc"),
            ("max_duration_h = 1\n[[leg]]\n", "m.toml:1:18", "slow glide"),
            ("[[leg]]\ngoal = \"far\"\n", "m.toml:2:8", "best-glide"),
            ("[[leg]]\ngoal = \"fixed-pitch\"\n", "m.toml:2:8", "pitch_deg"),
            ("[[leg]]\npitch_deg = 20\n", "m.toml:2:13", "fixed-pitch"),
            ("[[leg]]\ndepht_max_m = 20\n", "m.toml:2:1", "unknown field"),
            ("[[leg\n", "m.toml:1:", ""),
            ("dives = 3\n", "m.toml:1:1", "unknown field"),
            ("wings = \"standard\"\n", "m.toml", "[[leg]]"),
        ] {
            let e = read(text).unwrap_err();
            assert!(e.starts_with(line) && e.contains(word) && !e.contains('\n'), "{text:?} gave {e:?}");
        }
    }
}
