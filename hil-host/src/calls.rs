//! A mission by the logs of its calls, one a call: the glider's own dialogue at the surface has fixes and the next waypoint, a message of a
//! surfacing in it how long and how fast the glides were.
//!
//! No message says a heading: the way through the water is taken to lead from the last fix before the dive to the waypoint that was ordered
//! then. What currents, steering and turns make of that is left to the filters.

use discovery::forecast::current::Vector;
use discovery::forecast::passages::{Fix, Frame, Passage, Passages};
use logs::import::calendar::iso_8601;
use logs::import::position::{self, degrees_of_minutes};
use rig::flight::surfacing;
use signals::Surfacing;

/// Fixes so far apart have a dive between them, s (guess).
const DIVE_S: f64 = 600.0;
/// Older fixes are none, s.
const OLD_S: f64 = 86_400.0;
const MONTHS: [&str; 12] = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

/// What the log of a call says.
#[derive(Clone, Debug, Default)]
pub struct Call {
    fixes: Vec<position::Fix>,
    /// Latitude and longitude, deg.
    waypoint: Option<[f64; 2]>,
    message: Option<Surfacing>,
}

/// Unix time of `Sat Mar 28 20:40:38 2026`, UTC.
fn moment(words: &[&str]) -> Option<f64> {
    let [_, month, day, clock, year, ..] = words else { return None };
    let month = 1 + MONTHS.iter().position(|m| m == month)?;
    iso_8601(&format!("{year}-{month:02}-{day:0>2}T{clock}"))
}

/// Degrees of a position in degrees and minutes; fills such as 69696969 are none.
fn degrees(word: &str, most: f64) -> Option<f64> {
    word.parse().ok().map(degrees_of_minutes).filter(|deg: &f64| deg.abs() <= most)
}

impl Call {
    /// Reads the log of a glider's terminal.
    #[must_use]
    pub fn of(log: &[u8]) -> Self {
        let (mut fixes, mut now_s, mut waypoint) = (Vec::new(), None, [None; 2]);
        for line in String::from_utf8_lossy(log).lines() {
            let after = |key: &str| line.split_once(key).map(|(_, rest)| rest.split_whitespace().collect::<Vec<_>>());
            if let Some(words) = after("Curr Time:") {
                now_s = moment(&words);
            } else if let Some(&[lat, "N", lon, "E", "measured", age, ..]) = after("GPS Location:").as_deref() {
                let age_s = age.parse().ok().filter(|s: &f64| (0.0..OLD_S).contains(s));
                let fix = |((now_s, age_s), (lat_deg, lon_deg))| position::Fix { time_s: now_s - age_s, lat_deg, lon_deg };
                fixes.extend(now_s.zip(age_s).zip(degrees(lat, 90.0).zip(degrees(lon, 180.0))).map(fix));
            }
            for (place, (key, most)) in waypoint.iter_mut().zip([("c_wpt_lat(lat)=", 90.0), ("c_wpt_lon(lon)=", 180.0)]) {
                *place = after(key).and_then(|words| degrees(words.first()?, most)).or(*place);
            }
        }
        fixes.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let [lat, lon] = waypoint;
        let message = surfacing::read(log).ok().and_then(|mut received| received.messages.pop()).map(|(_, message)| message);
        Self { fixes, waypoint: lat.zip(lon).map(|(lat, lon)| [lat, lon]), message }
    }
}

/// Passages of a mission by its calls, Unix time of their time 0, and how many dives were left out without a message or a waypoint; none
/// without a fix.
#[must_use]
pub fn passages(mut calls: Vec<Call>) -> Option<(Passages, f64, usize)> {
    calls.retain(|call| !call.fixes.is_empty());
    calls.sort_by(|a, b| a.fixes[0].time_s.total_cmp(&b.fixes[0].time_s));
    let zero = calls.first()?.fixes[0];
    let place = |fix: position::Fix| {
        let (east_m, north_m) = position::local(zero, fix);
        Vector::new(east_m, north_m)
    };
    let (mut out, mut left_out) = (Passages { latitude_deg: Some(zero.lat_deg), ..Passages::default() }, 0);
    let (mut last, mut waypoint): (Option<Fix>, Option<[f64; 2]>) = (None, None);
    for call in &calls {
        for fix in &call.fixes {
            let to = Fix { time_s: fix.time_s - zero.time_s, place: place(*fix) };
            if let Some(from) = last.filter(|from| to.time_s - from.time_s > DIVE_S) {
                let passage = call.message.as_ref().zip(waypoint).map(|(message, [lat_deg, lon_deg])| {
                    let ahead = place(position::Fix { lat_deg, lon_deg, ..zero }) - from.place;
                    let glides = message.glides.map(|g| (f64::from(g.time_s), g));
                    let forward_m: f64 = glides.iter().map(|(s, g)| s * f64::from(g.speed_m_s) * f64::from(g.path_rad).cos()).sum();
                    let pitch: f64 = glides.iter().map(|(s, g)| s * f64::from(g.pitch_rad.abs())).sum();
                    let pitch_rad = pitch / glides.iter().map(|g| g.0).sum::<f64>();
                    Passage { from, to, through_water: ahead * (forward_m / ahead.norm()), pitch_rad }
                });
                let sound = passage.filter(|p| p.pitch_rad.is_finite() && p.through_water.norm().is_finite());
                left_out += usize::from(sound.is_none());
                out.all.extend(sound);
            }
            if last.is_none_or(|from| to.time_s > from.time_s) {
                last = Some(to);
            }
        }
        waypoint = call.waypoint.or(waypoint);
    }
    out.last = last.map(|fix| (fix, Frame::Globe(zero.lat_deg, zero.lon_deg)));
    Some((out, zero.time_s, left_out))
}
