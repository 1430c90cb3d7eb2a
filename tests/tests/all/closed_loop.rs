//! Plant and controller together: what the controller promises, measured.

use control::{Config, Settings};
use hil_host::score::control_law::{Band, Case, Disturbance, Pilot, Score, cases, fly, fly_all, fly_mission};
use signals::{Goal, Wings};

const BOTH: [Wings; 2] = [Wings::Standard, Wings::LowAspectRatio];

fn ours(band: Band, wings: Wings, disturbance: Disturbance, seed: u64) -> Score {
    fly(Case { wings, band, disturbance, pilot: Pilot::Ours, seed }).expect("case can be flown")
}

/// The project's aim: ≥ 0.90 of (L/D)max in 3–27 m, ≥ 0.97 in 0–200 m and deeper. Measured when written: 0.986, 0.992; 0.997, 0.998.
#[test]
fn both_wing_sets_fly_near_best_glide_in_calm_water_with_a_right_table() {
    for wings in BOTH {
        for (band, aim) in [(Band::Shallow, 0.90), (Band::Sea, 0.97), (Band::Deep, 0.97)] {
            let s = ours(band, wings, Disturbance::Calm, 1);
            assert!(s.done && s.abort.is_none(), "{s:?}");
            assert!(s.share_of_max >= aim, "{wings:?} {band:?}: {}", s.share_of_max);
            // More than the steady best would be an error of the measure: 1 % for momentum carried through turns.
            assert!(s.share_of_max <= 1.01, "{wings:?} {band:?}: {}", s.share_of_max);
        }
    }
}

/// The table the firmware carries knows nothing of the plant: (L/D)max 2 % and 5 % lower, at 6.5° and 7.4° instead of 7.6° and 10.2°.
/// Measured when written: 0.949, 0.930; 0.967, 0.965, the first dive included, in which nothing is known yet.
#[test]
fn with_the_built_in_table_the_flight_teaches_what_the_table_lacks() {
    for wings in BOTH {
        for (band, aim) in [(Band::Shallow, 0.90), (Band::Sea, 0.96)] {
            let s = ours(band, wings, Disturbance::BuiltInTable, 1);
            assert!(s.done && s.abort.is_none(), "{s:?}");
            assert!(s.share_of_max >= aim, "{wings:?} {band:?}: {}", s.share_of_max);
        }
    }
}

#[test]
fn with_a_table_wrong_by_a_fifth_ours_loses_in_no_band() {
    let wrong = [Disturbance::TableLift(0.8), Disturbance::TableLift(1.2), Disturbance::TableDrag(0.8), Disturbance::TableDrag(1.2)];
    let scores = fly_all(&cases(&BOTH, &[Band::Shallow, Band::Sea, Band::Deep], &wrong, 3), || ()).expect("cases can be flown");
    for pair in scores.chunks(2) {
        let [ours, stock] = pair else { panic!("ours and stock") };
        assert!(
            ours.done && ours.share_of_max > stock.share_of_max,
            "{:?}: {} against {}",
            ours.case,
            ours.share_of_max,
            stock.share_of_max
        );
    }
}

/// One known exception, kept in sight: rail wings whose flow separates at 4.6°, far below the table's α*. Their best pitch is by
/// chance the ordinary controller's, and they sink at nearly the rate of attached ones: 0.874 against 0.891 when written (standard
/// wings, which show it, 0.76 against 0.68); bounded here at 4 % of (L/D)max.
#[test]
fn ours_never_loses_to_the_ordinary_controller_but_for_an_early_stall() {
    let mut disturbances = Disturbance::FIXED.to_vec();
    disturbances.retain(|d| *d != Disturbance::BuiltInTable);
    disturbances.extend(Disturbance::hidden());
    let scores = fly_all(&cases(&BOTH, &[Band::Shallow], &disturbances, 2), || ()).expect("cases can be flown");
    for pair in scores.chunks(2) {
        let [ours, stock] = pair else { panic!("ours and stock") };
        assert!(ours.done && ours.abort.is_none(), "false abort: {:?} {:?}", ours.case, ours.abort);
        let early_stall = ours.case.disturbance == Disturbance::Hidden(plant::EffectKind::Stall);
        let allowed = if early_stall && ours.case.wings == Wings::LowAspectRatio { 0.04 } else { 0.0 };
        assert!(ours.share_of_max > stock.share_of_max - allowed, "{:?}: {} against {}", ours.case, ours.share_of_max, stock.share_of_max);
    }
}

/// A thousand missions, disturbances and wings in turn: none leaves the band by more than 1 m, none aborts.
#[test]
fn the_depth_band_holds_over_a_thousand_seeded_missions() {
    let mut disturbances = Disturbance::FIXED.to_vec();
    disturbances.extend(Disturbance::hidden());
    let all: Vec<Case> = (0..1000usize)
        .map(|i| Case {
            wings: BOTH[i % 2],
            band: Band::Shallow,
            disturbance: disturbances[(i / 2) % disturbances.len()],
            pilot: Pilot::Ours,
            seed: 100 + i as u64,
        })
        .collect();
    let scores = fly_all(&all, || ()).expect("cases can be flown");
    assert_eq!(scores.len(), 1000);
    for s in &scores {
        assert!(s.overshoot_m.is_finite() && s.overshoot_m <= 1.0, "{:?}: {} m", s.case, s.overshoot_m);
        assert!(s.done && s.abort.is_none(), "{:?}: {:?}", s.case, s.abort);
    }
}

#[test]
fn the_same_seed_flies_the_same_flight() {
    let a = ours(Band::Shallow, Wings::Standard, Disturbance::NoisySensors, 7);
    let b = ours(Band::Shallow, Wings::Standard, Disturbance::NoisySensors, 7);
    assert_eq!(a, b);
    assert_ne!(a.distance_m, ours(Band::Shallow, Wings::Standard, Disturbance::NoisySensors, 8).distance_m);
}

/// Four dives of 200 m for a goal, in a current (m/s) towards the heading flown (0: north).
fn for_goal(goal: Goal, wings: Wings, disturbance: Disturbance, heading_rad: f32) -> Score {
    let case = Case { wings, band: Band::Sea, disturbance, pilot: Pilot::Ours, seed: 1 };
    let mut mission = case.band.mission(wings);
    mission.max_duration_s *= 2;
    for leg in &mut mission.legs {
        (leg.goal, leg.dives, leg.heading_rad) = (goal, 4, heading_rad);
    }
    let score = fly_mission(case, &case.band.config(), &mission).expect("case can be flown");
    assert!(score.done && score.abort.is_none(), "{goal:?}: {score:?}");
    score
}

fn water_speed_m_s(s: &Score) -> f64 {
    s.water_distance_m / s.duration_s
}

#[test]
fn best_speed_is_faster_and_best_range_cheaper_than_best_glide() {
    for wings in BOTH {
        let glide = for_goal(Goal::BestGlide, wings, Disturbance::BuiltInTable, 0.0);
        let speed = for_goal(Goal::BestSpeed, wings, Disturbance::BuiltInTable, 0.0);
        assert!(water_speed_m_s(&speed) > 1.15 * water_speed_m_s(&glide), "{} {}", water_speed_m_s(&speed), water_speed_m_s(&glide));
        // Hotel load of the plant's vehicle. The optimum is flat: the same to 1 % or better.
        let range = for_goal(Goal::BestRange { hotel_w: 1.2 }, wings, Disturbance::BuiltInTable, 0.0);
        assert!(range.transport_j_m < 1.01 * glide.transport_j_m, "{wings:?}: {} {} J/m", range.transport_j_m, glide.transport_j_m);
        // Nothing but the pump to pay for: the best glide is the best range.
        let idle = for_goal(Goal::BestRange { hotel_w: 0.0 }, wings, Disturbance::BuiltInTable, 0.0);
        assert!((idle.share_of_max - glide.share_of_max).abs() < 0.02, "{wings:?}: {} {}", idle.share_of_max, glide.share_of_max);
    }
}

/// The current flows north at 0.15 m/s. With it the best pitch would be flatter than that of the best glide, where the flow may leave
/// the wings: the law keeps its margin, so the speed is that of the best glide to 2 %.
#[test]
fn the_goal_flies_faster_than_best_glide_only_against_a_current() {
    let current = Disturbance::Hidden(plant::EffectKind::HorizontalCurrent);
    for wings in BOTH {
        let south = std::f32::consts::PI;
        let glide = for_goal(Goal::BestGlide, wings, current, south);
        let head = for_goal(Goal::Current { along_track_m_s: -0.15 }, wings, current, south);
        let tail = for_goal(Goal::Current { along_track_m_s: 0.15 }, wings, current, 0.0);
        assert!(water_speed_m_s(&head) > 1.1 * water_speed_m_s(&glide), "head {} {}", water_speed_m_s(&head), water_speed_m_s(&glide));
        assert!(head.achieved_l_over_d > glide.achieved_l_over_d, "over ground {} {}", head.achieved_l_over_d, glide.achieved_l_over_d);
        assert!(water_speed_m_s(&tail) <= 1.02 * water_speed_m_s(&glide), "tail {} {}", water_speed_m_s(&tail), water_speed_m_s(&glide));
    }
}

/// L/D of the fifth to eighth dive of a vehicle with 30 % more drag without lift than its built-in table knows.
fn late_l_over_d(wings: Wings, band: Band, goal: Goal, seed: u64, learns_levels: bool) -> f64 {
    let case = Case { wings, band, disturbance: Disturbance::DragLevel(0.3), pilot: Pilot::Ours, seed };
    let config = Config::new(Settings { learns_levels, ..*band.config().settings() }).expect("valid");
    let [four, eight] = [4, 8].map(|dives| {
        let mut mission = band.mission(wings);
        mission.max_duration_s = 200 * 3600;
        (mission.legs[0].goal, mission.legs[0].dives) = (goal, dives);
        let score = fly_mission(case, &config, &mission).expect("case can be flown");
        assert!(score.done && score.abort.is_none(), "{goal:?}: {score:?}");
        score
    });
    (eight.water_distance_m - four.water_distance_m) / (eight.vertical_m - four.vertical_m)
}

/// Share of the best constant pitch, mean of eight seeds. Measured when written, standard and rails: 0.991, 0.993 in 3-27 m, 0.998, 0.999
/// in 0-200 m; where the levels are not learned 0.950, 0.956 and 0.950, 0.969.
#[test]
fn scorecard_learned_levels_fly_the_best_constant_pitch_after_four_dives() {
    for wings in BOTH {
        for band in [Band::Shallow, Band::Sea] {
            let pitches = (22..=36u8).map(|halves| f32::from(halves).to_radians() / 2.0);
            let best = pitches.map(|pitch_rad| late_l_over_d(wings, band, Goal::FixedPitch { pitch_rad }, 1, false)).fold(0.0, f64::max);
            let learned = (1..=8).map(|seed| late_l_over_d(wings, band, Goal::BestGlide, seed, true)).sum::<f64>() / 8.0;
            let usual = late_l_over_d(wings, band, Goal::BestGlide, 1, false);
            println!("{wings:?} {band:?}: learned {:.4}, usual {:.4} of {best:.3}", learned / best, usual / best);
            assert!(learned >= 0.99 * best && usual < 0.98 * best, "{wings:?} {band:?}: {learned} and {usual} of {best}");
        }
    }
}

/// What is learned in the first dive is used in all that follow: 0.97 of (L/D)max over four dives, the first included.
#[test]
fn with_the_built_in_table_four_deep_dives_reach_the_aim() {
    for wings in BOTH {
        let s = for_goal(Goal::BestGlide, wings, Disturbance::BuiltInTable, 0.0);
        assert!(s.share_of_max >= 0.97, "{wings:?}: {}", s.share_of_max);
    }
}
