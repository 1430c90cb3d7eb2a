//! Vehicles by name or file, and their polars.
//!
//! The vehicle files of the project are built in, so that commands work in any folder. A vehicle is geometry
//! (`glider-vehicle/1`) or coefficients (`glider-trial/1`); both answer as one [`hydro::Polar`].

use std::path::Path;

use crate::flight::file_kinds::{Kind, expect};
pub use crate::flight::mission_file::wings_name;
use crate::spelling::{meant, meant_path};
use anyhow::{Context as _, bail, ensure};
use control::PitchSensor;
use hydro::effects::{Active, Constants, Sensed};
use hydro::{Added, Flow, ForceModel, Geometry, GeometryPolar, LiftDrag, Polar};
use logs::Vehicle;
use logs::import::classes::Class;
use logs::vehicle;
use signals::Wings;

/// Vehicle files that come with the program: name without `.toml`, text.
pub const BUILT_IN_VEHICLES: [(&str, &str); 6] = [
    ("slocum-standard", include_str!("../../../../vehicles/slocum-standard.toml")),
    ("slocum-low-ar", include_str!("../../../../vehicles/slocum-low-ar.toml")),
    ("slocum-standard-sea", include_str!("../../../../vehicles/slocum-standard-sea.toml")),
    ("slocum-low-ar-sea", include_str!("../../../../vehicles/slocum-low-ar-sea.toml")),
    ("paper-standard", include_str!("../../../../vehicles/paper-standard.toml")),
    ("paper-low-ar", include_str!("../../../../vehicles/paper-low-ar.toml")),
];

/// The built-in vehicle that the flight table of a wing set is made from.
#[must_use]
pub fn sea_name(wings: Wings) -> &'static str {
    match wings {
        Wings::Standard => "slocum-standard-sea",
        Wings::LowAspectRatio => "slocum-low-ar-sea",
    }
}

/// What a vehicle is made of.
#[derive(Clone, Debug)]
enum Form {
    Geometry { polar: Box<GeometryPolar>, constants: Constants },
    Coefficients(Constants),
}

/// A vehicle ready to be asked for lift and drag.
#[derive(Clone, Debug)]
pub struct Model {
    /// Name for people.
    pub name: String,
    /// Wing set.
    pub wings: Wings,
    /// CRC-32 of the vehicle file.
    pub id: u32,
    /// What its file does not state and was assumed, in words.
    pub assumed: Option<String>,
    form: Form,
    effects: Vec<Active>,
}

/// What the effects of a vehicle say of its pitch sensor. They are linear: two readings tell all.
#[must_use]
pub fn pitch_sensor(effects: &[Active]) -> PitchSensor {
    let truth = |reading: f64| {
        let mut sensed = Sensed {
            time_s: 0.0,
            pitch_rad: reading,
            ballast_m3: 0.0,
            density_kg_m3: 1025.0,
            temperature_degc: 10.0,
            hull_degc: 10.0,
            pressure_pa: 0.0,
        };
        effects.iter().filter_map(|a| Some((a, a.effect.sensed?))).for_each(|(a, to_truth)| to_truth(&a.values, &mut sensed));
        sensed.pitch_rad
    };
    let (level, per_reading) = (truth(0.0), truth(1.0) - truth(0.0));
    PitchSensor { zero_rad: (-level / per_reading) as f32, per_reading: per_reading as f32 }
}

/// Reads a built-in geometry file.
///
/// # Errors
/// No such name.
pub fn built_in(name: &str) -> anyhow::Result<vehicle::file::VehicleFile> {
    let (_, text) = BUILT_IN_VEHICLES
        .iter()
        .find(|b| b.0 == name)
        .with_context(|| format!("no built-in vehicle `{name}`; there are {}", BUILT_IN_VEHICLES.map(|b| b.0).join(", ")))?;
    Ok(vehicle::file::parse(text, Path::new(&format!("vehicles/{name}.toml")))?)
}

/// The built-in vehicle of a name, with `.toml` or without, alone or in the folder `vehicles`.
fn built_in_text(path: &Path) -> Option<&'static str> {
    let folder = path.parent().is_none_or(|p| p.as_os_str().is_empty() || p == Path::new("vehicles"));
    let name = path.file_name()?.to_str()?;
    let name = name.strip_suffix(".toml").unwrap_or(name);
    BUILT_IN_VEHICLES.iter().find(|b| folder && b.0 == name).map(|b| b.1)
}

/// Whether this is no file but the name of a built-in vehicle.
#[must_use]
pub fn is_built_in(path: &Path) -> bool {
    !path.exists() && built_in_text(path).is_some()
}

/// Refuses what is neither a file nor a built-in vehicle.
///
/// # Errors
/// What was probably meant, and where vehicles come from.
pub fn is_there(path: &Path) -> anyhow::Result<()> {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
    ensure!(
        !Class::ALL.iter().any(|c| c.name() == name) || path.exists(),
        "{name} is a class, not a vehicle: glider import LOG --class {name} --out FOLDER makes a vehicle file of it"
    );
    if path.exists() || is_built_in(path) {
        return Ok(());
    }
    let names = BUILT_IN_VEHICLES.map(|b| b.0);
    // A name that ends as a file does is first compared with files.
    let [near_path, known] = [meant_path(path), meant(name, names)];
    let of_file = path.extension().is_some() || path.components().count() > 1;
    let [likelier, other] = if of_file { [near_path, known] } else { [known, near_path] };
    let tip = if likelier.is_empty() { other } else { likelier };
    bail!("{}: no such vehicle file{tip} (built in: {}; glider calibrate writes one)", path.display(), names.join(", "))
}

/// The text of a vehicle file; of a built-in vehicle where there is no such file and the name is one of [`BUILT_IN_VEHICLES`].
///
/// # Errors
/// No such file or name, or a file of another kind, with the fix.
pub fn text(path: &Path) -> anyhow::Result<String> {
    is_there(path)?;
    match built_in_text(path).filter(|_| is_built_in(path)) {
        Some(text) => Ok(text.to_owned()),
        None => {
            expect(path, Kind::Vehicle)?;
            Ok(vehicle::text::of_file(path)?)
        }
    }
}

/// Reads a vehicle as [`text`] finds it.
///
/// # Errors
/// As of [`text`]; what is wrong in it, where, and what to do.
pub fn read(path: &Path) -> anyhow::Result<Vehicle> {
    Ok(vehicle::parse_text(&text(path)?, path)?)
}

impl Model {
    /// From a file, or from a built-in vehicle as [`text`] finds it.
    ///
    /// # Errors
    /// Unreadable or wrong file, with line and fix.
    pub fn load(path: &Path, lift_model: Option<&str>) -> anyhow::Result<Self> {
        let text = text(path)?;
        let id = polar::crc32(text.as_bytes());
        if vehicle::file::is_geometry(&text) {
            let file = vehicle::file::parse(&text, path)?;
            let geometry = lift_model.map_or(Ok(file.geometry), |m| file.with_model(m))?;
            let wings = if file.wings == "standard" { Wings::Standard } else { Wings::LowAspectRatio };
            return Ok(Self::of_geometry(&file.name, wings, id, &geometry, &file.constants));
        }
        ensure!(lift_model.is_none(), "{}: a vehicle given by coefficients has no choice of lift model", path.display());
        Self::of_coefficients(&vehicle::parse_text(&text, path)?, id)
    }

    /// The built-in sea vehicle of a wing set.
    ///
    /// # Errors
    /// Never for the committed files.
    pub fn sea(wings: Wings) -> anyhow::Result<Self> {
        Self::load(Path::new(&format!("vehicles/{}.toml", sea_name(wings))), None)
    }

    /// From a geometry; `constants` carries what the geometry does not (mass and so on).
    #[must_use]
    pub fn of_geometry(name: &str, wings: Wings, id: u32, geometry: &Geometry, constants: &Constants) -> Self {
        let polar = geometry.polar();
        let (constants, _, _) = polar.project(constants);
        let form = Form::Geometry { polar: Box::new(polar), constants };
        Self { name: name.into(), wings, id, assumed: None, form, effects: Vec::new() }
    }

    /// From coefficients and the effects the file has on.
    ///
    /// # Errors
    /// The file does not say which wings it has.
    pub fn of_coefficients(v: &Vehicle, id: u32) -> anyhow::Result<Self> {
        let wings = match v.document.pointer("/wing/name").and_then(serde_json::Value::as_str) {
            Some("standard") => Wings::Standard,
            Some("low_ar" | "low-ar") => Wings::LowAspectRatio,
            other => bail!("{}: wing.name is {other:?}; expected \"standard\" or \"low_ar\"", v.path.display()),
        };
        let form = Form::Coefficients(v.constants);
        Ok(Self { name: v.name.clone(), wings, id, assumed: v.assumed_of_the_model(), form, effects: v.effects.clone() })
    }

    /// What its file says of the pitch sensor, as the controller is told it.
    #[must_use]
    pub fn pitch_sensor(&self) -> PitchSensor {
        pitch_sensor(&self.effects)
    }

    /// With these effects on top.
    #[must_use]
    pub fn with_effects(mut self, effects: &[Active]) -> Self {
        self.effects.extend_from_slice(effects);
        self
    }

    /// Its name with what its file does not state and was assumed, where there is any.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        self.assumed.as_ref().map(|assumed| format!("{}: {assumed}", self.name))
    }

    /// The effects it has on.
    #[must_use]
    pub fn effects(&self) -> &[Active] {
        &self.effects
    }

    /// Nominal constants (projected ones for a geometry), without effects.
    #[must_use]
    pub fn constants(&self) -> &Constants {
        match &self.form {
            Form::Geometry { constants, .. } | Form::Coefficients(constants) => constants,
        }
    }

    /// Parts of lift and drag, where the vehicle is geometry.
    #[must_use]
    pub fn geometry(&self) -> Option<&GeometryPolar> {
        match &self.form {
            Form::Geometry { polar, .. } => Some(polar),
            Form::Coefficients(_) => None,
        }
    }
}

impl Polar for Model {
    fn reference_area_m2(&self) -> f64 {
        self.constants().reference_area_m2
    }

    fn force(&self, flow: &Flow) -> LiftDrag {
        match &self.form {
            Form::Geometry { polar, .. } if self.effects.is_empty() => polar.force(flow),
            Form::Geometry { polar, constants } => {
                let without = ForceModel::new(*constants, &[]);
                Added { base: polar.as_ref(), with: ForceModel::new(*constants, &self.effects), without }.force(flow)
            }
            Form::Coefficients(constants) => ForceModel::new(*constants, &self.effects).coefficients(flow),
        }
    }

    fn alpha_valid_rad(&self) -> f64 {
        match &self.form {
            Form::Geometry { polar, .. } if self.effects.is_empty() => polar.alpha_valid_rad(),
            _ => hydro::effects::ALPHA_VALID_RAD,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hydro::effects::CATALOGUE;
    use hydro::glide::{self, Side, Trim};
    use serde_json::json;

    /// The measured steady glide of Slocum *Comet*, June 2016, median of 2,530 steady DVL samples.
    const COMET: Trim = Trim { pitch_rad: -21.9 * std::f64::consts::PI / 180.0, net_buoyancy_n: -2.12, rho_kg_m3: 1005.8 };

    #[test]
    fn validate_the_sea_vehicle_meets_the_measured_steady_glide() {
        let g = glide::steady(&Model::sea(Wings::Standard).unwrap(), &COMET).unwrap().lowest;
        println!(
            "U {:.4} m/s, path {:.2} deg, alpha {:.2} deg, L/D {:.3}",
            g.speed_m_s,
            g.gamma_rad.to_degrees(),
            g.alpha_rad.to_degrees(),
            g.l_over_d
        );
        assert!((g.speed_m_s - 0.307).abs() <= 0.01);
        assert!((g.gamma_rad.to_degrees() + 25.0).abs() <= 0.5);
        assert!((g.l_over_d - 2.14).abs() <= 0.05);
        assert_eq!(g.side, Side::Attached);
    }

    #[test]
    fn prop_glides_balance_climb_mirrors_dive_and_flat_pitch_has_none() {
        for (name, _) in BUILT_IN_VEHICLES {
            let m = Model::load(Path::new(name), None).unwrap();
            // 20 deg: flatter than about 16 deg the rail wings at sea have no glide.
            for deg in 20..45 {
                let trim = Trim { pitch_rad: -f64::from(deg).to_radians(), ..COMET };
                let Ok(g) = glide::steady(&m, &trim) else { panic!("{name} at {deg}: no glide") };
                let d = g.lowest;
                let q_s = 0.5 * trim.rho_kg_m3 * m.reference_area_m2() * d.speed_m_s.powi(2);
                // Newtons; the weight in water is 2 N.
                assert!((q_s * d.force.cl - 2.12 * d.gamma_rad.cos()).abs() < 1e-6, "{name} {deg}");
                assert!((q_s * d.force.cd - 2.12 * d.gamma_rad.sin().abs()).abs() < 1e-6, "{name} {deg}");
                let up = Trim { pitch_rad: -trim.pitch_rad, net_buoyancy_n: 2.12, ..trim };
                let c = glide::steady(&m, &up).unwrap().lowest;
                assert!((c.alpha_rad + d.alpha_rad).abs() < 1e-12 && (c.sink_m_s + d.sink_m_s).abs() < 1e-12 && c.sink_m_s < 0.0);
            }
            // The sea vehicles need a nose-down pitch; the low-drag vehicles of the paper glide level as well.
            if name.ends_with("sea") {
                let flat = Trim { pitch_rad: -2f64.to_radians(), ..COMET };
                let e = glide::steady(&m, &flat).expect_err("too flat");
                assert!(matches!(e, glide::GlideError::TooFlat { least_pitch_rad } if least_pitch_rad > 0.05), "{name}: {e:?}");
            }
        }
    }

    #[test]
    fn regress_what_a_file_does_not_state_of_the_model_is_noted() {
        let trial = json!({
            "format": "glider-trial/1", "mass_kg": 68.0, "hull_volume_m3": 0.0663, "hull_compressibility_per_pa": 5e-10,
            "hull_thermal_expansion_per_k": 5e-5, "wing": {"name": "standard", "aspect_ratio": 5.5, "area_m2": 0.09},
            "hydro": {"reference_area_m2": 0.1, "wing_lift_slope_per_rad": 3.3, "hull_lift_slope_per_rad": 1.2, "hull_area_m2": 0.04,
                "cd0": 0.15, "induced_k": 0.35},
        });
        let vehicle = vehicle::parse_text(&trial.to_string(), Path::new("v.json")).expect("a vehicle");
        let note = Model::of_coefficients(&vehicle, 0).expect("a model").note().expect("a note");
        assert!(note.contains("the vehicle file does not state") && note.contains("hydro.hull_drag_per_rad2 = 0"), "{note}");
        assert!(Model::load(Path::new("slocum-standard"), None).expect("built in").note().is_none());
    }

    #[test]
    fn the_stall_side_is_named() {
        // The paper's standard wing separates: near the least pitch there are two glides.
        let m = Model::load(Path::new("slocum-standard"), None).unwrap();
        let g = glide::steady(&m, &Trim { pitch_rad: -1f64.to_radians(), ..COMET }).unwrap();
        assert_eq!(g.lowest.side, Side::Attached);
        assert_eq!(g.others[0].map(|o| o.side), Some(Side::Stall));
        assert!(g.others[0].unwrap().alpha_rad > g.lowest.alpha_rad);
    }

    #[test]
    fn effects_that_are_off_change_nothing_and_on_ones_do() {
        for wings in [Wings::Standard, Wings::LowAspectRatio] {
            let plain = Model::sea(wings).unwrap();
            let off: Vec<Active> = CATALOGUE.iter().map(|e| Active::off(e)).collect();
            let with = Model::sea(wings).unwrap().with_effects(&off);
            let drag = Model::sea(wings).unwrap().with_effects(&[Active::sized(hydro::effects::by_name("drag_level_error").unwrap(), 0.2)]);
            for i in -34..=34 {
                let at = Flow::steady(f64::from(i) * 0.01, 0.3);
                let (a, b, c) = (plain.force(&at), with.force(&at), drag.force(&at));
                assert!((a.cl - b.cl).abs() < 1e-12 && (a.cd - b.cd).abs() < 1e-12);
                assert!((c.cd - a.cd - 0.2 * plain.constants().cd0).abs() < 1e-12);
            }
        }
    }
}
