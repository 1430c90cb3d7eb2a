//! Passages of a mission: from the last fix before a dive to the first after it, with the way that the vehicle made through the water.
//!
//! Speed through the water is not modelled from buoyancy, which trim and growth put off, but from the measured vertical velocity: the
//! path's angle follows from pitch by the vehicle's lift and drag, horizontal speed is vertical speed over its tangent, direction is the
//! measured heading. What drag and compass are off by is a factor that the filters of [`super::current`] learn.

use super::current::Vector;
use hydro::effects::{ForceModel, Sensed};
use hydro::glide::{Trim, steady};
use logs::Vehicle;
use logs::import::{Origin, position};
use logs::record::flight::Flight;

/// Where positions count from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frame {
    /// A place on the globe: latitude and longitude, deg.
    Globe(f64, f64),
    /// The launch point of this segment, wherever that is.
    Segment(u32),
}

/// A GPS fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Time, s.
    pub time_s: f64,
    /// East and north, m.
    pub place: Vector,
}

/// From the last fix before a dive to the first after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Last fix before.
    pub from: Fix,
    /// First fix after.
    pub to: Fix,
    /// Way through the water by pitch, depth and heading, m.
    pub through_water: Vector,
    /// Measured pitch, its mean size under way, rad.
    pub pitch_rad: f64,
}

impl Passage {
    /// Time from fix to fix, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.to.time_s - self.from.time_s
    }

    /// Way over ground, m.
    #[must_use]
    pub fn way(&self) -> Vector {
        self.to.place - self.from.place
    }
}

/// The passages of a mission, and where it is now.
#[derive(Clone, Debug, Default)]
pub struct Passages {
    /// In the order of time.
    pub all: Vec<Passage>,
    /// The last fix of all, and where its place counts from.
    pub last: Option<(Fix, Frame)>,
    /// The first of the passages whose places count from there too.
    pub same_frame_from: usize,
    /// Latitude, deg, where it is known.
    pub latitude_deg: Option<f64>,
}

/// A glider deeper than this has dived between two fixes, Pa (2 dbar above the depth at which waves leave an antenna alone; guess).
const DIVED_PA: f64 = 5e4;
/// Readings so far above the least of a stay at the surface are awash: the receiver extrapolates what it no longer hears, Pa (guess).
const AWASH_PA: f64 = 5e3;
/// Shallower than this it floats, Pa.
const FLOATING_PA: f64 = 1e4;
/// Flatter than this it turns, rad.
const TURNING_RAD: f64 = 0.1;
/// A gap of the log that is no glide, s; no glider is faster than this through the water, m/s.
const LOG_GAP_S: f64 = 600.0;
const FASTEST_M_S: f64 = 1.0;

/// Tangent of the path's angle by measured pitch, for one vehicle.
struct Paths<'a> {
    law: ForceModel<'a>,
    tangents: Vec<f64>,
}

/// Steps of the table over pitch, rad.
const PITCH_STEP_RAD: f64 = 0.01;

impl<'a> Paths<'a> {
    fn new(vehicle: &'a Vehicle) -> Self {
        let law = ForceModel::new(vehicle.constants, &vehicle.effects);
        let tangent = |k: u32| {
            // Drag depends on speed little: at the buoyancy of an ordinary glide (2 N).
            let trim = Trim { pitch_rad: -PITCH_STEP_RAD * f64::from(k), net_buoyancy_n: -2.0, rho_kg_m3: 1025.0 };
            steady(&law, &trim).map_or(f64::NAN, |g| g.lowest.gamma_rad.abs().tan())
        };
        let tangents = (0..157).map(tangent).collect();
        Self { law, tangents }
    }

    /// True pitch of a measured one, rad, and the tangent of the path's angle; NaN where no glide is that flat.
    fn of(&self, pitch_rad: f64) -> (f64, f64) {
        let sensed = Sensed {
            time_s: 0.0,
            pitch_rad,
            ballast_m3: 0.0,
            density_kg_m3: 1025.0,
            temperature_degc: 10.0,
            hull_degc: 10.0,
            pressure_pa: 0.0,
        };
        let pitch = self.law.truth(sensed).pitch_rad;
        let at = (pitch.abs() / PITCH_STEP_RAD).min(self.tangents.len() as f64 - 1.001);
        let (k, share) = (at as usize, at.fract());
        (pitch, self.tangents[k] * (1.0 - share) + self.tangents[k + 1] * share)
    }
}

/// Way through the water row by row, m, from the first row on.
fn through_water(flight: &Flight, vehicle: &Vehicle) -> (Vec<Vector>, Vec<f64>) {
    let paths = Paths::new(vehicle);
    let (mut ways, mut pitches) = (vec![Vector::default(); flight.len()], vec![f64::NAN; flight.len()]);
    let (mut speed, mut direction) = (f64::NAN, Vector::default());
    let mut before: Option<usize> = None;
    for i in 0..flight.len() {
        ways[i] = ways[i.saturating_sub(1)];
        let (heading, pressure) = (flight.heading_rad[i], flight.pressure_pa[i]);
        if heading.is_finite() {
            direction = Vector::new(heading.sin(), heading.cos());
        }
        if !pressure.is_finite() {
            continue;
        }
        if let Some(b) = before.filter(|b| flight.segment[*b] == flight.segment[i] && flight.time_s[i] - flight.time_s[*b] < LOG_GAP_S) {
            let time_s = flight.time_s[i] - flight.time_s[b];
            let density = if flight.density_kg_m3[i].is_finite() { flight.density_kg_m3[i] } else { 1025.0 };
            let rise = (flight.pressure_pa[b] - pressure) / (density * vehicle.constants.gravity_m_s2 * time_s);
            let (pitch, tangent) = paths.of(flight.pitch_rad[i]);
            let now = rise.abs() / tangent;
            if pitch.abs() > TURNING_RAD && pitch * rise > 0.0 && now < FASTEST_M_S {
                speed = now;
                pitches[i] = flight.pitch_rad[i].abs();
            }
            // In a turn it goes on as fast as before.
            let afloat = pressure.max(flight.pressure_pa[b]) < FLOATING_PA;
            if speed.is_finite() && !afloat {
                ways[i] += direction * (speed * time_s);
            }
        } else {
            speed = f64::NAN;
        }
        before = Some(i);
    }
    (ways, pitches)
}

/// A stay at the surface: rows of its first and last sound fix.
struct Stay {
    rows: [usize; 2],
    frame: Frame,
}

/// Passages of a flight. `origins` are where its segments' planes lie on the globe, if that is known; else passages are those inside
/// of a segment.
#[must_use]
pub fn passages(flight: &Flight, vehicle: &Vehicle, origins: &[Origin]) -> Passages {
    let (ways, pitches) = through_water(flight, vehicle);
    // Place of a fix by where it counts from: the mission's first fix on the globe, else its segment's launch point.
    let first = (0..flight.len()).find_map(|i| position::on_the_globe(flight, origins, i));
    let placed = |i: usize| match first.zip(position::on_the_globe(flight, origins, i)) {
        Some((first, own)) => (position::local(first, own), Frame::Globe(first.lat_deg, first.lon_deg)),
        None => ((flight.gps_east_m[i], flight.gps_north_m[i]), Frame::Segment(flight.segment[i])),
    };
    let fix = |i: usize| {
        let (east_m, north_m) = placed(i).0;
        Fix { time_s: flight.time_s[i], place: Vector::new(east_m, north_m) }
    };
    let mut out = Passages { latitude_deg: first.map(|f| f.lat_deg), ..Passages::default() };
    let mut last: Option<Stay> = None;
    for rows in stays(flight) {
        let least = rows.iter().map(|i| flight.pressure_pa[*i]).fold(f64::INFINITY, f64::min);
        let sound: Vec<usize> = rows.into_iter().filter(|i| !(flight.pressure_pa[*i] > least + AWASH_PA)).collect();
        let (Some(first), Some(end)) = (sound.first(), sound.last()) else { continue };
        let stay = Stay { rows: [*first, *end], frame: placed(*first).1 };
        if last.as_ref().is_some_and(|l| l.frame != stay.frame) {
            out.same_frame_from = out.all.len();
        }
        if let Some(from) = last.filter(|l| l.frame == stay.frame).map(|l| l.rows[1]) {
            let under_way: Vec<f64> = pitches[from..*first].iter().copied().filter(|p| p.is_finite()).collect();
            let pitch_rad = under_way.iter().sum::<f64>() / under_way.len() as f64;
            let through_water = ways[*first] - ways[from];
            if pitch_rad.is_finite() {
                out.all.push(Passage { from: fix(from), to: fix(*first), through_water, pitch_rad });
            }
        }
        out.last = Some((fix(*end), stay.frame));
        last = Some(stay);
    }
    out
}

/// Rows of fixes, those of one stay at the surface together: no dive and no other frame between them.
fn stays(flight: &Flight) -> Vec<Vec<usize>> {
    let mut out: Vec<Vec<usize>> = Vec::new();
    let (mut dived, mut segment) = (true, None);
    for i in 0..flight.len() {
        dived |= flight.pressure_pa[i] > DIVED_PA;
        if !(flight.gps_east_m[i].is_finite() && flight.gps_north_m[i].is_finite()) {
            continue;
        }
        match out.last_mut().filter(|_| !dived && segment == Some(flight.segment[i])) {
            Some(stay) => stay.push(i),
            None => out.push(vec![i]),
        }
        (dived, segment) = (false, Some(flight.segment[i]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dive to 60 m and back on one course at 26°, with fixes at both ends and one awash; then a stay without fixes.
    fn dive(heading_rad: f64) -> Flight {
        let mut f = Flight::blank(200);
        for i in 0..200 {
            let depth_m = (100.0 - (i as f64 - 100.0).abs() - 5.0).max(0.0) * 0.6;
            f.time_s[i] = 10.0 * i as f64;
            f.pressure_pa[i] = depth_m * 1025.0 * 9.81;
            f.pitch_rad[i] = 0.45 * if i < 100 { -1.0 } else { 1.0 };
            f.heading_rad[i] = heading_rad;
            f.density_kg_m3[i] = 1025.0;
        }
        for (i, east, north) in [(0, 0.0, 0.0), (3, 4.0, 8.0), (6, 900.0, 900.0), (197, 200.0, 400.0)] {
            (f.gps_east_m[i], f.gps_north_m[i]) = (east, north);
        }
        f
    }

    fn comet() -> Vehicle {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/comet.toml");
        logs::vehicle::read(&path).expect("a vehicle")
    }

    #[test]
    fn a_dive_between_fixes_is_a_passage_with_its_way_through_the_water() {
        let found = passages(&dive(0.5), &comet(), &[]);
        let [one] = found.all.as_slice() else { panic!("{:?}", found.all) };
        // The receiver awash says nothing; the last fix before the dive counts.
        assert_eq!((one.from.time_s, one.to.time_s, one.way()), (30.0, 1970.0, Vector::new(196.0, 392.0)));
        assert_eq!(found.last.map(|l| l.1), Some(Frame::Segment(0)));
        // 6 cm/s up and down on a path some 3° steeper than the pitch of 26°.
        let (speed, direction) = (one.through_water.norm() / 1900.0, one.through_water.arg());
        assert!((0.095..0.115).contains(&speed), "{speed}");
        assert!((direction - (std::f64::consts::FRAC_PI_2 - 0.5)).abs() < 0.01, "{direction}");
    }

    #[test]
    fn places_on_the_globe_join_the_segments() {
        let mut f = dive(0.0);
        f.segment[150..].fill(1);
        assert!(passages(&f, &comet(), &[]).all.is_empty());
        let origin = |segment, lat_deg| Origin { segment, unix_s: 0.0, lat_deg, lon_deg: -90.0 };
        let found = passages(&f, &comet(), &[origin(0, 27.0), origin(1, 27.01)]);
        assert_eq!(found.all.len(), 1);
        let north = found.all[0].way().im;
        assert!((north - (392.0 + 1111.9)).abs() < 1.0, "{north} m");
        assert_eq!(found.last.map(|l| l.1), Some(Frame::Globe(27.0, -90.0)));
    }
}
