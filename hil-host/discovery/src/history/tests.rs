//! Closed forms, and a made-up vehicle whose dives scatter as they are told to.

use super::file::{History, Logged, SCHEMA, Stored};
use super::glide::Glider;
use super::judge::judge;
use super::kinds::{DIVES_PER_ALARM, threshold};
use super::learn::{FEWEST_CONTROLS, Forward, between, chi2, expected_scatter, forward, learn, of_summaries, place, start};
use super::mission::{Dives, Mission};
use super::numbers::{ALL, COMPRESSIBILITY, DRAG_LEVEL, EXPANSION, NUMBERS, Numbers, in_effect};
use super::rows::{Row, Unit, median, units};
use super::summary::{Linear, Summary};
use super::weigh::{chance, class, deviations, weigh};
use crate::model::parameters::NINETY;
use hydro::effects::{Active, by_name};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};
use std::path::Path;

/// Numbers between -1 and 1 that repeat themselves in every run.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Standard normal, by the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| 0.5 * self.uniform()).sum()
    }
}

fn vehicle() -> Vehicle {
    const TEXT: &str = r#"{"mass_kg":60,"hull_volume_m3":0.0585,"hull_compressibility_per_pa":4e-10,"hull_thermal_expansion_per_k":6e-5,
        "reference_temperature_degc":12,"wing":{"area_m2":0.1},"hydro":{"reference_area_m2":0.1,"wing_lift_slope_per_rad":3.7,
        "hull_lift_slope_per_rad":3.8,"hull_area_m2":0.1,"cd0":0.15,"hull_drag_per_rad2":10.5}}"#;
    logs::vehicle::parse_text(TEXT, Path::new("made_up.json")).expect("reads")
}

/// A dive and a climb of a vehicle whose numbers are `x` sizes off its file, in water that moves up and down by `water_m_s`.
fn dive(k: usize, glider: &Glider, x: &Numbers, water_m_s: f64, noise: &mut Noise) -> Unit {
    let mut rows = Vec::new();
    for i in 0..120 {
        let way = if i < 60 { -1.0 } else { 1.0 };
        let depth = if i < 60 { i as f64 + 3.0 } else { 122.0 - i as f64 } / 62.0;
        let degc = 6.0 + 14.0 * (-4.0 * depth).exp();
        rows.push(Row {
            time_s: 6000.0 * k as f64 + 40.0 * i as f64,
            pressure_pa: 5e6 * depth,
            density_kg_m3: 1027.0 - 0.2 * degc + 4.0 * depth,
            temperature_degc: degc,
            pitch_rad: way * (0.38 + 0.06 * (i as f64 * 0.4).sin()),
            heading_rad: 0.3 * i as f64,
            ballast_m3: way * 2e-4,
            way,
            block: i / 30,
            ..Row::default()
        });
    }
    let mut unit = Unit { id: format!("made up {k}"), rows, ..Unit::default() };
    let rises = glider.rises(&unit, &glider.moved(x));
    unit.rows.iter_mut().zip(rises).for_each(|(row, w)| row.rise_m_s = w + water_m_s * noise.normal());
    unit
}

/// Dives that scatter from one to the next by a tenth of a size in every number.
fn dives(n: usize, glider: &Glider, mean: &Numbers, noise: &mut Noise) -> Vec<Unit> {
    (0..n).map(|k| dive(k, glider, &(mean + Numbers::from_fn(|_, _| 0.1 * noise.normal())), 0.004, noise)).collect()
}

fn glider() -> Glider {
    Glider::new(&vehicle(), 9.0, 2e-4)
}

#[test]
fn accuracy_of_units_that_are_known_exactly_the_covariance_is_theirs() {
    let mut noise = Noise(1);
    let at: Vec<DVector<f64>> = (0..9).map(|_| DVector::from_fn(NUMBERS, |_, _| 0.3 * noise.normal())).collect();
    let exact = DMatrix::identity(NUMBERS, NUMBERS) * 1e8;
    let all: Vec<Summary> = at.iter().map(|x| Summary { n: exact.clone(), u: &exact * x }).collect();
    let expected = expected_scatter(at.len(), &[]);
    let found = between(&all, &expected, &DVector::zeros(NUMBERS));
    let mut scatter = DMatrix::from_diagonal(&expected) * 3.0;
    at.iter().for_each(|x| scatter += (x - &found.mean) * (x - &found.mean).transpose());
    let by = (&found.scatter - scatter / 12.0).amax();
    assert!(by < 1e-6, "{by}");
    // And the mean, tied to the anchor by half a size, is that of normal theory.
    let sum = at.iter().fold(DVector::zeros(NUMBERS), |s, x| s + x);
    let precision = found.scatter.clone().try_inverse().expect("positive");
    let mean = (&precision * 9.0 + DMatrix::identity(NUMBERS, NUMBERS) * 4.0).try_inverse().expect("positive") * precision * sum;
    assert!((&found.mean - mean).amax() < 1e-6);
    assert!((place(&all[3], &found) - &at[3]).amax() < 1e-5);
}

/// Of further dives nine of ten deviations are held, where dives differ by more than their summaries say (a covariance that was learnt
/// from 24 of them is too narrow for a normal law) and where they differ by less.
#[test]
fn accuracy_nine_of_ten_deviations_of_further_dives_are_held() {
    let mut noise = Noise(11);
    for sigma in [0.1, 0.01] {
        let mut dives = |n: usize| -> Vec<Summary> {
            let mut dive = || DVector::from_fn(NUMBERS, |_, _| 400.0 * sigma * noise.normal());
            (0..n).map(|_| Summary { n: DMatrix::identity(NUMBERS, NUMBERS) * 400.0, u: dive() }).collect()
        };
        let learnt = of_summaries(dives(24), &[], Numbers::zeros(), &DVector::zeros(NUMBERS), 1.0);
        let next = learnt.between.next();
        let further: Vec<f64> = dives(300).iter().flat_map(|d| deviations(d, &learnt.between.mean, &next)).collect();
        let held = further.iter().filter(|z| **z <= learnt.ninety).count() as f64 / further.len() as f64;
        assert!((0.85..0.95).contains(&held), "{held} of {sigma}, {}", learnt.ninety);
    }
    assert_eq!(of_summaries(Vec::new(), &[], Numbers::zeros(), &DVector::zeros(NUMBERS), 1.0).ninety, NINETY);
}

#[test]
fn accuracy_evidence_of_one_number_is_the_closed_form() {
    let n = DMatrix::from_diagonal(&DVector::from_fn(NUMBERS, |i, _| 40.0 + i as f64));
    let c = DMatrix::from_diagonal(&DVector::from_fn(NUMBERS, |i, _| 0.01 + 0.001 * i as f64));
    let x = DVector::from_fn(NUMBERS, |i, _| 0.2 * i as f64 - 0.5);
    let unit = Summary { n: n.clone(), u: &n * &x };
    for k in 0..NUMBERS {
        let w = weigh(&unit, &DVector::zeros(NUMBERS), &c, &[k]);
        // The estimate x has variance 1/N + C; under the effect 1/N + C + 1.
        let (null, other) = (1.0 / n[(k, k)] + c[(k, k)], 1.0 / n[(k, k)] + c[(k, k)] + 1.0);
        let ln = 0.5 * x[k] * x[k] * (1.0 / null - 1.0 / other) - 0.5 * (other / null).ln();
        assert!((w.ln_bayes - ln).abs() < 1e-6, "{k}: {} {ln}", w.ln_bayes);
        assert!((w.size[0] - x[k] / other).abs() < 1e-6 && (w.covariance[(0, 0)] - null / other).abs() < 1e-6);
    }
    let mean: f64 = (0..NUMBERS).map(|k| x[k] * x[k] / (1.0 / n[(k, k)] + c[(k, k)])).sum::<f64>() / NUMBERS as f64;
    assert!((chi2(&unit, &DVector::zeros(NUMBERS), &c) - mean).abs() < 1e-9);
}

#[test]
fn accuracy_the_square_root_holds_the_summary_and_its_noise_is_found() {
    let (glider, mut noise) = (glider(), Noise(2));
    let mut ratios = Vec::new();
    for k in 0..40 {
        let unit = dive(k, &glider, &Numbers::zeros(), 0.006, &mut noise);
        let linear = Linear::of(&unit, &glider, &Numbers::zeros());
        let (n, u) = linear.normal();
        let (r, y) = linear.root();
        assert!((r.tr_mul(&r) - &n).amax() < 1e-9 * n.amax() && (r.tr_mul(&y) - &u).amax() < 1e-9 * n.amax());
        ratios.push(linear.own_level(Some(3.6e-5)) / 3.6e-5);
    }
    let usual = median(ratios.iter().copied());
    assert!((0.85..1.25).contains(&usual), "{usual}");
}

#[test]
fn accuracy_a_wrong_drag_and_a_soft_hull_are_named_with_their_size() {
    let (glider, mut noise) = (glider(), Noise(3));
    let mean = Numbers::from_fn(|i, _| 0.3 - 0.1 * i as f64);
    let units = dives(24, &glider, &mean, &mut noise);
    let controls: Vec<&Unit> = units[..12].iter().collect();
    let from = start(&controls[..6], &glider);
    let history = learn(&controls, &glider, &from);
    assert!(history.predicts_itself(), "{}", history.chi2);
    let (mut quiet, mut held, mut named) = (0, 0, 0);
    for unit in &units[12..] {
        quiet += usize::from(judge(unit, &glider, &history, &history.at).class.is_empty());
        for (number, by) in [(DRAG_LEVEL, 0.5), (COMPRESSIBILITY, 4e-10)] {
            let mut claimed = history.at;
            claimed[number] += by / glider.sizes[number];
            let said = judge(unit, &glider, &history, &claimed);
            let truth = -by / glider.sizes[number];
            named += usize::from(said.class.contains(&number));
            let (low, high) = said.interval(number);
            held += usize::from((low..high).contains(&truth));
        }
    }
    assert!(quiet >= 11 && named >= 22 && held >= 19, "{quiet} {named} {held}");
}

#[test]
fn accuracy_a_structure_by_heading_is_none_of_the_numbers() {
    let (glider, mut noise) = (glider(), Noise(9));
    let units = dives(16, &glider, &Numbers::zeros(), &mut noise);
    let history = learn(&units[..12].iter().collect::<Vec<_>>(), &glider, &Numbers::zeros());
    for unit in &units[12..] {
        let untouched = judge(unit, &glider, &history, &history.at);
        assert!(untouched.departs.is_none(), "{untouched:?}");
        let mut odd = unit.clone();
        odd.rows.iter_mut().for_each(|r| r.rise_m_s += 0.03 * r.heading_rad.cos());
        let said = judge(&odd, &glider, &history, &history.at);
        assert_eq!((said.class.len(), said.departs.map(|d| d.0.variable)), (0, Some("heading")), "{said:?}");
        // A name of the numbers is never overruled.
        let mut claimed = history.at;
        claimed[DRAG_LEVEL] += 1.5;
        let said = judge(unit, &glider, &history, &claimed);
        assert!(said.class.contains(&DRAG_LEVEL) && said.departs.is_none());
    }
}

#[test]
fn accuracy_a_history_of_units_that_are_not_alike_judges_nothing() {
    let (glider, mut noise) = (glider(), Noise(4));
    // Numbers that leap between values that no covariance of a few units holds, known to a thousandth.
    let far = |k: usize| Numbers::from_fn(|i, _| if (k + i).is_multiple_of(5) { 2.5 } else { 0.0 });
    let units: Vec<Unit> = (0..5).map(|k| dive(k, &glider, &far(k), 0.0005, &mut noise)).collect();
    let history = learn(&units.iter().collect::<Vec<_>>(), &glider, &Numbers::zeros());
    assert!(!history.predicts_itself() && History::gate(&history).is_some(), "{}", history.chi2);
    let said = judge(&dive(9, &glider, &Numbers::repeat(2.0), 0.0005, &mut noise), &glider, &history, &history.at);
    assert!(said.class.is_empty());
}

/// Pitch had the other sign: the number says what is true of the measured pitch, the effect what is measured of the true one.
#[test]
fn regress_a_number_has_the_size_and_sign_of_its_effect() {
    let (plain, glider) = (vehicle(), glider());
    let unit = dive(0, &glider, &Numbers::zeros(), 0.0, &mut Noise(5));
    for (i, number) in ALL.iter().enumerate() {
        let mut x = Numbers::zeros();
        x[i] = 0.3;
        let by = glider.moved(&x);
        let effect = by_name(number.effect).expect("an effect of the catalogue");
        let mut vehicle = plain.clone();
        vehicle.effects.push(Active::sized(effect, in_effect(i, by[i], glider.claims()[i])));
        let other = Glider::new(&vehicle, glider.reference_degc, glider.drive_m3);
        let (mut moved, mut off) = (0.0_f64, 0.0_f64);
        let still = glider.rises(&unit, &[0.0; NUMBERS]);
        for ((a, b), c) in glider.rises(&unit, &by).iter().zip(other.rises(&unit, &[0.0; NUMBERS])).zip(still) {
            (moved, off) = (moved.max((a - c).abs()), off.max((a - b).abs()));
        }
        // The expansion is counted about another temperature: a difference of trim.
        let within = if i == EXPANSION { 1.0 } else { 0.05 };
        assert!(moved > 1e-4 && off < within * moved, "{}: moves {moved} m/s, differs by {off}", number.name);
    }
}

#[test]
fn a_class_needs_odds_against_all_and_holds_what_is_as_likely() {
    let mut ln = [0.0; NUMBERS];
    (ln[2], ln[5], ln[1]) = (4.3, 9.0, 7.0);
    assert_eq!(class(&ln), [5, 1]);
    (ln[2], ln[5], ln[1]) = (4.38, 4.0, 1.0);
    assert!(class(&ln).is_empty());
    ln[2] = f64::NAN;
    assert!(class(&ln).is_empty());
}

#[test]
fn a_chance_has_a_floor() {
    assert_eq!(chance(2.0, &[1.0, 3.0, 0.5]), (0.5, 0.25));
    assert_eq!(chance(9.0, &[1.0, 3.0, 0.5]), (0.25, 0.25));
    assert_eq!(chance(9.0, &[]), (1.0, 1.0));
}

#[test]
fn the_first_units_are_taken_and_a_leap_is_not() {
    let (glider, mut noise) = (glider(), Noise(5));
    let mut units = dives(9, &glider, &Numbers::zeros(), &mut noise);
    let mut far = Numbers::zeros();
    far[DRAG_LEVEL] = 2.0;
    units[6] = dive(6, &glider, &far, 0.004, &mut noise);
    let said = forward(&units, &glider, &Numbers::zeros(), 12);
    assert!(said[..FEWEST_CONTROLS].iter().all(|f| f.quiet && f.chi2.is_nan()));
    assert_eq!(said.iter().map(|f| f.quiet).collect::<Vec<_>>(), [true, true, true, true, true, true, false, true, true]);
}

#[test]
fn accuracy_steady_rows_have_the_slope_of_pressure() {
    let n = 4000;
    let mut flight = Flight::blank(n);
    flight.name = "saw".into();
    let turn = n / 2;
    for i in 0..n {
        flight.time_s[i] = 2.0 * i as f64;
        let depth_m = 0.2 * 2.0 * if i < turn { i } else { n - i } as f64;
        flight.pressure_pa[i] = 1025.0 * 9.81 * depth_m;
        let way = if i < turn { -1.0 } else { 1.0 };
        flight.pitch_rad[i] = 0.4 * way;
        flight.ballast_m3[i] = 2e-4 * way;
        (flight.density_kg_m3[i], flight.temperature_degc[i]) = (1025.0, 10.0);
    }
    let found = units(&flight);
    assert_eq!(found.len(), 1);
    assert!(found[0].rows.len() > 150 && found[0].blocks() == 6, "{} {}", found[0].rows.len(), found[0].blocks());
    assert!(found[0].rows.iter().all(|r| (r.rise_m_s - 0.2 * r.way).abs() < 1e-9));
    let turns = |r: &&Row| (r.time_s - 2.0 * turn as f64).abs() < 60.0;
    assert_eq!(found[0].rows.iter().filter(turns).count(), 0);
    // Without pitch there is nothing to compare.
    flight.pitch_rad.fill(f64::NAN);
    assert!(units(&flight).is_empty());
}

#[test]
fn accuracy_a_step_is_dated_and_a_drift_is_seen_against_the_oldest() {
    let (glider, mut noise) = (glider(), Noise(10));
    let mut at = Numbers::zeros();
    let mut units = dives(8, &glider, &at, &mut noise);
    at[COMPRESSIBILITY] = 1.2;
    units.extend((8..14).map(|k| dive(k, &glider, &at, 0.004, &mut noise)));
    let mission = Mission::of(Dives::Logged(units), &vehicle(), threshold(DIVES_PER_ALARM));
    let [change] = &mission.found.changes[..] else { panic!("one: {:?}", mission.found.changes) };
    assert_eq!((change.kind.number, change.onset, change.several.len()), (COMPRESSIBILITY, 8, 0), "{change:?}");
    assert!((change.size - 1.2).abs() < 1.645 * change.sigma, "{change:?}");
    // Beside the change every dive is quiet.
    let said = mission.one_by_one();
    assert!(said[..3].iter().all(Option::is_none));
    assert!(said[3..].iter().all(|s| s.as_ref().is_some_and(|s| s.judgement.is_quiet())), "{said:?}");
    // Growth from the first dive on.
    let grown = |k: usize| Numbers::from_fn(|i, _| if i == DRAG_LEVEL { 0.1 * k as f64 } else { 0.0 });
    let units = (0..18).map(|k| dive(k, &glider, &grown(k), 0.004, &mut noise)).collect();
    let mission = Mission::of(Dives::Logged(units), &vehicle(), threshold(DIVES_PER_ALARM));
    assert!(mission.found.changes.iter().any(|c| c.kind.name == "fouling" && c.size > 0.7), "{:?}", mission.found.changes);
}

fn written() -> History {
    let (glider, mut noise) = (glider(), Noise(6));
    let units = dives(14, &glider, &Numbers::zeros(), &mut noise);
    History::learnt_from(&[Logged { units, sha256: "abc".into() }], &vehicle(), "def").expect("learnt")
}

#[test]
fn a_history_comes_back_from_its_file_and_judges_the_same() {
    let history = written();
    let text = history.text();
    assert!(text.starts_with(&format!("{{\"schema\":\"{SCHEMA}\"")) && text.lines().count() == 15);
    let read = History::parse(&text, Path::new("a.history")).expect("reads");
    assert!(read.units.iter().zip(&history.units).all(|(a, b)| (&a.id, a.chi2.is_some(), a.quiet) == (&b.id, b.chi2.is_some(), b.quiet)));
    let (a, b) = (history.learnt(), read.learnt());
    assert!((&a.between.scatter - &b.between.scatter).amax() < 1e-9 && (&a.between.mean - &b.between.mean).amax() < 1e-9);
    let units = dives(14, &glider(), &Numbers::zeros(), &mut Noise(6));
    let glider = history.glider(&vehicle());
    let again = learn(&units.iter().collect::<Vec<_>>(), &glider, &(a.at + Numbers::from(history.head.anchor)));
    assert!((&again.between.mean - &a.between.mean).amax() < 0.05, "{} {}", again.between.mean, a.between.mean);
}

#[test]
fn a_damaged_history_is_refused_with_its_line() {
    let text = written().text();
    let said = |text: &str| History::parse(text, Path::new("a.history")).expect_err("refused");
    assert!(said("").contains("a.history, line 1: is empty"));
    assert!(said(&text.replacen("history/1", "history/9", 1)).contains("expected `glider-history/1`"));
    assert!(said(&text.replacen("\"y\":[", "\"y\":[1.0,", 1)).contains("line 2"));
    assert!(said(&text.replacen("\"drive_m3\":", "\"drive\":", 1)).contains("line 1"));
}

#[test]
fn an_edited_number_of_the_file_is_a_claim() {
    let history = written();
    let mut edited = vehicle();
    assert!(history.edited(&edited).amax() < 1e-12);
    edited.constants.cd0 *= 1.5;
    let by = history.edited(&edited);
    assert!((by[DRAG_LEVEL] - 1.5_f64.ln() / 0.3).abs() < 1e-12 && (by.norm() - by[DRAG_LEVEL]).abs() < 1e-9);
    let glider = history.glider(&edited);
    let mut noise = Noise(7);
    let unit = dive(20, &history.glider(&vehicle()), &Numbers::zeros(), 0.004, &mut noise);
    let learnt = history.learnt();
    let said = judge(&unit, &glider, &learnt, &learnt.at);
    assert!(said.class.contains(&DRAG_LEVEL), "{said:?}");
    assert!(ALL[DRAG_LEVEL].mirror.is_some());
}

#[test]
fn a_unit_is_kept_with_its_provenance() {
    let (glider, mut noise) = (glider(), Noise(8));
    let unit = dive(3, &glider, &Numbers::zeros(), 0.004, &mut noise);
    let stored = Stored::of(&unit, &glider, &Numbers::zeros(), None, Forward { quiet: true, chi2: f64::NAN }, "abc");
    assert_eq!((stored.rows, stored.blocks, stored.chi2, stored.log_sha256.as_str()), (120, 4, None, "abc"));
    assert!((stored.regime.pitch_rad - 0.38).abs() < 0.02 && (stored.regime.drive_m3 - 2e-4).abs() < 1e-12);
    let linear = Linear::of(&unit, &glider, &Numbers::zeros());
    let direct = Summary::of(&linear, stored.level[0]);
    assert!((stored.summary().n - direct.n).amax() < 1e-6 * 1e6_f64.max(1.0));
}
