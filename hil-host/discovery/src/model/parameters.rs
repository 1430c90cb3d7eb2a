//! What scatters in every vehicle: calibration and nuisance parameters, and the model that a state of them means. Their table is in
//! `parameters/table.rs`.

mod table;

pub(crate) use table::PRESSURE_ZERO_PA;
pub use table::{N_CALIBRATION, PARAMETERS, Parameter, Stated};

use crate::ablation::is_on;
use crate::model::internal_wave::Wave;
use hydro::effects::{Active, Constants, Effect};
use logs::vehicle::Vehicle;
use table::{Acts, Group, Spread, Tail};

/// How many parameters there are up to the end of a group.
const fn up_to(last: Group) -> usize {
    let mut n = 0;
    while n < N_CALIBRATION && PARAMETERS[n].group as usize <= last as usize {
        n += 1;
    }
    n
}

/// Two-sided 90 % of a normal variable, sigma: the interval in which numbers are stated.
pub const NINETY: f64 = 1.645;

/// Their names.
pub const CALIBRATION: [&str; N_CALIBRATION] = {
    let mut names = [""; N_CALIBRATION];
    let mut k = 0;
    while k < N_CALIBRATION {
        names[k] = PARAMETERS[k].name;
        k += 1;
    }
    names
};

/// Where a parameter stands in the table.
const fn at(name: &str) -> usize {
    let mut k = 0;
    while !same(CALIBRATION[k].as_bytes(), name.as_bytes()) {
        k += 1;
    }
    k
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

/// How many of them, from the first, have a tolerance that the vehicle file states.
pub(crate) const STATED: usize = up_to(Group::Stated);
/// How many of them, from the first, are numbers of the law of the vehicle; what follows are nuisances.
pub(crate) const N_LAW: usize = up_to(Group::Law);
/// How many of them change the simulation.
pub const N_SIMULATED: usize = up_to(Group::Simulated);

pub(crate) const DRAG: usize = at("cd0");
pub(crate) const LIFT_SLOPE: usize = at("lift_slope");
pub(crate) const TRIM_VOLUME: usize = at("trim_volume");
pub(crate) const BALLAST_GAIN: usize = at("ballast_gain");
pub(crate) const PITCH_ZERO: usize = at("pitch_zero");
pub(crate) const HEAVE_MASS: usize = at("added_mass_heave");
/// The last number of the law where it holds; what follows is beyond it.
pub(crate) const HULL_DRAG: usize = at("hull_drag");
pub(crate) const CLOCK_OFFSET: usize = at("clock_offset");
pub(crate) const BANKED_TURN: usize = at("banked_turn");
pub(crate) const SPEED_SCALE: usize = at("speed_scale");
pub(crate) const HEADING_BIAS: usize = at("heading_bias");
pub(crate) const PRESSURE_ZERO: usize = at("pressure_zero");
pub(crate) const PRESSURE_PORT: usize = at("pressure_port");
/// The first of those that only the position of the battery shows.
pub(crate) const BATTERY_ZERO: usize = at("battery_zero");
/// The first of the moments in pitch.
pub(crate) const BATTERY_MASS: usize = at("battery_mass");
pub(crate) const METACENTRIC_HEIGHT: usize = at("metacentric_height");
pub(crate) const BALLAST_ARM: usize = at("ballast_arm");
pub(crate) const PITCH_MOMENT: usize = at("pitch_moment");
pub(crate) const PITCH_DAMPING: usize = at("pitch_damping");

impl Parameter {
    /// What the vehicle file states of its tolerance; none where it states nothing.
    #[must_use]
    pub const fn stated(&self) -> Option<Stated> {
        if let Spread::Stated(stated) = self.tolerance { Some(stated) } else { None }
    }

    /// Whether a deviation is relative to the constant of the law.
    #[must_use]
    pub const fn is_relative(&self) -> bool {
        matches!(self.acts, Acts::Scales(_) | Acts::ScalesToTenth(_))
    }

    /// What it is for a reader, in which unit, and the factor to that; none where its prior has no wide tail.
    pub(crate) fn of_sensor(&self) -> Option<(&'static str, &'static str, f64)> {
        self.tail.as_ref().map(|t| (t.what, t.unit, t.factor))
    }

    /// Its constant of the law; none where it has none.
    #[must_use]
    pub fn constant(&self, constants: &Constants) -> Option<f64> {
        match self.acts {
            Acts::Scales(of) | Acts::ScalesToTenth(of) | Acts::Shifts(of) => Some(*of(&mut { *constants })),
            Acts::Is(_) | Acts::Observations => None,
        }
    }

    /// Its 1-sigma tolerance in the unit of the model.
    fn spread(&self, vehicle: &Vehicle) -> f64 {
        match self.tolerance {
            Spread::Stated(Stated { place, .. }) => *place(&mut { vehicle.tolerance }),
            Spread::Of(of) => of(vehicle),
            Spread::Guess(guess) => guess,
        }
    }

    /// Factor from the unit of the model to that of the tolerance.
    fn factor(&self) -> f64 {
        self.stated().map_or(1.0, |s| s.factor)
    }

    /// Applies a deviation of `z` tolerances.
    fn apply(&self, vehicle: &Vehicle, z: f64, constants: &mut Constants, effects: &mut Vec<Active>) {
        let by = z * self.spread(vehicle);
        match self.acts {
            Acts::Scales(of) => *of(constants) *= 1.0 + by,
            Acts::ScalesToTenth(of) => *of(constants) *= (1.0 + by).max(0.1),
            Acts::Shifts(of) => *of(constants) += by,
            Acts::Is(effect) if z != 0.0 => effects.push(Active::sized(effect, by)),
            Acts::Is(_) | Acts::Observations => {}
        }
    }

    /// Factor on what a vehicle file says of it, by a deviation of `z` tolerances.
    pub(crate) fn on_document(&self, vehicle: &Vehicle, z: f64) -> f64 {
        let by = z * self.spread(vehicle);
        if let Acts::Shifts(of) = self.acts { 1.0 + by / *of(&mut vehicle.constants.clone()) } else { 1.0 + by }
    }
}

/// The wide tail of a parameter's prior.
fn wide(index: usize) -> Option<&'static Tail> {
    const TABLE: &[Parameter; N_CALIBRATION] = &PARAMETERS;
    TABLE[index].tail.as_ref().filter(|_| index != HEAVE_MASS || is_on("heave_mass"))
}

/// Between what values a calibration number may be, in its tolerances; none where nothing bounds it.
#[must_use]
pub(crate) fn bounds(vehicle: &Vehicle, index: usize) -> Option<(f64, f64)> {
    let (w, tolerance) = (wide(index)?, tolerance_of(vehicle, index));
    // A file that states how lift tilts has said what a bank does.
    if index == BANKED_TURN && vehicle.constants.bank_tilt != 0.0 {
        return Some((0.0, 0.0));
    }
    // What the file has of it already counts.
    let has = PARAMETERS[index].constant(&vehicle.constants).unwrap_or(0.0);
    Some(((w.bounds.0 - has).min(0.0) / tolerance, (w.bounds.1 - has).max(0.0) / tolerance))
}

/// The parameter that an effect is the error of: its index in [`PARAMETERS`].
#[must_use]
pub fn calibration_of(effect: &Effect) -> Option<usize> {
    let of = effect.error_of?;
    PARAMETERS.iter().position(|p| p.error_of == Some(of))
}

/// Tolerance of a calibration number in the unit of the effect that deviates it.
#[must_use]
pub fn tolerance_of(vehicle: &Vehicle, index: usize) -> f64 {
    let p = &PARAMETERS[index];
    p.spread(vehicle) * p.factor()
}

/// Sets a tolerance that the vehicle file states, in the unit of its key; others stay.
pub(crate) fn set_tolerance(vehicle: &mut Vehicle, index: usize, value: f64) {
    if let Some(stated) = PARAMETERS[index].stated() {
        *(stated.place)(&mut vehicle.tolerance) = value * (1.0 / stated.factor);
    }
}

/// Whether a calibration number is an ordinary number of the law: it scatters within its tolerance, and a name is for what is beyond.
#[must_use]
pub(crate) fn is_law(index: usize) -> bool {
    index < N_LAW && !is_nuisance(index)
}

/// Whether a calibration number is one that no vehicle file knows: its prior has a wide tail, and what it deviates by is no recalibration.
#[must_use]
pub fn is_nuisance(index: usize) -> bool {
    wide(index).is_some()
}

/// Prior of a number that may have been guessed at, where a calibration number has a wide tail: cost against a value of zero (minus twice
/// the log density), and precision of the normal prior of the same pull. None for the others, whose prior is normal.
#[must_use]
pub(crate) fn wide_tail(vehicle: &Vehicle, index: usize, z: f64) -> Option<(f64, f64)> {
    let w = wide(index)?;
    let width = w.wide / tolerance_of(vehicle, index);
    let density = |z: f64| [(1.0 - w.probability) * (-0.5 * z * z).exp(), w.probability / width * (-0.5 * (z / width).powi(2)).exp()];
    let [[core, tail], [core_at_zero, tail_at_zero]] = [density(z), density(0.0)];
    let cost = -2.0 * ((core + tail) / (core_at_zero + tail_at_zero)).ln();
    Some((cost, (core + tail / (width * width)) / (core + tail)))
}

/// Step of a difference in a calibration number, in its tolerances: half of one, but never further than a vehicle stays linear.
#[must_use]
pub fn step_of(vehicle: &Vehicle, index: usize) -> f64 {
    PARAMETERS[index].largest_step.map_or(1.0, |largest| (largest / tolerance_of(vehicle, index)).min(0.5))
}

/// Values of all unknowns.
#[derive(Clone, Debug)]
pub struct State {
    /// Calibration numbers in units of their tolerance.
    pub calibration: [f64; N_CALIBRATION],
    /// Effects on trial.
    pub effects: Vec<Active>,
    /// Internal wave on trial.
    pub wave: Option<Wave>,
}

impl State {
    /// Everything nominal.
    #[must_use]
    pub fn nominal() -> Self {
        Self { calibration: [0.0; N_CALIBRATION], effects: Vec::new(), wave: None }
    }

    /// Whether this is the vehicle as its file gives it.
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        self.effects_in_all() == 0 && self.calibration.iter().all(|z| *z == 0.0)
    }

    /// How many effects are on trial, the wave among them.
    #[must_use]
    pub fn effects_in_all(&self) -> usize {
        self.effects.len() + usize::from(self.wave.is_some())
    }
}

/// What a state says of the sensors; the law of the vehicle is [`law`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorErrors {
    /// Time by which pitch, roll and ballast are logged later than the pressure of the same instant, s.
    pub clock_s: f64,
    /// Distance of the pressure port ahead of the centre of the hull, m.
    pub port_m: f64,
}

/// Sensor errors that a state means.
#[must_use]
pub fn sensor_errors(vehicle: &Vehicle, state: &State) -> SensorErrors {
    let of = |index: usize| state.calibration[index] * tolerance_of(vehicle, index);
    SensorErrors { clock_s: of(CLOCK_OFFSET), port_m: of(PRESSURE_PORT) }
}

/// Constants and effects that a state of a vehicle means.
#[must_use]
pub fn law(vehicle: &Vehicle, state: &State) -> (Constants, Vec<Active>) {
    let (mut constants, mut effects) = (vehicle.constants, vehicle.effects.clone());
    for (p, z) in PARAMETERS.iter().zip(state.calibration) {
        p.apply(vehicle, z, &mut constants, &mut effects);
    }
    effects.extend_from_slice(&state.effects);
    (constants, effects)
}

#[cfg(test)]
mod tests {
    use super::{BALLAST_ARM, BATTERY_MASS, HEAVE_MASS, METACENTRIC_HEIGHT, wide_tail};
    use logs::vehicle::{Vehicle, parse};

    fn vehicle() -> Vehicle {
        let text = include_str!("../../../../vehicles/modena.toml");
        parse(toml::from_str(text).expect("TOML"), std::path::Path::new("modena.toml")).expect("a vehicle")
    }

    #[test]
    fn accuracy_a_wide_tail_is_its_cost_derived_and_costs_little_far_out() {
        let vehicle = vehicle();
        for index in (0..super::N_CALIBRATION).filter(|k| super::wide(*k).is_some()) {
            let cost = |z: f64| wide_tail(&vehicle, index, z).expect("a tail").0;
            assert_eq!(cost(0.0), 0.0);
            for z in [-20.0, -3.0, 0.4, 2.0, 2.9, 5.0, 11.0] {
                let (_, precision) = wide_tail(&vehicle, index, z).expect("a tail");
                let slope = (cost(z + 1e-5) - cost(z - 1e-5)) / 2e-5;
                // A normal prior of this precision: cost p z², slope 2 p z; differenced to 1e-7.
                assert!((slope - 2.0 * precision * z).abs() < 1e-6 * (1.0 + slope.abs()), "{index} {z}: {slope} {precision}");
            }
        }
        // Thirty hundredths off: as improbable as a guess is, and as that it is off by so much. A normal prior would ask for 900.
        let far = wide_tail(&vehicle, METACENTRIC_HEIGHT, 30.0).expect("a tail").0;
        assert!((far - (1.0 + 2.0 * (30.0_f64 * 9.0).ln())).abs() < 0.1, "{far}");
        let has = |index: usize| wide_tail(&vehicle, index, 1.0).is_some();
        assert!(!has(BATTERY_MASS - 1) && has(BALLAST_ARM) && has(HEAVE_MASS) && !has(HEAVE_MASS - 1));
    }

    #[test]
    fn the_table_is_in_groups_and_every_name_is_there_once() {
        let groups: Vec<usize> = super::PARAMETERS.iter().map(|p| p.group as usize).collect();
        assert!(groups.is_sorted(), "{groups:?}");
        assert_eq!([super::STATED, super::N_LAW, super::N_SIMULATED], [10, 14, 17]);
        for (k, p) in super::PARAMETERS.iter().enumerate() {
            assert_eq!(super::at(p.name), k, "{} is there twice", p.name);
            assert_eq!(p.stated().is_some(), k < super::STATED, "{}", p.name);
        }
    }
}
