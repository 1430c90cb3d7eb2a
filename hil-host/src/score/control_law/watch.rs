//! What is kept from cycle to cycle while a flight under a control law is judged: way, turns, depth peaks.

use crate::score::control_law::{BIN_DEG, BINS, Case, Score, best};
use plant::{Truth, World};
use rig::seats::CYCLE_S;
use signals::{Answer, Mission};

/// "Near α*": within this, rad (2°).
const NEAR_RAD: f64 = 0.034_906_6;

/// What is kept from cycle to cycle while a flight is judged.
pub(crate) struct Watch {
    pub(crate) score: Score,
    /// Times of finished turns, s, and the turn under way: since when, to which ballast.
    turns: Vec<f64>,
    turning: Option<(f64, f32)>,
    last_ballast: f32,
    /// Whether the vehicle sank, and the depth it was at.
    peak: Option<(bool, f64)>,
    /// Depths between which it is to fly, m.
    low_m: f64,
    high_m: f64,
}

impl Watch {
    pub(crate) fn new(case: Case, mission: &Mission, world: &World) -> Self {
        let (max_l_over_d, best_alpha_rad) = best(world);
        let leg = mission.legs.first().copied().unwrap_or_default();
        let score = Score {
            case,
            done: false,
            abort: None,
            dives: 0,
            distance_m: 0.0,
            water_distance_m: 0.0,
            vertical_m: 0.0,
            duration_s: 0.0,
            achieved_l_over_d: 0.0,
            max_l_over_d,
            share_of_max: 0.0,
            best_alpha_rad,
            share_near_best: 0.0,
            energy_j: 0.0,
            transport_j_m: 0.0,
            overshoot_m: 0.0,
            undershoot_m: 0.0,
            inflection_s: 0.0,
            alpha_histogram: vec![0.0; BINS],
        };
        let (low_m, high_m) = (f64::from(leg.depth_max_m), f64::from(leg.depth_min_m));
        Self { score, turns: Vec::new(), turning: None, last_ballast: f32::NAN, peak: None, low_m, high_m }
    }

    /// Way and angle of attack of a cycle under way.
    pub(crate) fn glide(&mut self, was: &Truth, now: &Truth) {
        let s = &mut self.score;
        s.distance_m += (now.north_m - was.north_m).hypot(now.east_m - was.east_m);
        // Water speed is the mean of both ends of the cycle: currents change little in 4 s.
        let north = now.north_m - was.north_m - 0.5 * (now.north_water_m_s + was.north_water_m_s) * CYCLE_S;
        let east = now.east_m - was.east_m - 0.5 * (now.east_water_m_s + was.east_water_m_s) * CYCLE_S;
        s.water_distance_m += north.hypot(east);
        s.vertical_m += (now.depth_m - was.depth_m).abs();
        s.duration_s += CYCLE_S;
        let a = now.alpha_rad.abs();
        if (a - s.best_alpha_rad).abs() <= NEAR_RAD {
            s.share_near_best += CYCLE_S;
        }
        let bin = ((a.to_degrees() / BIN_DEG) as usize).min(BINS - 1);
        s.alpha_histogram[bin] += CYCLE_S;
    }

    /// A turn: from a change of the ballast command to the pump standing and the pitch there.
    pub(crate) fn turn(&mut self, now: &Truth, answer: &Answer, under_way: bool) {
        let wanted = answer.command.ballast_m3;
        if under_way && self.last_ballast.is_finite() && wanted * self.last_ballast < 0.0 {
            self.turning = Some((now.time_s, wanted));
        }
        self.last_ballast = wanted;
        if let Some((since, target)) = self.turning {
            let stands = (now.ballast_m3 - f64::from(target)).abs() < 10e-6;
            let pitched = (now.pitch_rad.abs() - f64::from(answer.trace.pitch_setpoint_rad.abs())).abs() < NEAR_RAD;
            let sided = now.pitch_rad * f64::from(target) > 0.0;
            if stands && pitched && sided {
                self.turns.push(now.time_s - since);
                self.turning = None;
            }
        }
    }

    /// Depth peaks by the sign of the true rate.
    pub(crate) fn depth(&mut self, was: &Truth, now: &Truth, under_way: bool) {
        let (s, low_m, high_m) = (&mut self.score, self.low_m, self.high_m);
        s.overshoot_m = s.overshoot_m.max(now.depth_m - low_m);
        if under_way {
            let down = now.depth_m > was.depth_m;
            if let Some((was_down, _)) = self.peak
                && was_down != down
            {
                if was_down {
                    s.undershoot_m = s.undershoot_m.max(low_m - was.depth_m);
                } else if high_m > 0.5 && was.depth_m < 0.5 * (low_m + high_m) {
                    s.overshoot_m = s.overshoot_m.max(high_m - was.depth_m);
                    s.undershoot_m = s.undershoot_m.max(was.depth_m - high_m);
                }
            }
            self.peak = Some((down, now.depth_m));
        }
    }

    pub(crate) fn finished(self, energy_j: f64) -> Score {
        let mut s = self.score;
        s.energy_j = energy_j;
        if s.vertical_m > 0.0 && s.duration_s > 0.0 {
            s.achieved_l_over_d = s.distance_m / s.vertical_m;
            s.share_of_max = s.water_distance_m / s.vertical_m / s.max_l_over_d;
            s.share_near_best /= s.duration_s;
            s.transport_j_m = s.energy_j / s.distance_m;
            s.alpha_histogram.iter_mut().for_each(|b| *b /= s.duration_s);
        }
        if !self.turns.is_empty() {
            s.inflection_s = self.turns.iter().sum::<f64>() / self.turns.len() as f64;
        }
        s
    }
}
