//! Heading by the fin: proportional, straight when the heading is not known.

use crate::angle::wrap;
use crate::bound::Bound;
use crate::config::Config;

/// Heading errors smaller than this are left alone, rad (2°).
const DEADBAND_RAD: f32 = 0.035;

/// Fin angle, rad, positive turns to starboard.
pub(crate) fn fin_rad(config: &Config, wanted_rad: f32, heading_rad: Option<f32>) -> f32 {
    let Some(heading) = heading_rad else { return 0.0 };
    let error = wrap(wanted_rad - heading);
    if !(error.abs() > DEADBAND_RAD) {
        return 0.0;
    }
    (config.heading_gain * error).at_least(-config.fin_rad).at_most(config.fin_rad)
}

#[cfg(test)]
mod tests {
    use super::fin_rad;
    use crate::config::Config;

    #[test]
    fn turns_the_short_way_and_stays_straight_when_blind() {
        let c = Config::default();
        assert!(fin_rad(&c, 0.1, Some(6.2)) > 0.0, "north-east of north-west is to starboard");
        assert!(fin_rad(&c, 6.2, Some(0.1)) < 0.0);
        assert_eq!(fin_rad(&c, 1.0, None), 0.0);
        assert_eq!(fin_rad(&c, 1.0, Some(1.01)), 0.0);
        assert!(fin_rad(&c, f32::NAN, Some(1.0)).abs() <= c.fin_rad);
    }
}
