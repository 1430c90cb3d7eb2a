//! Switches that turn one mechanism of the diagnosis off, to see on scorecards whether it pays.
//!
//! A mechanism that is on trial asks [`is_on`] by its name and is listed in [`SWITCHES`]. Only programs built with the feature `ablation`
//! have the switches (they are named, separated by commas, in the environment variable `GLIDER_WITHOUT`); in others every one is on and
//! the question costs nothing.

/// Name of a mechanism, and what happens with it.
pub const SWITCHES: &[(&str, &str)] = &[
    ("clock_from_pressures", "the offset of two clocks that two pressure sensors show is taken out before anything is fitted"),
    ("depth_noise", "noise of depth that the vehicle file does not state is estimated"),
    ("discrepancy", "a model discrepancy is marginalised in every hypothesis"),
    ("unknown", "effects that nobody has named compete as hypotheses"),
    ("free_numbers", "trim, drag and lift of a file that nobody has calibrated have neither limit nor edge"),
    ("rare_scatter", "a calibration number beyond two tolerances costs more than by its normal prior"),
    ("ordinary_only", "a set is named only where its recalibration stays within three tolerances"),
    ("practical", "where the model has a discrepancy, an effect has to lower the error by a share"),
    ("heave_mass", "added mass across the hull is a nuisance with a wide tail"),
];

/// The environment variable that names what is off.
pub const WITHOUT: &str = "GLIDER_WITHOUT";

/// Whether a mechanism of [`SWITCHES`] is on.
#[must_use]
pub fn is_on(name: &str) -> bool {
    debug_assert!(SWITCHES.iter().any(|s| s.0 == name), "{name} is in no list of switches");
    !(cfg!(feature = "ablation") && std::env::var(WITHOUT).is_ok_and(|off| names(&off, name)))
}

/// Whether a list separated by commas names this.
fn names(list: &str, name: &str) -> bool {
    list.split(',').any(|n| n.trim() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_names_whole_names_only_and_without_the_feature_everything_is_on() {
        assert!(names("a, clock_from_pressures", "clock_from_pressures") && !names("clock_from_pressures_2", "clock_from_pressures"));
        assert!(!names("", "clock_from_pressures"));
        assert!(is_on(SWITCHES[0].0));
    }

    #[test]
    fn every_switch_has_a_name_of_its_own_and_says_what_it_does() {
        let mut seen: Vec<&str> = SWITCHES.iter().map(|s| s.0).collect();
        seen.sort_unstable();
        seen.dedup();
        assert!(seen.len() == SWITCHES.len() && SWITCHES.iter().all(|s| !s.1.is_empty()));
    }
}
