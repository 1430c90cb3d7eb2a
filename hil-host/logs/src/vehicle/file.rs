//! Reads a vehicle given by its geometry: a TOML file `glider-vehicle/1` in which every number has a unit, an uncertainty
//! and a source.
//!
//! ```toml
//! format = "glider-vehicle/1"
//! name = "slocum-standard"
//! wings = "standard"
//! [hull]
//! length_m = { value = 1.5, unit = "m", sigma = 0.05, source = "…" }
//! ```
//! Nothing is assumed: a missing key, an unknown key, a wrong unit, a missing source and a value outside its physical range
//! are errors that name file, line, key and what was expected. SI only.
//!
//! The file becomes a [`hydro::Geometry`]; [`VehicleFile::as_trial`] (file `as_trial`) writes it in the terms of the flight format, which is
//! how `compare`, `diagnose` and `add` take it.

use std::path::{Path, PathBuf};

use hydro::body::Body;
use hydro::drag::{DragRule, Layer};
use hydro::effects::Beyond;
use hydro::interference::CarryOver;
use hydro::rectangular::SideEdge;
use hydro::wing::{Separation, SlopeLaw, Wing, WingModel};
use hydro::{Appendage, Constants, Geometry};

use crate::record::csv::ReadError;
use crate::vehicle::quantities::Document;
pub use crate::vehicle::quantities::Quantity;

/// What `format` must say.
pub const FORMAT: &str = "glider-vehicle/1";

/// A vehicle file.
#[derive(Clone, Debug)]
pub struct VehicleFile {
    /// Where it was read from.
    pub path: PathBuf,
    /// Name.
    pub name: String,
    /// `standard` or `low-ar`.
    pub wings: String,
    /// What the file is for, in words.
    pub about: String,
    /// Geometry; the wing has the model the file asks for.
    pub geometry: Geometry,
    /// Every lift model the file has constants for.
    pub models: Vec<WingModel>,
    /// Mass, volume, added masses; coefficients projected from the geometry.
    pub constants: Constants,
    /// Every number with unit, uncertainty and source, in file order.
    pub quantities: Vec<Quantity>,
}

const LAYERS: [(&str, Layer); 2] = [("laminar", Layer::Laminar), ("turbulent", Layer::Turbulent)];

/// Whether a text says it is a file of this format (cheap: looks at the `format` line only).
#[must_use]
pub fn is_geometry(text: &str) -> bool {
    text.lines().any(|l| l.trim_start().starts_with("format") && l.contains(FORMAT))
}

/// Reads a vehicle file.
///
/// # Errors
/// What is wrong, where, and what was expected.
pub fn read(path: &Path) -> Result<VehicleFile, ReadError> {
    parse(&crate::vehicle::text::of_file(path)?, path)
}

/// Reads a vehicle file from its text; `path` is only for messages.
///
/// # Errors
/// What is wrong, where, and what was expected.
pub fn parse(text: &str, path: &Path) -> Result<VehicleFile, ReadError> {
    let mut d = Document::parse(text, path)?;
    let mut file = build(&mut d, path).map_err(|e| d.misspelt(e))?;
    file.quantities = d.finish()?;
    Ok(file)
}

fn build(d: &mut Document, path: &Path) -> Result<VehicleFile, ReadError> {
    d.choice("format", &[(FORMAT, ())])?;
    let name = d.text("name")?.1;
    let about = d.text("about")?.1;
    let wings = d.choice("wings", &[("standard", "standard"), ("low-ar", "low-ar")])?;
    let body = body(d)?;
    let models = wing_models(d)?;
    let wing = wing(d, &models)?;
    let carry_over = carry_over(d)?;
    check_areas(d, &wing)?;
    let appendage = appendage(d)?;
    let geometry = Geometry { reference_area_m2: d.number("reference.area_m2", "m2", 1e-3, 10.0)?, body, wing, carry_over, appendage };
    let unprojected = unprojected(d, geometry.reference_area_m2)?;
    let (constants, _, _) = geometry.polar().project(&unprojected);
    Ok(VehicleFile { path: path.to_path_buf(), name, wings: wings.into(), about, geometry, models, constants, quantities: Vec::new() })
}

fn body(d: &mut Document) -> Result<Body, ReadError> {
    Ok(Body {
        length_m: d.number("hull.length_m", "m", 0.3, 5.0)?,
        diameter_m: d.number("hull.diameter_m", "m", 0.05, 1.0)?,
        wetted_area_m2: d.number("hull.wetted_area_m2", "m2", 0.05, 10.0)?,
        planform_area_m2: d.number("hull.planform_area_m2", "m2", 0.01, 5.0)?,
        potential_area_m2: d.number("hull.potential_area_m2", "m2", 0.0, 1.0)?,
        munk_factor: d.number("hull.munk_factor", "1", 0.0, 1.0)?,
        crossflow_eta: d.number("hull.crossflow_eta", "1", 0.3, 1.0)?,
        crossflow_cd: d.number("hull.crossflow_cd", "1", 0.2, 3.0)?,
        layer: d.choice("hull.layer", &LAYERS)?,
        reynolds: d.number("hull.reynolds", "1", 1e3, 1e8)?,
    })
}

/// Every lift model that the file has constants for.
fn wing_models(d: &mut Document) -> Result<Vec<WingModel>, ReadError> {
    let mut models = Vec::new();
    if d.has("wing.lifting_line.") {
        models.push(WingModel::LiftingLine(Separation {
            alpha_rad: d.number("wing.lifting_line.separation_rad", "rad", 0.02, 0.8)?,
            width_rad: d.number("wing.lifting_line.separation_width_rad", "rad", 0.005, 0.3)?,
            broadside_cn: d.number("wing.lifting_line.broadside_cn", "1", 0.3, 2.5)?,
        }));
    }
    if d.has("wing.polhamus_lamar.") {
        models.push(WingModel::PolhamusLamar { kv: d.number("wing.polhamus_lamar.vortex_kv", "1", 0.0, 10.0)? });
    }
    if d.has("wing.bartlett_vidal.") {
        models.push(WingModel::BartlettVidal { crossflow_cd: d.number("wing.bartlett_vidal.crossflow_cd", "1/rad2", 0.0, 10.0)? });
    }
    if d.has("wing.fidler.") {
        models.push(WingModel::Fidler { a2_per_rad2: d.number("wing.fidler.a2_per_rad2", "1/rad2", 0.0, 10.0)? });
    }
    if d.has("wing.side_edge.") {
        models.push(WingModel::SideEdge(SideEdge {
            kv: d.number("wing.side_edge.vortex_kv", "1", 0.0, 10.0)?,
            onset_rad: d.number("wing.side_edge.onset_rad", "rad", 0.0, 0.8)?,
            onset_width_rad: d.number("wing.side_edge.onset_width_rad", "rad", 0.005, 0.3)?,
            separation: Separation {
                alpha_rad: d.number("wing.side_edge.separation_rad", "rad", 0.1, 1.4)?,
                width_rad: d.number("wing.side_edge.separation_width_rad", "rad", 0.005, 0.3)?,
                broadside_cn: d.number("wing.side_edge.broadside_cn", "1", 0.3, 2.5)?,
            },
        }));
    }
    Ok(models)
}

fn wing(d: &mut Document, models: &[WingModel]) -> Result<Wing, ReadError> {
    let (line, wanted) = d.text("wing.model")?;
    let names: Vec<&str> = models.iter().map(WingModel::name).collect();
    let model = models
        .iter()
        .copied()
        .find(|m| m.name() == wanted)
        .ok_or_else(|| d.bad(line, "wing.model", format!("is `{wanted}`, but the file has constants for: {}", names.join(", "))))?;
    Ok(Wing {
        aspect_ratio: d.number("wing.aspect_ratio", "1", 0.05, 40.0)?,
        panel_span_m: d.number("wing.panel_span_m", "m", 0.01, 5.0)?,
        chord_m: d.number("wing.chord_m", "m", 0.01, 3.0)?,
        area_m2: d.number("wing.area_m2", "m2", 1e-3, 5.0)?,
        sweep_half_chord_rad: d.number("wing.sweep_half_chord_rad", "rad", -1.2, 1.2)?,
        section_slope_per_rad: d.number("wing.section_slope_per_rad", "1/rad", 2.0, 8.0)?,
        slope_law: d.choice(
            "wing.slope_law",
            &[
                ("prandtl", SlopeLaw::Prandtl),
                ("lowry-polhamus", SlopeLaw::LowryPolhamus),
                ("roskam", SlopeLaw::Roskam),
                ("hoerner-borst", SlopeLaw::HoernerBorst),
            ],
        )?,
        model,
        oswald_e: d.number("wing.oswald_e", "1", 0.2, 1.2)?,
        drag_rule: d.choice(
            "wing.drag_rule",
            &[("parabolic", DragRule::Parabolic), ("bounded", DragRule::Bounded), ("zero-suction", DragRule::ZeroSuction)],
        )?,
        layer: d.choice("wing.layer", &LAYERS)?,
        reynolds: d.number("wing.reynolds", "1", 1e3, 1e8)?,
        form_factor: d.number("wing.form_factor", "1", 0.5, 3.0)?,
    })
}

fn carry_over(d: &mut Document) -> Result<CarryOver, ReadError> {
    let carry_over = CarryOver {
        share: d.number("interference.share", "1", 0.0, 1.5)?,
        body_radius_m: d.number("interference.body_radius_m", "m", 0.0, 1.0)?,
        semispan_m: d.number("interference.semispan_m", "m", 0.02, 5.0)?,
    };
    if carry_over.semispan_m <= carry_over.body_radius_m {
        let line = d.line("interference.semispan_m");
        return Err(d.bad(line, "interference.semispan_m", "is inside the hull; it is measured from the axis to the tip".into()));
    }
    Ok(carry_over)
}

/// The wing's area must be that of its panels.
fn check_areas(d: &Document, wing: &Wing) -> Result<(), ReadError> {
    let ratio = wing.area_m2 / (2.0 * wing.panel_span_m * wing.chord_m);
    if !(0.5..=1.5).contains(&ratio) {
        let line = d.line("wing.area_m2");
        return Err(d.bad(
            line,
            "wing.area_m2",
            format!("is {ratio:.2} times 2 · panel_span · chord; expected both panels' exposed area, within a factor 0.5 to 1.5"),
        ));
    }
    Ok(())
}

fn appendage(d: &mut Document) -> Result<Appendage, ReadError> {
    Ok(Appendage {
        drag_area_m2: d.number("appendage.drag_area_m2", "m2", 0.0, 1.0)?,
        crossflow_drag_area_m2: d.number("appendage.crossflow_drag_area_m2", "m2", 0.0, 10.0)?,
        normal_area_per_rad_m2: d.number("appendage.normal_area_per_rad_m2", "m2/rad", 0.0, 5.0)?,
    })
}

/// Constants before the coefficients are projected from the geometry.
fn unprojected(d: &mut Document, reference_area_m2: f64) -> Result<Constants, ReadError> {
    Ok(Constants {
        gravity_m_s2: d.number("vehicle.gravity_m_s2", "m/s2", 9.7, 9.9)?,
        mass_kg: d.number("vehicle.mass_kg", "kg", 1.0, 5000.0)?,
        hull_volume_m3: d.number("vehicle.hull_volume_m3", "m3", 1e-3, 5.0)?,
        compressibility_per_pa: d.number("vehicle.hull_compressibility_per_pa", "1/Pa", 0.0, 1e-8)?,
        thermal_expansion_per_k: d.number("vehicle.hull_thermal_expansion_per_k", "1/K", -1e-3, 1e-3)?,
        reference_temperature_degc: d.number("vehicle.reference_temperature_degc", "degC", -5.0, 40.0)?,
        added_mass_surge: d.number("vehicle.added_mass_surge", "1", 0.0, 3.0)?,
        added_mass_heave: d.number("vehicle.added_mass_heave", "1", 0.0, 5.0)?,
        bank_tilt: 0.0,
        banked_turn: 0.0,
        hull_lag_share: 0.0,
        beyond: Beyond::default(),
        reference_area_m2,
        lift_slope_per_rad: 0.0,
        lift_quadratic_per_rad2: 0.0,
        cd0: 0.0,
        induced_k: 0.0,
        hull_drag_per_rad2: 0.0,
        slope_loss_per_rad2: 0.0,
        hull_drag_per_rad3: 0.0,
    })
}

impl VehicleFile {
    /// The geometry with another of the file's lift models.
    ///
    /// # Errors
    /// The file has no constants for that model; names those it has.
    pub fn with_model(&self, name: &str) -> Result<Geometry, ReadError> {
        let model = self.models.iter().copied().find(|m| m.name() == name).ok_or_else(|| {
            let names: Vec<&str> = self.models.iter().map(WingModel::name).collect();
            ReadError::Content {
                path: self.path.clone(),
                line: 0,
                column: format!("model `{name}`"),
                why: format!("the file has constants for: {}", names.join(", ")),
            }
        })?;
        Ok(Geometry { wing: Wing { model, ..self.geometry.wing }, ..self.geometry })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STANDARD: &str = include_str!("../../../../vehicles/slocum-standard.toml");
    const RAILS: &str = include_str!("../../../../vehicles/slocum-low-ar-sea.toml");

    fn refused(text: &str) -> String {
        parse(text, Path::new("v.toml")).expect_err("refused").to_string()
    }

    #[test]
    fn files_in_the_project_read_and_every_number_says_where_it_is_from() {
        for text in [STANDARD, RAILS] {
            let v = parse(text, Path::new("v.toml")).expect("reads");
            assert!(v.quantities.len() > 30);
            assert!(v.quantities.iter().all(|q| q.line > 0 && !q.source.is_empty() && q.sigma >= 0.0));
            assert!(v.constants.lift_slope_per_rad > 0.0 && v.constants.cd0 > 0.0);
        }
    }

    #[test]
    fn errors_name_file_line_key_and_what_was_expected() {
        let line = |needle: &str| 1 + STANDARD.lines().position(|l| l.starts_with(needle)).expect("key is in the file");
        let cases = [
            ("value = 1.5, unit = \"m\"", "value = 15.0, unit = \"m\"", "physical is 0.3 to 5", line("length_m")),
            ("value = 1.5, unit = \"m\"", "value = 1.5, unit = \"cm\"", "files are SI", line("length_m")),
            ("value = 1.5, unit = \"m\"", "value = nan, unit = \"m\"", "finite", line("length_m")),
            ("length_m = {", "lenght_m = {", "did you mean `hull.length_m`", line("length_m")),
            ("model = \"lifting-line\"", "model = \"fidler\"", "constants for: lifting-line", line("model")),
            ("layer = \"laminar\" #", "layer = \"foamy\" #", "laminar, turbulent", line("layer")),
            ("sigma = 0.05, source = \"BCO", "sigma = -0.05, source = \"BCO", "0 or more", line("length_m")),
            ("source = \"BCO-DMO instrument page, Slocum G1/G2: 1.5 m without boom\"", "source = \" \"", "guess", line("length_m")),
            ("sigma = 0.05, source = \"BCO", "source = \"BCO", "missing field `sigma`", line("length_m")),
        ];
        for (from, to, want, at) in cases {
            assert!(STANDARD.contains(from), "{from}");
            let e = refused(&STANDARD.replacen(from, to, 1));
            assert!(e.contains("v.toml") && e.contains(want) && e.contains(&format!("line {at},")), "{to}: {e}");
        }
        let e = refused(&STANDARD.replace("munk_factor =", "# munk_factor ="));
        assert!(e.contains("hull.munk_factor") && e.contains("missing"), "{e}");
        let e = refused(&format!("{STANDARD}\n[engine]\npower_w = {{ value = 1.0, unit = \"W\", sigma = 0.0, source = \"x\" }}\n"));
        assert!(e.contains("engine.power_w") && e.contains("unknown key"), "{e}");
        let e = refused(&STANDARD.replace("mass_kg = {", "mass_kg = 52.0 #"));
        assert!(e.contains("bare number"), "{e}");
        let e = refused("format = \"glider-vehicle/1\"\nname = ");
        assert!(e.contains("line 2"), "{e}");
    }

    #[test]
    fn another_lift_model_is_there_only_with_its_constants() {
        let v = parse(RAILS, Path::new("v.toml")).expect("reads");
        for name in ["polhamus-lamar", "bartlett-vidal", "fidler", "side-edge"] {
            assert_eq!(v.with_model(name).expect("has it").wing.model.name(), name);
        }
        assert!(v.with_model("lifting-line").expect_err("has none").to_string().contains("fidler"));
    }

    #[test]
    fn the_flight_format_gives_back_the_projected_coefficients() {
        for text in [STANDARD, RAILS] {
            let v = parse(text, Path::new("v.toml")).expect("reads");
            let back = crate::vehicle::parse(v.as_trial(), Path::new("v.toml")).expect("reads");
            let (a, b) = (back.constants, v.constants);
            assert!((a.lift_slope_per_rad / b.lift_slope_per_rad - 1.0).abs() < 1e-9);
            assert_eq!((a.cd0, a.lift_quadratic_per_rad2, a.hull_drag_per_rad2), (b.cd0, b.lift_quadratic_per_rad2, b.hull_drag_per_rad2));
        }
    }
}
