//! How long may it take? Sums of what is demanded ([`super::demands`]), whatever the law waits for.
//!
//! A count that runs on while a reading is missing and back while it is there
//! is followed exactly: as a pattern where the reading comes by the clock, as a
//! random walk where it comes by chance.

use super::demands;
use crate::seats::CYCLE_S;
use control::Config;

/// A chance that no mission of the campaign should meet: one in a million.
const ODDS: f64 = 1e-6;
/// Three samples of five, one in each cycle, s: what is there when the first is taken is found two cycles later.
pub const THREE_SAMPLES_S: f64 = 2.0 * CYCLE_S;
/// Time a pump takes to be found that does not do what it is asked, s: retries, reverse and verdict, each after its wait.
#[must_use]
pub fn pump_tries_s() -> f64 {
    f64::from(demands::PUMP_TRIES) * demands::PUMP_TRY_S
}

/// From the moment at which a pump is asked for what it does not do, s: the cycle that asks and all tries, and both once
/// more, since an order that changes on the way begins the count anew.
#[must_use]
pub fn no_answer_s() -> f64 {
    2.0 * (CYCLE_S + pump_tries_s())
}

/// The whole way of the pump, s.
#[must_use]
pub fn stroke_s(config: &Config) -> f64 {
    2.0 * f64::from(config.pump_m3) / f64::from(config.pump_rate_m3_s)
}

/// Sinking on with the pump commanded out, s: the minute, the pump's own time, and the filter's two cycles.
#[must_use]
pub fn sinks_on_s(config: &Config) -> f64 {
    demands::SINKS.1 + 1.5 * stroke_s(config) + 2.0 * CYCLE_S
}

/// The longest a turn is held, s.
#[must_use]
pub fn turn_s(config: &Config) -> f64 {
    1.5 * stroke_s(config) + 60.0
}

/// What a fault that has ended may still lead to shows within a turn and a minute of sinking, s.
#[must_use]
pub fn aftermath_s(config: &Config) -> f64 {
    turn_s(config) + sinks_on_s(config)
}

/// A pitch that stands still or has the wrong sign, s: a look to begin with, its wait, and the wait of a lost pitch.
#[must_use]
pub fn pitch_inconsistent_s() -> f64 {
    CYCLE_S + demands::PITCH_INCONSISTENT_S + CYCLE_S + demands::PITCH_LOST_S + CYCLE_S
}

/// A fin away from a steady command, s: a look to begin with, its wait, and the look that ends it.
#[must_use]
pub fn fin_s() -> f64 {
    CYCLE_S + demands::FIN.1 + CYCLE_S
}

/// A depth reading that is wrong or missing, s: apart for as long as that takes, then (refused) unbacked for as long as
/// that takes, then a new dive's dwell and the turn's cycle.
#[must_use]
pub fn depth_wrong_s() -> f64 {
    demands::APART_S + unbacked_s()
}

/// One of two depth sensors is gone, s.
#[must_use]
pub fn unbacked_s() -> f64 {
    demands::UNBACKED_S + 3.0 * CYCLE_S
}

/// A battery mass asked elsewhere for good, s: it is stopped for six waits of eight, which count, and tried for two, which
/// take a quarter of themselves back.
#[must_use]
pub fn mass_s() -> f64 {
    let wait_s = demands::MASS_WAIT_S.max(2.0 * CYCLE_S);
    let (mut count_s, mut time_s) = (0.0, wait_s);
    while count_s <= demands::MASS_LOST_S {
        let stopped = ((time_s - wait_s) / (8.0 * wait_s)).fract() < 0.75;
        count_s = if stopped { count_s + CYCLE_S } else { f64::max(count_s - 0.25 * CYCLE_S, 0.0) };
        time_s += CYCLE_S;
    }
    time_s
}

/// When a count beyond `limit_s` is reached that grows by a cycle for each that a reading is missing and goes back by
/// `back` of a cycle for each that it is there, s; the reading is new every `period_s` and believed until `fresh_s` old.
#[must_use]
pub fn by_the_clock_s(limit_s: f64, back: f64, period_s: f64, fresh_s: f64) -> f64 {
    let cycles = (period_s / CYCLE_S).ceil().max(1.0) as u32;
    let there = (fresh_s / CYCLE_S).floor() as u32 + 1;
    let mut count_s = 0.0;
    for cycle in 0..100_000u32 {
        count_s = if cycle % cycles < there { f64::max(count_s - back * CYCLE_S, 0.0) } else { count_s + CYCLE_S };
        if count_s > limit_s {
            return f64::from(cycle + 1) * CYCLE_S;
        }
    }
    f64::INFINITY
}

/// The same for a reading that is missing by chance, with `share` of all; but once in a million missions.
#[must_use]
pub fn by_chance_s(limit_s: f64, back: f64, share: f64) -> f64 {
    // The count in quarters of a cycle.
    let (up, down) = (4, (back * 4.0).round() as usize);
    let top = (limit_s / CYCLE_S * 4.0).floor() as usize;
    let mut at = vec![0.0; top + 1];
    at[0] = 1.0;
    for cycle in 1..100_000u32 {
        let mut next = vec![0.0; top + 1];
        for (count, odds) in at.iter().enumerate() {
            if let Some(n) = next.get_mut(count + up) {
                *n += odds * share;
            }
            next[count.saturating_sub(down)] += odds * (1.0 - share);
        }
        at = next;
        if at.iter().sum::<f64>() < ODDS {
            return f64::from(cycle) * CYCLE_S;
        }
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::Settings;

    #[test]
    fn the_bounds_are_the_sums_one_gets_by_hand() {
        let c = Config::new(Settings::slocum_200()).expect("valid");
        assert_eq!((pump_tries_s(), no_answer_s()), (40.0, 88.0));
        assert_eq!((pitch_inconsistent_s(), fin_s()), (28.0 + 64.0, 68.0));
        assert_eq!((unbacked_s(), depth_wrong_s()), (42.0, 62.0));
        assert!((stroke_s(&c) - 472.0 / 13.0).abs() < 1e-4 && (sinks_on_s(&c) - (68.0 + 708.0 / 13.0)).abs() < 1e-4);
        // 48 s stopped, 16 s tried, the same again, 32 s and the cycle that goes beyond; after the first 8 s.
        assert_eq!(mass_s(), 8.0 + 48.0 + 16.0 + 48.0 + 16.0 + 36.0);
    }

    #[test]
    fn a_reading_that_comes_and_goes_is_counted_as_the_law_counts_it() {
        // 8 s there, 24 s gone: 16 s more each time; beyond 60 s in the fourth.
        assert_eq!(by_the_clock_s(60.0, 1.0, 30.0, 7.0), 3.0 * 32.0 + 8.0 + 16.0);
        // 3 s in hand after each 32 s, but at 9 s it is over in the first.
        assert_eq!(by_the_clock_s(8.9, 1.0, 30.0, 7.0), 20.0);
        assert_eq!(by_the_clock_s(60.0, 1.0, 4.0, 7.0), f64::INFINITY);
        // Always missing: by the clock.
        assert_eq!(by_chance_s(60.0, 1.0, 1.0), 64.0);
        // Missing every other time: three steps up before one is lost, of which one in eight tries does it.
        let s = by_chance_s(9.0, 1.0, 0.5);
        assert!((300.0..700.0).contains(&s), "{s}");
        assert!(by_chance_s(60.0, 1.0, 0.9) < 400.0 && by_chance_s(60.0, 1.0, 0.2) > 1e5);
    }
}
