//! The closed-loop scorecard as a picture of itself: any change of law or plant shows here, line by line.

use hil_host::score::control_law::{Band, Disturbance, cases, fly_all};
use signals::Wings;

const KEPT: &str = include_str!("../../data/scorecard/flight.txt");

/// `GLIDER_WRITE_SCORECARD=1 cargo test -p tests scorecard_` writes the file anew; look at the difference before keeping it.
#[test]
fn scorecard_of_both_wings_in_all_bands_is_the_kept_one() {
    let bands = [Band::Shallow, Band::Sea, Band::Deep];
    let mut disturbances = Disturbance::FIXED.to_vec();
    disturbances.extend(Disturbance::hidden());
    let all = cases(&[Wings::Standard, Wings::LowAspectRatio], &bands, &disturbances, 1);
    let scores = fly_all(&all, || ()).expect("cases can be flown");
    let mut text = String::from("band     disturbance          wings          pilot  L/D   share  near  J/m   beyond  turn\n");
    for s in &scores {
        text += &format!(
            "{:8} {:20} {:14} {:6} {:.2}  {:.2}   {:.1}   {:4.1}  {:4.1}    {:.0}\n",
            format!("{:?}", s.case.band),
            s.case.disturbance.name(),
            format!("{:?}", s.case.wings),
            format!("{:?}", s.case.pilot),
            s.achieved_l_over_d,
            s.share_of_max,
            s.share_near_best,
            s.transport_j_m,
            s.overshoot_m.max(0.0),
            s.inflection_s
        );
    }
    if std::env::var_os("GLIDER_WRITE_SCORECARD").is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scorecard/flight.txt"), &text).expect("file can be written");
        return;
    }
    assert!(text == KEPT, "the scorecard changed; now:\n{text}");
}
