//! Magnetic variation by date and place.

use crate::record::seawater::Place;

/// Days of the Julian calendar up to 1970-01-01 (noon to noon).
const JULIAN_DAY_OF_1970: i32 = 2_440_588;
/// The International Geomagnetic Reference Field is good for so long behind its last year, Unix s: 2030.
const LAST_S: f64 = 1.893_456e9;

/// Magnetic variation, deg, east positive: of the International Geomagnetic Reference Field of the 13th generation (good to half a
/// degree away from the poles; a crust's own field is not in it). None before 1970, from 2030 on, and at a magnetic pole.
pub(super) fn variation_deg(place: Place, unix_s: f64) -> Option<f64> {
    if !(0.0..LAST_S).contains(&unix_s) {
        return None;
    }
    let date = time::Date::from_julian_day(JULIAN_DAY_OF_1970 + (unix_s / 86_400.0) as i32).ok()?;
    match igrf::declination(place.lat_deg, place.lon_deg, 0, date) {
        Ok(field) | Err(igrf::Error::DateOutOfRange(field)) => Some(field.d).filter(|d| d.is_finite()),
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validate_the_variation_is_that_of_charts() {
        // NOAA's calculator of the magnetic field (IGRF), whole and half degrees: Seattle 2016, Cape Town 2020, Bornholm 2016.
        for (lat_deg, lon_deg, unix_s, want) in
            [(47.6, -122.3, 1.4645e9, 16.1), (-34.0, 18.4, 1.5937e9, -25.5), (55.2, 15.0, 1.4666e9, 4.6)]
        {
            let got = variation_deg(Place { lon_deg, lat_deg }, unix_s).expect("a variation");
            assert!((got - want).abs() < 0.7, "{lat_deg} {lon_deg}: {got}, not {want}");
        }
        assert_eq!(variation_deg(Place { lon_deg: 0.0, lat_deg: 0.0 }, 4e9), None);
    }
}
