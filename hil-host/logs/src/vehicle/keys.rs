//! Numbers of a vehicle document by their dotted keys: in range or refused with the key, assumed and listed where not stated.

use crate::record::csv::ReadError;
use crate::vehicle::{CURRENT_KEY, Sensors, Tolerance, slips};
use hydro::effects::{Beyond, CD_BROADSIDE, Constants};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::Path;

/// Rms of the vertical motion of the calmest water that is believed, m/s (guess): below it every difference of form is a discovery.
const CALMEST_M_S: f64 = 0.001;

pub(super) struct Keys<'a> {
    pub(super) path: &'a Path,
    pub(super) document: &'a Value,
    /// Every key that was asked for.
    pub(super) asked: RefCell<BTreeSet<String>>,
}

impl Keys<'_> {
    pub(super) fn bad(&self, key: &str, why: String) -> ReadError {
        ReadError::Content { path: self.path.to_path_buf(), line: 0, column: key.into(), why }
    }

    /// The key that is a slip in one of those that were asked for so far, and that one.
    pub(super) fn slip(&self) -> Option<(String, String)> {
        slips::find(self.document, &self.asked.borrow())
    }

    /// What is wrong with a key that nothing reads.
    pub(super) fn unknown(&self, key: &str, meant: &str) -> ReadError {
        let meant = meant.rsplit('.').next().unwrap_or_default();
        self.bad(key, format!("unknown key; did you mean `{meant}`?"))
    }

    /// A slip in its name is the likelier cause of a missing key: that first.
    pub(super) fn slip_before(&self, error: ReadError) -> ReadError {
        let ReadError::Content { column, .. } = &error else { return error };
        match self.slip().filter(|(_, meant)| meant == column) {
            Some((key, meant)) => self.unknown(&key, &meant),
            None => error,
        }
    }

    pub(super) fn at(&self, key: &str) -> Option<&Value> {
        self.asked.borrow_mut().insert(key.to_owned());
        key.split('.').try_fold(self.document, |v, k| v.get(k)).filter(|v| !v.is_null())
    }

    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, ReadError> {
        match self.at(key) {
            None => Ok(None),
            Some(v) => match v.as_f64() {
                Some(x) if x.is_finite() => Ok(Some(x)),
                _ => Err(self.bad(key, format!("`{v}` is not a number"))),
            },
        }
    }

    pub(super) fn within(&self, key: &str, low: f64, high: f64, unit: &str) -> Result<f64, ReadError> {
        let missing = || self.bad(key, format!("is missing; expected a number in {unit}, {low} to {high}"));
        self.within_if_stated(key, low, high, unit)?.ok_or_else(missing)
    }

    pub(super) fn within_if_stated(&self, key: &str, low: f64, high: f64, unit: &str) -> Result<Option<f64>, ReadError> {
        match self.number(key)? {
            Some(v) if !(low..=high).contains(&v) => Err(self.bad(key, format!("is {v} {unit}; expected {low} to {high}"))),
            stated => Ok(stated),
        }
    }

    /// Whether a horizontal current may be there; it may where the file does not say.
    pub(super) fn current_unknown(&self) -> Result<bool, ReadError> {
        match self.at(CURRENT_KEY) {
            None => Ok(true),
            Some(said) if said == "unknown" => Ok(true),
            Some(said) if said == "none" => Ok(false),
            Some(other) => Err(self.bad(CURRENT_KEY, format!("is `{other}`; expected \"none\" or \"unknown\""))),
        }
    }

    fn segments(&self, key: &str) -> Result<Vec<u32>, ReadError> {
        let Some(v) = self.at(key) else { return Ok(Vec::new()) };
        let list = v.as_array().ok_or_else(|| self.bad(key, "is not a list of segment numbers".into()))?;
        list.iter()
            .map(|x| x.as_u64().and_then(|x| u32::try_from(x).ok()).ok_or_else(|| self.bad(key, format!("`{x}` is not a segment number"))))
            .collect()
    }

    /// Segments for fitting and those for checking, of which none is both.
    pub(super) fn fit_and_check(&self) -> Result<(Vec<u32>, Vec<u32>), ReadError> {
        let (fit, check) = (self.segments("segments.fit")?, self.segments("segments.check")?);
        match check.iter().find(|s| fit.contains(s)) {
            None => Ok((fit, check)),
            Some(both) => {
                let why = format!(
                    "is {check:?} and segments.fit {fit:?}: a segment that is fitted checks nothing; take {both} out of one of them"
                );
                Err(self.bad("segments.check", why))
            }
        }
    }
}

/// Most drag with the angle of attack squared: at the end of the law, 0.35 rad, it is 24 on S, more than a hull across the flow has
/// (`hydro.cd_broadside`, 20 at most).
const MOST_HULL_DRAG_PER_RAD2: f64 = 200.0;

/// The law with two terms more that holds over a wider range of angles of attack than the format's, where a file states it: all of it.
pub(super) struct Wide([f64; 6]);

impl Wide {
    /// Keys with what is possible of them, and units.
    const KEYS: [(&'static str, f64, f64, &'static str); 6] = [
        ("hydro.wide.lift_slope_per_rad", 0.1, 100.0, "1/rad"),
        ("hydro.wide.lift_quadratic_per_rad2", -100.0, 100.0, "1/rad2"),
        ("hydro.wide.slope_loss_per_rad2", -8.0, 8.0, "1/rad2"),
        ("hydro.wide.cd0", 1e-4, 10.0, "1"),
        ("hydro.wide.hull_drag_per_rad2", 0.0, MOST_HULL_DRAG_PER_RAD2, "1/rad2"),
        ("hydro.wide.hull_drag_per_rad3", -1e3, 1e3, "1/rad3"),
    ];

    pub(super) fn of(keys: &Keys) -> Result<Option<Self>, ReadError> {
        if keys.at("hydro.wide").is_none() {
            return Ok(None);
        }
        // All of them first: while one is missing, the next is no slip in it.
        for (key, ..) in Self::KEYS {
            let _ = keys.at(key);
        }
        let mut numbers = [0.0; 6];
        for (number, (key, low, high, unit)) in numbers.iter_mut().zip(Self::KEYS) {
            *number = keys.within(key, low, high, unit)?;
        }
        let [.., cd0, per_rad2, per_rad3] = numbers;
        let least = |a: f64| cd0 + (per_rad2 + per_rad3 * a) * a * a;
        if !(1..=35).all(|i| least(f64::from(i) * 0.01) > 0.0) {
            return Err(keys.bad("hydro.wide.hull_drag_per_rad3", "leaves no drag at some angle of attack below 0.35 rad".into()));
        }
        Ok(Some(Self(numbers)))
    }

    pub(super) fn replace(&self, c: &mut Constants) {
        let Self([slope, quadratic, loss, cd0, per_rad2, per_rad3]) = *self;
        (c.lift_slope_per_rad, c.lift_quadratic_per_rad2, c.slope_loss_per_rad2) = (slope, quadratic, loss);
        (c.cd0, c.hull_drag_per_rad2, c.hull_drag_per_rad3) = (cd0, per_rad2, per_rad3);
    }
}

/// Numbers of a document, and those that it does not state and were assumed.
pub(super) struct Stated<'a> {
    pub(super) keys: &'a Keys<'a>,
    pub(super) assumed: Vec<String>,
}

impl Stated<'_> {
    /// What the document states, within its physical bounds, or `default`, which is listed.
    pub(super) fn or(&mut self, key: &str, default: f64, low: f64, high: f64, unit: &str) -> Result<f64, ReadError> {
        match self.keys.within_if_stated(key, low, high, unit)? {
            Some(v) => Ok(v),
            None => {
                self.assumed.push(format!("{key} = {default}"));
                Ok(default)
            }
        }
    }

    pub(super) fn constants(&mut self) -> Result<Constants, ReadError> {
        let area = self.keys.within("hydro.reference_area_m2", 1e-3, 10.0, "m2")?;
        let wing =
            self.keys.within("hydro.wing_lift_slope_per_rad", 0.0, 20.0, "1/rad")? * self.keys.within("wing.area_m2", 0.0, 10.0, "m2")?;
        let hull = self.keys.within("hydro.hull_lift_slope_per_rad", 0.0, 50.0, "1/rad")?
            * self.keys.within("hydro.hull_area_m2", 0.0, 10.0, "m2")?;
        let wide = Wide::of(self.keys)?;
        let mut constants = Constants {
            gravity_m_s2: self.or("gravity_m_s2", 9.81, 9.7, 9.9, "m/s2")?,
            mass_kg: self.keys.within("mass_kg", 1.0, 5000.0, "kg")?,
            hull_volume_m3: self.keys.within("hull_volume_m3", 1e-3, 5.0, "m3")?,
            compressibility_per_pa: self.keys.within("hull_compressibility_per_pa", 0.0, 1e-8, "1/Pa")?,
            thermal_expansion_per_k: self.keys.within("hull_thermal_expansion_per_k", -1e-3, 1e-3, "1/K")?,
            reference_temperature_degc: self.or("reference_temperature_degc", 10.0, -5.0, 45.0, "degC")?,
            reference_area_m2: area,
            lift_slope_per_rad: (wing + hull) / area,
            lift_quadratic_per_rad2: self.or("hydro.lift_quadratic_per_rad2", 0.0, -100.0, 100.0, "1/rad2")?,
            cd0: self.keys.within("hydro.cd0", 1e-4, 10.0, "1")?,
            induced_k: self.or("hydro.induced_k", 0.0, -1.0, 50.0, "1")?,
            hull_drag_per_rad2: self.or("hydro.hull_drag_per_rad2", 0.0, -1.0, MOST_HULL_DRAG_PER_RAD2, "1/rad2")?,
            slope_loss_per_rad2: 0.0,
            hull_drag_per_rad3: 0.0,
            added_mass_surge: self.or("hydro.added_mass_surge", 0.2, 0.0, 5.0, "of the mass")?,
            added_mass_heave: self.or("hydro.added_mass_heave", 0.92, 0.0, 5.0, "of the mass")?,
            bank_tilt: self.keys.within_if_stated("hydro.bank_tilt", -10.0, 10.0, "of the tilt")?.unwrap_or(0.0),
            banked_turn: self.keys.within_if_stated("hydro.banked_turn", 0.0, 2.0, "of the turn")?.unwrap_or(0.0),
            hull_lag_share: self.keys.within_if_stated("hull_lag_share", -1.0, 2.0, "of the expansion")?.unwrap_or(0.0),
            beyond: Beyond {
                lift_fading: self.keys.within_if_stated("hydro.lift_fading", -3.0, 3.0, "of the way")?.unwrap_or(0.0),
                cd_broadside: self.keys.within_if_stated("hydro.cd_broadside", 0.1, 20.0, "of S")?.unwrap_or(CD_BROADSIDE),
            },
        };
        let floats_at = constants.mass_kg / constants.hull_volume_m3;
        if !(850.0..1250.0).contains(&floats_at) {
            let why = format!("with mass_kg it floats at {floats_at:.0} kg/m3; water is 990 to 1080 kg/m3: one of the two is wrong");
            return Err(self.keys.bad("hull_volume_m3", why));
        }
        if let Some(stated) = &wide {
            stated.replace(&mut constants);
        }
        if constants.bank_tilt != 0.0 && constants.banked_turn != 0.0 {
            return Err(self
                .keys
                .bad("hydro.banked_turn", "a turn tilts the lift by itself: state hydro.bank_tilt or hydro.banked_turn, not both".into()));
        }
        Ok(constants)
    }

    fn relative(&mut self, key: &str, usual: f64) -> Result<f64, ReadError> {
        self.or(&format!("tolerance_1sigma.{key}"), usual, 0.0, 10.0, "of it")
    }

    pub(super) fn tolerance(&mut self) -> Result<Tolerance, ReadError> {
        let t = Tolerance::default();
        Ok(Tolerance {
            cd0_relative: self.relative("cd0_relative", t.cd0_relative)?,
            lift_slope_relative: self.relative("lift_slope_relative", t.lift_slope_relative)?,
            lift_quadratic_relative: self.relative("lift_quadratic_relative", t.lift_quadratic_relative)?,
            trim_volume_m3: self.or("tolerance_1sigma.trim_volume_cc", t.trim_volume_m3 * 1e6, 0.0, 5e3, "cm3")? * 1e-6,
            ballast_gain_relative: self.relative("ballast_gain_relative", t.ballast_gain_relative)?,
            pitch_zero_rad: self.or("tolerance_1sigma.pitch_zero_rad", t.pitch_zero_rad, 0.0, 0.5, "rad")?,
            hull_compressibility_relative: self.relative("hull_compressibility_relative", t.hull_compressibility_relative)?,
            hull_thermal_expansion_relative: self.relative("hull_thermal_expansion_relative", t.hull_thermal_expansion_relative)?,
            added_mass_surge: self.or("tolerance_1sigma.added_mass_surge", t.added_mass_surge, 0.0, 5.0, "of the mass")?,
            added_mass_heave: self.or("tolerance_1sigma.added_mass_heave", t.added_mass_heave, 0.0, 5.0, "of the mass")?,
        })
    }

    pub(super) fn sensors(&mut self) -> Result<Sensors, ReadError> {
        let s = Sensors::default();
        Ok(Sensors {
            pressure_noise_pa: self.or("sensors.pressure_noise_dbar", s.pressure_noise_pa * 1e-4, 0.0, 100.0, "dbar")? * 1e4,
            pressure_resolution_pa: self.or("sensors.pressure_resolution_dbar", s.pressure_resolution_pa * 1e-4, 0.0, 100.0, "dbar")? * 1e4,
            pitch_noise_rad: self.or("sensors.pitch_noise_rad", s.pitch_noise_rad, 0.0, 0.5, "rad")?,
            pitch_resolution_rad: self.or("sensors.pitch_resolution_rad", s.pitch_resolution_rad, 0.0, 0.5, "rad")?,
            heading_noise_rad: self.or("sensors.heading_noise_rad", s.heading_noise_rad, 0.0, 3.2, "rad")?,
            heading_bias_rad: self.or("sensors.heading_bias_1sigma_rad", s.heading_bias_rad, 0.0, 3.2, "rad")?,
            gps_noise_m: self.or("sensors.gps_noise_m", s.gps_noise_m, 0.0, 1e4, "m")?,
            speed_noise_m_s: self.keys.within_if_stated("sensors.speed_noise_m_s", 0.0, 5.0, "m/s")?.unwrap_or(s.speed_noise_m_s),
            speed_scale_relative: self
                .keys
                .within_if_stated("sensors.speed_scale_1sigma", 0.0, 5.0, "of it")?
                .unwrap_or(s.speed_scale_relative),
        })
    }

    /// Rms, m/s, and correlation time, s, of the ordinary vertical water motion.
    pub(super) fn background(&mut self) -> Result<(f64, f64), ReadError> {
        let stated = self.or("background_vertical_water_motion.rms_m_s", 0.005, 0.0, 1.0, "m/s")?;
        let background = (stated.max(CALMEST_M_S), self.or("background_vertical_water_motion.correlation_time_s", 90.0, 0.1, 1e5, "s")?);
        if stated < CALMEST_M_S {
            self.assumed
                .push(format!("background_vertical_water_motion.rms_m_s = {CALMEST_M_S} (the file says {stated}, calmer than any water)"));
        }
        Ok(background)
    }
}
