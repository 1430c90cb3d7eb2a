//! The law of the rail wings against measured rectangular plates.

use crate::drag::{DragRule, due_to_lift, friction, induced_factor, wing_cd0};
use crate::lift_slope::hoerner_borst;
use crate::rectangular::{ONSET_AT_ONE_RAD, ONSET_WIDTH_SHARE, SideEdge, interval, low_angle_end_rad};
use crate::wing::{VORTEX_LIFT_KV, bartlett_vidal, polhamus_lamar};

/// One measured angle.
struct Point {
    alpha_rad: f64,
    cl: f64,
    cd: Option<f64>,
}

/// One measured plate.
struct Plate {
    series: String,
    aspect_ratio: f64,
    points: Vec<Point>,
}

impl Plate {
    fn name(&self) -> String {
        format!("{} A {}", self.series, self.aspect_ratio)
    }

    /// Root mean square of a difference over the points between 3° and 20°.
    fn rms(&self, difference: impl Fn(&Point) -> Option<f64>) -> f64 {
        let within = |p: &&Point| (2.99..=20.01).contains(&p.alpha_rad.to_degrees());
        let all: Vec<f64> = self.points.iter().filter(within).filter_map(difference).collect();
        assert!(all.len() >= 6, "{}: {} points", self.name(), all.len());
        (all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64).sqrt()
    }

    fn rms_cl(&self, law: impl Fn(f64) -> f64) -> f64 {
        self.rms(|p| Some(law(p.alpha_rad) - p.cl))
    }

    /// Slope of the straight line through the origin, 1/rad, over 3–8°, of any curve at the measured angles.
    fn slope(&self, curve: impl Fn(&Point) -> f64) -> f64 {
        let within = |p: &&Point| (2.5..=8.8).contains(&p.alpha_rad.to_degrees());
        let (xy, xx) =
            self.points.iter().filter(within).fold((0.0, 0.0), |(xy, xx), p| (xy + p.alpha_rad * curve(p), xx + p.alpha_rad * p.alpha_rad));
        xy / xx
    }
}

/// Pelletier & Mueller A 1, A 2, Lamar A 1, A 3.
fn plates() -> Vec<Plate> {
    let mut all: Vec<Plate> = Vec::new();
    for line in include_str!("../../tests/data/rectangular-plates/lift_drag.csv").lines().skip(1) {
        let [series, a, alpha, cl, cd] = line.split(',').collect::<Vec<_>>()[..] else { panic!("{line}: not five columns") };
        let number = |text: &str| text.parse::<f64>().expect("number");
        let point = Point { alpha_rad: number(alpha).to_radians(), cl: number(cl), cd: (!cd.is_empty()).then(|| number(cd)) };
        match all.iter_mut().find(|p| p.series == series && p.aspect_ratio == number(a)) {
            Some(plate) => plate.points.push(point),
            None => all.push(Plate { series: series.into(), aspect_ratio: number(a), points: vec![point] }),
        }
    }
    assert_eq!(all.len(), 4);
    all
}

/// The law with another onset at A = 1 and K_v times a factor.
fn law(aspect_ratio: f64, onset_at_one_rad: f64, kv_factor: f64) -> SideEdge {
    let of = SideEdge::of(aspect_ratio);
    let onset_rad = of.onset_rad * onset_at_one_rad / ONSET_AT_ONE_RAD;
    SideEdge { kv: kv_factor * of.kv, onset_rad, onset_width_rad: ONSET_WIDTH_SHARE * onset_rad, ..of }
}

fn rms_of(plate: &Plate, onset_at_one_rad: f64) -> f64 {
    let of = law(plate.aspect_ratio, onset_at_one_rad, 1.0);
    plate.rms_cl(|x| of.lift(hoerner_borst(plate.aspect_ratio), x))
}

/// No onset: a thousandth of a degree.
const NONE_RAD: f64 = 1e-5;

/// Largest rms of C_L, without an onset and with it.
const LIFT: [(f64, f64); 4] = [(0.036, 0.02), (0.03, 0.03), (0.022, 0.036), (0.01, 0.01)];

#[test]
fn validate_the_law_on_rectangular_plates() {
    for (plate, (without, with)) in plates().iter().zip(LIFT) {
        let a = plate.aspect_ratio;
        let (bare, full) = (rms_of(plate, NONE_RAD), rms_of(plate, ONSET_AT_ONE_RAD));
        let kp = hoerner_borst(a);
        let slope = plate.slope(|p| SideEdge::of(a).lift(kp, p.alpha_rad)) / plate.slope(|p| p.cl) - 1.0;
        let eleven = plate.rms_cl(|x| polhamus_lamar(kp, VORTEX_LIFT_KV, x));
        let twelve = plate.rms_cl(|x| bartlett_vidal(kp, 2.0, x));
        println!(
            "{}: rms C_L {full:.4} (no onset, nothing fitted: {bare:.4}; eq. 11 {eleven:.4}, eq. 12 {twelve:.4}), slope {:+.1} %",
            plate.name(),
            100.0 * slope
        );
        assert!(full <= with && bare <= without, "{}: {full} and {bare}", plate.name());
        // Lamar's plate of A = 1 shows no onset: 14 % more slope than ours.
        assert!(slope.abs() < if plate.series == "lamar" && a == 1.0 { 0.16 } else { 0.10 }, "{}: slope {slope}", plate.name());
        // Lamar's plate of A = 1 is the one eq. 11 suits, and the reason that the onset has a large sigma.
        assert!(full < eleven || (plate.series == "lamar" && a == 1.0), "{}: eq. 11 {eleven}", plate.name());
    }
}

#[test]
fn validate_drag_of_the_law_is_that_of_zero_suction() {
    for plate in plates().iter().filter(|p| p.points.iter().all(|q| q.cd.is_some())) {
        let a = plate.aspect_ratio;
        let (of, kp) = (SideEdge::of(a), hoerner_borst(a));
        let k = induced_factor(0.85, a);
        let cd0 = wing_cd0(friction(crate::drag::Layer::Laminar, 1.4e5), 1.0);
        let rms = |rule: DragRule| plate.rms(|p| p.cd.map(|cd| cd0 + due_to_lift(rule, k, of.lift(kp, p.alpha_rad), p.alpha_rad) - cd));
        let [parabolic, zero] = [DragRule::Parabolic, DragRule::ZeroSuction].map(rms);
        println!("{}: rms C_D {zero:.4} without suction, {parabolic:.4} by eq. 14", plate.name());
        assert!(zero <= 0.02, "{}: {zero}", plate.name());
    }
}

/// Torres & Mueller 2004, Re 7e4 to 1e5: C_D = C_D0 + C_L²/(π e A) with e 0.82, 0.57, 0.38, not among the points above.
#[test]
fn validate_induced_drag_of_torres_and_mueller() {
    for (a, e) in [(0.5, 0.82), (1.0, 0.57), (2.0, 0.38)] {
        let (of, kp) = (SideEdge::of(a), hoerner_borst(a));
        let (mut of_k, mut of_one) = (0.0, 0.0);
        for i in 1..=20 {
            let x = f64::from(i).to_radians();
            let cl = of.lift(kp, x);
            of_k += cl * x.tan() * cl * cl;
            of_one += cl.powi(4);
        }
        let (ours, theirs) = (of_k / of_one, induced_factor(e, a));
        println!("A {a}: K {ours:.3} over 1-20 deg, measured {theirs:.3}");
        // Their range of angles is not known: 15 to 25° changes ours by 10 % at most.
        assert!((ours / theirs - 1.0).abs() < 0.06, "A {a}: {ours} against {theirs}");
    }
}

/// The one fitted number, found anew without each aspect ratio.
#[test]
fn validate_leave_one_aspect_ratio_out() {
    let plates = plates();
    let fitted = |use_of: &dyn Fn(&Plate) -> bool| {
        let cost = |onset: f64| plates.iter().filter(|p| use_of(p)).map(|p| rms_of(p, onset).powi(2)).sum::<f64>();
        // Quarter degrees to 16°, and none.
        (2..=64).map(|i| (0.25 * f64::from(i)).to_radians()).chain([NONE_RAD]).min_by(|x, y| cost(*x).total_cmp(&cost(*y))).expect("a grid")
    };
    for (left_out, most) in [(1.0, [0.036, 0.022]), (2.0, [0.03, f64::NAN]), (3.0, [0.01, f64::NAN])] {
        let onset = fitted(&|p| p.aspect_ratio != left_out);
        for (plate, most) in plates.iter().filter(|p| p.aspect_ratio == left_out).zip(most) {
            let rms = rms_of(plate, onset);
            println!("without A {left_out}: onset {:.2} deg at A = 1; {} rms C_L {rms:.4}", onset.to_degrees(), plate.name());
            assert!(rms <= most, "{}: {rms}", plate.name());
        }
    }
    let (low_re, all) = (fitted(&|p| p.series == "pelletier-mueller"), fitted(&|_| true));
    println!("onset at A = 1: {:.2} deg by the plates at Re 1.4e5, {:.2} deg by all", low_re.to_degrees(), all.to_degrees());
    // Half way between the two, to a step of the grid.
    assert!((0.5 * (low_re + all) - ONSET_AT_ONE_RAD).abs() <= 0.25f64.to_radians(), "{} {}", low_re.to_degrees(), all.to_degrees());
}

#[test]
fn the_interval_covers_what_was_measured() {
    // Two sigma and the reading error, every point of the low-angle regime.
    for plate in plates() {
        for p in plate.points.iter().filter(|p| p.alpha_rad < 0.9 * low_angle_end_rad(plate.aspect_ratio)) {
            let (low, nominal, high) = interval(plate.aspect_ratio, p.alpha_rad);
            let (least, most) = (nominal - 2.0 * (nominal - low) - 0.02, nominal + 2.0 * (high - nominal) + 0.02);
            assert!(
                (least..=most).contains(&p.cl),
                "{} at {:.1}: {} outside {least}..{most}",
                plate.name(),
                p.alpha_rad.to_degrees(),
                p.cl
            );
        }
    }
    for deg in [5.0, 10.0, 15.0, 20.0, 25.0] {
        let (low, nominal, high) = interval(0.3155, f64::to_radians(deg));
        println!("A 0.3155 at {deg} deg: C_L {nominal:.3}, {low:.3} to {high:.3} (extrapolated)");
    }
}
