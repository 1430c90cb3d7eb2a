//! Which flight would tell tied hypotheses apart: legs are simulated with every hypothesis, and those are chosen greedily that
//! lift the smallest separation of any two most.
//!
//! Separation of two hypotheses on a leg: whitened distance of the depths they predict, with what the calibration could mimic
//! projected out over all legs chosen so far (expected chi², so 2.7 is 90 % sure for one number). Legs differ in pitch and
//! buoyancy drive; each is one dive and climb through the water of the flight at hand, within reach of the vehicle.

use crate::diagnosis::Diagnosis;
use crate::likelihood::whitening::{Colour, Whitener};
use crate::model::dynamics::Track;
use crate::model::integrator::track;
use crate::model::parameters::{N_SIMULATED, State, law};
use crate::preprocess::{Input, Run};
use hydro::effects::{Continuation, Sensed};
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};

/// One leg of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Pitch held, rad, positive; dives nose down, climbs nose up.
    pub pitch_rad: f64,
    /// Buoyancy drive, m³.
    pub ballast_m3: f64,
}

/// How far a vehicle reaches.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Largest buoyancy drive of its pump either side of neutral, m³.
    pub ballast_m3: f64,
    /// Least drive that it is sent with, m³.
    pub least_ballast_m3: f64,
    /// Working depth, m.
    pub depth_m: f64,
}

impl Reach {
    /// A vehicle of which no limit is known: the flight at hand sets them.
    pub const UNKNOWN: Self = Self { ballast_m3: f64::INFINITY, least_ballast_m3: 0.0, depth_m: f64::INFINITY };
}

/// Expected chi² from which two hypotheses count as told apart: 90 % sure for one number.
pub const DISTINCT_CHI2: f64 = 2.7;

/// A plan.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Hypotheses to tell apart.
    pub tied: Vec<Vec<&'static str>>,
    /// Legs in the order of their worth.
    pub legs: Vec<Leg>,
    /// Smallest separation of any two hypotheses after each leg (expected chi²).
    pub separation: Vec<f64>,
    /// The same number of legs all alike (middle pitch, full drive), for comparison.
    pub default_separation: f64,
    /// Deepest depth, m.
    pub depth_max_m: f64,
    /// Least depth, m.
    pub depth_min_m: f64,
}

/// Pitches on the menu, rad (11° to 40°), and drives as shares of the largest seen.
const PITCHES_RAD: [f64; 6] = [0.20, 0.28, 0.37, 0.46, 0.58, 0.70];
const DRIVES: [f64; 2] = [0.6, 1.0];
/// Legs of a mission file.
const LEGS: usize = 6;

/// A dive and a climb at constant pitch and drive through a water column.
fn leg_run(leg: Leg, column: &dyn Fn(f64) -> (f64, f64), top: f64, bottom: f64, speed: f64, start_s: f64) -> Run {
    let step = 2.0;
    let half = (bottom - top) / speed;
    let total = 2.0 * half + 80.0;
    let turn = half + 40.0;
    let count = (total / (0.5 * step)) as usize;
    let mut inputs = Vec::with_capacity(count + 3);
    for j in 0..count + 3 {
        let t = j as f64 * 0.5 * step;
        // tanh over 12 s: the pitch mode of a Slocum.
        let x = (t - turn) / 12.0;
        let (s, q) = (x.tanh(), (1.0 - x.tanh().powi(2)) / 12.0);
        let depth = if t < turn { top + (t - 40.0).max(0.0) * speed } else { bottom - (t - turn) * speed }.clamp(top, bottom);
        let (rho, temperature) = column(depth);
        let pitch = leg.pitch_rad * s;
        let roll_rad: f64 = if (t / 60.0) as i64 % 3 == 1 { 0.2 } else { 0.0 };
        inputs.push(Input {
            sensed: Sensed {
                time_s: start_s + t,
                pitch_rad: pitch,
                ballast_m3: leg.ballast_m3 * ((t - turn) / 15.0).clamp(-1.0, 1.0),
                density_kg_m3: rho,
                temperature_degc: temperature,
                hull_degc: temperature,
                pressure_pa: depth * 1.0e4,
            },
            pitch_rate_rad_s: leg.pitch_rad * q,
            sin_pitch: pitch.sin(),
            cos_pitch: pitch.cos(),
            roll_rad,
            cos_roll: roll_rad.cos(),
            sin_heading: 0.0,
            cos_heading: 1.0,
            depth_m: depth.max(1.0),
            cd0_relative: 1.0,
        });
    }
    let time_s: Vec<f64> = (0..(total / 4.0) as usize).map(|i| start_s + i as f64 * 4.0).collect();
    let depth_m: Vec<f64> = time_s.iter().map(|t| inputs[((t - start_s) / (0.5 * step)) as usize].depth_m).collect();
    Run {
        segment: 0,
        first_row: 0,
        used: time_s.iter().map(|t| t - start_s > 60.0).collect(),
        unseen: vec![false; time_s.len()],
        pressure_pa: depth_m.iter().map(|z| z * 1e4).collect(),
        speed_m_s: vec![f64::NAN; time_s.len()],
        battery_m: vec![f64::NAN; time_s.len()],
        ballast_m3: vec![leg.ballast_m3; time_s.len()],
        depth_m,
        time_s,
        inputs,
        step_s: step,
        displacement_m: None,
        displacement_s: f64::NAN,
        fixes: [None; 2],
        blind: false,
        surface: [None, None],
        starts_afloat: false,
        start_speed_m_s: 0.0,
    }
}

/// A hypothesis: the effects it names and its fit.
type Hypothesis = (Vec<&'static str>, State);

/// A leg on the menu, as every hypothesis predicts it.
struct MenuLeg {
    leg: Leg,
    /// Whitened prediction of each hypothesis, and sensitivities of the calibration.
    predictions: Vec<DVector<f64>>,
    calibration: DMatrix<f64>,
}

/// Hypotheses that the plan is to tell apart, most probable first.
fn tied(d: &Diagnosis) -> Vec<Hypothesis> {
    let mut tied: Vec<Hypothesis> = Vec::new();
    let wanted = d.equivalent.len().max(2);
    let ranked = || d.equivalent.iter().filter_map(|e| d.candidates.iter().find(|c| c.effects == *e)).chain(&d.candidates);
    // A wave's phase on another day is unknown: legs are planned without it, and tell apart what stands with a wave or what stands without.
    let with_wave = ranked().next().is_some_and(|c| c.state.wave.is_some());
    for c in ranked() {
        let known = tied.iter().any(|t| t.0 == c.effects);
        if !known && c.state.wave.is_some() == with_wave && c.log_odds.is_finite() && tied.len() < wanted {
            tied.push((c.effects.clone(), c.state.clone()));
        }
    }
    tied
}

/// The water column of the flight at hand: depth m, density kg/m³, temperature °C.
struct Levels(Vec<(f64, f64, f64)>);

impl Levels {
    fn of(d: &Diagnosis) -> Self {
        let inputs = |r: &Run| {
            let of_input = |i: &Input| (i.depth_m, i.sensed.density_kg_m3, i.sensed.temperature_degc);
            r.inputs.iter().step_by(4).map(of_input).collect::<Vec<_>>()
        };
        let mut levels: Vec<(f64, f64, f64)> = d.prepared.runs.iter().flat_map(inputs).collect();
        levels.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self(levels)
    }

    fn bottom(&self) -> f64 {
        logs::record::plausible::quantile(&self.0.iter().map(|l| l.0).collect::<Vec<_>>(), 0.98).max(8.0)
    }

    fn at(&self, z: f64) -> (f64, f64) {
        let levels = &self.0;
        let k = levels.partition_point(|l| l.0 < z).clamp(1, levels.len() - 1);
        let (a, b) = (levels[k - 1], levels[k]);
        let f = if b.0 > a.0 { ((z - a.0) / (b.0 - a.0)).clamp(0.0, 1.0) } else { 0.0 };
        (a.1 + (b.1 - a.1) * f, a.2 + (b.2 - a.2) * f)
    }
}

/// Simulates legs between two depths with every hypothesis.
struct Simulator<'a> {
    vehicle: &'a Vehicle,
    tied: &'a [Hypothesis],
    continuation: Continuation,
    levels: Levels,
    depths_m: [f64; 2],
    noise: Colour,
}

impl Simulator<'_> {
    fn run(&self, leg: Leg, speed_m_s: f64) -> Run {
        const DAY_S: f64 = 86_400.0;
        leg_run(leg, &|z| self.levels.at(z), self.depths_m[0], self.depths_m[1], speed_m_s, DAY_S)
    }

    fn track(&self, run: &Run, state: &State) -> Track {
        let (constants, effects) = law(self.vehicle, state);
        track(run, constants, &effects, self.vehicle.water_depth_m, self.continuation)
    }

    /// How fast a leg sinks, m/s: asked of the model itself.
    fn speed_m_s(&self, leg: Leg) -> f64 {
        let mut speed = 0.12;
        for _ in 0..3 {
            let t = self.track(&self.run(leg, speed), &self.tied[0].1);
            let middle = t.sink_m_s.len() / 3;
            speed = t.sink_m_s.get(middle).copied().unwrap_or(0.12).clamp(0.03, 0.6);
        }
        speed
    }

    /// A leg as every hypothesis predicts it; none if the model stalls on it.
    fn offer(&self, leg: Leg) -> Option<MenuLeg> {
        let speed = self.speed_m_s(leg);
        let run = self.run(leg, speed);
        let whitener = Whitener::new(&run, &run.used, |_| false, &self.noise);
        let predict = |state: &State| {
            let t = self.track(&run, state);
            let mut out = Vec::new();
            whitener.whiten(|row| t.depth_m[row], &mut out);
            DVector::from_vec(out)
        };
        let predictions: Vec<DVector<f64>> = self.tied.iter().map(|(_, s)| predict(s)).collect();
        let base = &self.tied[0].1;
        let columns: Vec<DVector<f64>> = (0..N_SIMULATED)
            .map(|k| {
                let mut shifted = base.clone();
                shifted.calibration[k] += 0.5;
                (predict(&shifted) - &predictions[0]) * 2.0
            })
            .collect();
        let flies = predictions.iter().all(|p| p.iter().all(|v| v.is_finite())) && speed > 0.04;
        flies.then(|| MenuLeg { leg, predictions, calibration: DMatrix::from_columns(&columns) })
    }
}

/// Smallest separation of any two hypotheses on these legs (expected chi²), the calibration projected out.
fn separation(chosen: &[&MenuLeg]) -> f64 {
    let mut curvature = DMatrix::identity(N_SIMULATED, N_SIMULATED);
    for o in chosen {
        curvature += o.calibration.transpose() * &o.calibration;
    }
    let Some(c) = curvature.cholesky() else { return 0.0 };
    let count = chosen.first().map_or(0, |o| o.predictions.len());
    let mut least = f64::INFINITY;
    for i in 0..count {
        for j in i + 1..count {
            let (mut square, mut match_) = (0.0, DVector::zeros(N_SIMULATED));
            for o in chosen {
                let difference = &o.predictions[i] - &o.predictions[j];
                square += difference.norm_squared();
                match_ += o.calibration.transpose() * difference;
            }
            least = least.min(square - match_.dot(&c.solve(&match_)));
        }
    }
    least
}

/// Legs in the order of their worth, each with the separation after it.
fn choose(offers: &[MenuLeg]) -> Option<Vec<(f64, &MenuLeg)>> {
    let (mut chosen, mut steps): (Vec<&MenuLeg>, Vec<(f64, &MenuLeg)>) = (Vec::new(), Vec::new());
    for _ in 0..LEGS {
        let best = offers
            .iter()
            .map(|o| {
                let mut with = chosen.clone();
                with.push(o);
                (separation(&with), o)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        steps.push(best);
        chosen.push(best.1);
    }
    Some(steps)
}

/// Plans the flight that best separates the hypotheses that a diagnosis could not tell apart.
///
/// With one hypothesis left, it is set against the runner-up; with none, the two most probable are. Drives and depths are those of the
/// flight at hand, as far as the vehicle that dives to this depth (m) reaches: a sensed ballast has its own gain and offset and may be
/// more than the pump has.
///
/// # Errors
/// Why there is none, in words.
pub fn plan(d: &Diagnosis, vehicle: &Vehicle, reach: impl Fn(f64) -> Reach) -> Result<Plan, String> {
    let tied = tied(d);
    if tied.len() < 2 {
        return Err("there are no two hypotheses to tell apart".into());
    }
    let levels = Levels::of(d);
    let bottom = levels.bottom();
    let reach = reach(bottom);
    let bottom = bottom.min(reach.depth_m);
    let top = 3.0_f64.min(0.3 * bottom);
    let sensed = d.prepared.runs.iter().flat_map(|r| r.inputs.iter().map(|i| i.sensed.ballast_m3.abs())).fold(0.0, f64::max);
    let drive = sensed.min(reach.ballast_m3);
    let noise = Colour {
        rms_m_s: vehicle.background.0,
        correlation_s: vehicle.background.1,
        sensor_m: vehicle.sensors.pressure_noise_pa / 1e4,
        walk_m2_s: 1e-6,
    };
    let simulator = Simulator { vehicle, tied: &tied, continuation: d.branch.continuation, levels, depths_m: [top, bottom], noise };
    let menu = PITCHES_RAD
        .into_iter()
        .flat_map(|pitch_rad| DRIVES.map(|share| Leg { pitch_rad, ballast_m3: (share * drive).max(reach.least_ballast_m3) }));
    let offers: Vec<MenuLeg> = menu.filter_map(|leg| simulator.offer(leg)).collect();
    let no_leg = || {
        let [of, logged] = [drive, sensed].map(|m3| 1e6 * m3);
        let what = format!("no leg at any pitch glides through this water, 0 to {bottom:.0} m");
        if drive < sensed {
            format!("with {of:.0} cc, the largest pump that is simulated, {what}; this vehicle's own moved {logged:.0} cc")
        } else {
            format!("{what}, with a pump of {of:.0} cc, as was logged")
        }
    };
    let steps = choose(&offers).ok_or_else(no_leg)?;
    let plain = offers.iter().min_by(|a, b| {
        let off = |o: &MenuLeg| (o.leg.pitch_rad - 0.46).abs() + (o.leg.ballast_m3 - drive).abs() * 1e3;
        off(a).total_cmp(&off(b))
    });
    let plain = plain.ok_or_else(no_leg)?;
    Ok(Plan {
        tied: tied.iter().map(|t| t.0.clone()).collect(),
        legs: steps.iter().map(|s| s.1.leg).collect(),
        separation: steps.iter().map(|s| s.0).collect(),
        default_separation: separation(&[plain; LEGS]),
        depth_max_m: bottom,
        depth_min_m: top,
    })
}

impl Plan {
    /// Expected chi² of the two hypotheses told apart least, after all legs.
    #[must_use]
    pub fn expected_chi2(&self) -> f64 {
        self.separation.last().copied().unwrap_or(0.0)
    }

    /// Whether the mission would tell the hypotheses apart.
    #[must_use]
    pub fn tells_apart(&self) -> bool {
        self.expected_chi2() >= DISTINCT_CHI2
    }

    /// The mission file that `glider fly` reads. `wings` is `standard` or `low-ar`. Flown from the flattest pitch to the steepest: the
    /// trim learned at one pitch is near that of the next.
    #[must_use]
    pub fn mission(&self, wings: &str) -> String {
        let names: Vec<String> = self.tied.iter().map(|t| t.join(" with ")).collect();
        // Without a limit a mission may last as long as its legs take: six dives to 900 m are two days.
        let mut out = format!("# Written by glider next-flight: tells apart {}\nwings = \"{wings}\"\n", names.join(", "));
        let mut legs = self.legs.clone();
        legs.sort_by(|a, b| a.pitch_rad.total_cmp(&b.pitch_rad).then(a.ballast_m3.total_cmp(&b.ballast_m3)));
        for dives in legs.chunk_by(|a, b| a == b) {
            // Down to the whole cm³: rounding up would be more than the pump has.
            out += &format!(
                "\n[[leg]]\ndives = {}\ndepth_min_m = {:.0}\ndepth_max_m = {:.0}\ngoal = \"fixed-pitch\"\npitch_deg = {:.1}\nballast_cc = {:.0}\n",
                dives.len(),
                self.depth_min_m,
                self.depth_max_m,
                dives[0].pitch_rad.to_degrees(),
                (dives[0].ballast_m3 * 1e6 + 1e-6).floor()
            );
        }
        out
    }
}
