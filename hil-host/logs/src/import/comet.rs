//! The public Comet 2016 flight: six rows of a numpy array become a flight.
//!
//! Source: `data/gliderflight_data.npy` of the Python package `gliderflight`
//! 1.2.1 (L. Merckelbach, MIT licence): Unix time s, pressure bar, pitch rad,
//! ballast cc, in-situ density kg/m³, speed through water of a DVL m/s (dives
//! below 12 dbar only). **Its pitch is already corrected** by the owner,
//! 0.86 · measured − 0.004 rad; what the compass reported is kept beside it as
//! `m_pitch_raw_rad`. The array has no temperature, roll, heading or position.

use super::npy;
use crate::record::flight::Flight;
use crate::record::steady::{SteadyFilter, steady, vertical_velocity};

/// The owner's pitch correction: scale, - (script that made the array).
pub const PITCH_SCALE: f64 = 0.86;
/// The owner's pitch correction: offset, rad (the same).
pub const PITCH_OFFSET_RAD: f64 = -0.004;
/// Silence longer than this ends a segment, s: the surfacings of this flight last 180–220 s.
const SEGMENT_GAP_S: f64 = 60.0;
/// Depth of the flight's saw-teeth, m.
const DEPTH_M: f64 = 41.0;

/// Converts the bytes of the array.
///
/// # Errors
/// Why the array is not this flight.
pub fn flight(bytes: &[u8]) -> Result<Flight, String> {
    let rows = npy::rows(bytes).map_err(|e| format!("the array {e}"))?;
    let [time, pressure_bar, pitch, ballast_cc, density, speed] = rows.as_slice() else {
        return Err(format!("the array has {} rows, the flight has six", rows.len()));
    };
    let follows = |i: &usize| time[*i].is_finite() && (*i == 0 || time[*i] > time[*i - 1]);
    if let Some(i) = (0..time.len()).find(|i| !follows(i)) {
        return Err(format!("time {} of the array is no number, or not after the one before it", i + 1));
    }
    let none = vec![f64::NAN; time.len()];
    let mut segment = vec![0_u32; time.len()];
    for i in 1..time.len() {
        segment[i] = segment[i - 1] + u32::from(time[i] - time[i - 1] > SEGMENT_GAP_S);
    }
    let mut flight = Flight {
        name: "comet2016".into(),
        time_s: time.iter().map(|t| t - time[0]).collect(),
        segment,
        pressure_pa: pressure_bar.iter().map(|p| p * 1e5).collect(),
        pitch_rad: pitch.clone(),
        ballast_m3: ballast_cc.iter().map(|v| v * 1e-6).collect(),
        density_kg_m3: density.clone(),
        speed_m_s: Some(speed.clone()),
        roll_rad: none.clone(),
        heading_rad: none.clone(),
        battery_mass_m: none.clone(),
        temperature_degc: none.clone(),
        gps_east_m: none.clone(),
        gps_north_m: none,
        ..Flight::default()
    };
    let raw = pitch.iter().map(|p| (p - PITCH_OFFSET_RAD) / PITCH_SCALE).collect();
    let steady = steady(&flight, &SteadyFilter::for_depth(DEPTH_M)).into_iter().map(|s| f64::from(u8::from(s))).collect();
    let vertical = vertical_velocity(&flight);
    flight.extra.insert("m_pitch_raw_rad".into(), raw);
    flight.extra.insert("w_obs_m_s".into(), vertical);
    flight.extra.insert("steady".into(), steady);
    Ok(flight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An array of six rows with these times, all else 0.
    fn array(times: &[f64]) -> Vec<u8> {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': (6, {}), }}", times.len());
        let values = times.iter().copied().chain(std::iter::repeat_n(0.0, 5 * times.len()));
        let sized = [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
        sized.into_iter().chain(values.flat_map(f64::to_le_bytes)).collect()
    }

    /// The length of an infinite time on a 1 s grid overflowed.
    #[test]
    fn regress_a_time_that_is_no_number_or_runs_backward_is_named() {
        assert_eq!(flight(&array(&[0.0, 4.0, 8.0])).map(|f| f.time_s), Ok(vec![0.0, 4.0, 8.0]));
        for (times, place) in
            [([f64::NEG_INFINITY, 4.0, 8.0], 1), ([0.0, f64::INFINITY, 8.0], 2), ([0.0, 4.0, f64::NAN], 3), ([0.0, 4.0, 4.0], 3)]
        {
            let e = flight(&array(&times)).map(|f| f.len()).expect_err("refused");
            assert!(e.starts_with(&format!("time {place} of the array")), "{times:?}: {e}");
        }
    }
}
