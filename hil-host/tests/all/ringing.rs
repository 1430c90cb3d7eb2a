//! Water that rings in a layer has a period, but no vehicle is to blame for it.

use crate::case;

use discovery::diagnosis::{Diagnosis, diagnose};
use discovery::hypotheses::search::Depth;
use logs::Flight;
use plant::trials::{Site, Spec, Wing};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Water at rest sinks or rises by this much with this period, m/s (rms) and s, and forgets its phase in so many periods.
#[derive(Clone, Copy)]
struct Ringing {
    rms_m_s: f64,
    period_s: f64,
    kept_periods: f64,
}

impl Ringing {
    /// Carries a vehicle up and down: pressure follows, density and temperature move with the water.
    fn carry(self, log: &mut Flight, rng: &mut ChaCha8Rng) {
        let mut normal = || -> f64 { StandardNormal.sample(&mut *rng) };
        let (mut along, mut across, mut moved_m) = (normal(), normal(), 0.0);
        for i in 1..log.len() {
            let step_s = log.time_s[i] - log.time_s[i - 1];
            if log.segment[i] != log.segment[i - 1] {
                (along, across, moved_m) = (normal(), normal(), 0.0);
            } else if step_s > 0.0 {
                let keep = (-step_s / (self.kept_periods * self.period_s)).exp();
                let kick = (1.0 - keep * keep).sqrt();
                let (sin, cos) = (TAU * step_s / self.period_s).sin_cos();
                (along, across) =
                    (keep * (cos * along - sin * across) + kick * normal(), keep * (sin * along + cos * across) + kick * normal());
                moved_m += self.rms_m_s * along * step_s;
            }
            log.pressure_pa[i] += 1e4 * moved_m;
        }
    }
}

/// What is told of a flight without anything hidden, in water that rings.
fn diagnosed(site: Site, wing: Wing, seed: u64, ringing: Ringing) -> Diagnosis {
    let spec = Spec::clean(site, wing);
    let (mut log, v) = case::read_back(&spec, seed, 0);
    ringing.carry(&mut log, &mut ChaCha8Rng::seed_from_u64(seed));
    diagnose(&log, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis")
}

/// A fifth of the water's power in a narrow band was called a period of the vehicle's own, three times in two hundred flights that
/// another author simulated.
#[test]
fn regress_water_that_rings_in_a_layer_is_no_period_of_the_vehicles_own() {
    let sea = Ringing { rms_m_s: 0.0022, period_s: 200.0, kept_periods: 3.5 };
    let lake = Ringing { rms_m_s: 0.0013, period_s: 71.0, kept_periods: 3.0 };
    for (site, wing, seed, ringing) in [
        (Site::Sea, Wing::Standard, 1, sea),
        (Site::Sea, Wing::LowAspectRatio, 2, sea),
        (Site::Sea, Wing::Standard, 3, sea),
        (Site::Lake, Wing::Standard, 4, lake),
        (Site::Lake, Wing::LowAspectRatio, 5, lake),
        (Site::Lake, Wing::Standard, 6, lake),
    ] {
        let d = diagnosed(site, wing, seed, ringing);
        let own = d.remainder.iter().find(|f| f.variable == "time (a period of the vehicle's own)");
        // 9 is what a remainder is asked for; it was 34 in the first of these.
        assert!(own.is_none_or(|f| f.log_bayes < 3.0), "{seed}: {own:?}");
    }
}
