//! Flight tables: sample a vehicle's polar, say how exact the table is, write
//! it as the Rust source the firmware is built from.
//!
//! The grid is uniform in α from 0 to the model's valid range; 50 points keep
//! L/D within 0.2 % of the f64 model (asserted when a table is built, printed
//! by `glider table`). A table is symmetric, a vehicle need not be: it gets the
//! mean of dive and climb ([`BothWays`]).

use std::fmt::Write as _;

use anyhow::{Context as _, ensure};
use hydro::{BothWays, Flow, Polar, glide};
use polar::{Sample, Spec, Table};
use signals::Wings;

/// Grid points of a table: 28 + 8·50 + 4 = 432 bytes.
pub const POINTS: usize = 50;

/// Largest L/D error against the f64 model over the valid range, fraction (design aim).
pub const L_OVER_D_BUDGET: f64 = 0.002;

/// Speed the table is made for where the polar depends on speed, m/s (Slocum cruising speed).
pub const TABLE_SPEED_M_S: f64 = 0.30;

impl Built {
    /// CRC-32 at the table's end: its identity.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.bytes.last_chunk().map_or(0, |b| u32::from_le_bytes(*b))
    }
}

/// Largest differences between a table and its model over the valid range.
#[derive(Clone, Copy, Debug)]
pub struct TableError {
    /// C_L, absolute.
    pub cl: f64,
    /// C_D, relative.
    pub cd: f64,
    /// L/D, relative to (L/D)max.
    pub l_over_d: f64,
    /// α of (L/D)max found in the table against the model's, rad.
    pub best_alpha_rad: f64,
    /// (L/D)max found in the table against the model's, relative.
    pub best_l_over_d: f64,
}

/// A finished table.
#[derive(Clone, Debug)]
pub struct Built {
    /// What the header says.
    pub spec: Spec,
    /// The table as stored and sent.
    pub bytes: Vec<u8>,
    /// How exact it is.
    pub error: TableError,
}

/// Samples a polar, in the mean of dive and climb, into a table.
///
/// # Errors
/// The polar has no best glide inside its range, or the table misses its budget.
pub fn build(model: &impl Polar, wings: Wings, vehicle_id: u32, fit_id: u32) -> anyhow::Result<Built> {
    let model = &BothWays(model);
    let range = model.alpha_valid_rad();
    let best = glide::best(model, TABLE_SPEED_M_S, range);
    if !(best.alpha_rad < 0.999 * range) {
        return Err(no_best_glide(model, range));
    }
    let spec = Spec {
        wings,
        vehicle_id,
        fit_id,
        area_m2: model.reference_area_m2() as f32,
        alpha_max_rad: range as f32,
        best_alpha_rad: best.alpha_rad as f32,
        best_l_over_d: best.l_over_d as f32,
    };
    let at = |alpha_rad: f64| model.force(&Flow::steady(alpha_rad, TABLE_SPEED_M_S));
    let samples: Vec<Sample> =
        (0..POINTS).map(|i| at(range * i as f64 / (POINTS - 1) as f64)).map(|f| Sample { cl: f.cl as f32, cd: f.cd as f32 }).collect();
    let bytes = polar::encode(&spec, &samples).map_err(|e| anyhow::anyhow!("the table would be refused on board: {e:?}"))?.to_vec();
    let table = Table::parse(&bytes, wings).map_err(|e| anyhow::anyhow!("{e:?}")).context("reading the table back")?;
    let error = compare(&table, model, &best);
    ensure!(
        error.l_over_d <= L_OVER_D_BUDGET,
        "L/D error of the table {:.3} % is above {:.1} %: the polar has a corner the grid cannot follow",
        100.0 * error.l_over_d,
        100.0 * L_OVER_D_BUDGET
    );
    Ok(Built { spec, bytes, error })
}

/// Which number stands against a table: drag grows too little with the angle of attack for L/D to fall inside the valid range.
fn no_best_glide(model: &impl Polar, range_rad: f64) -> anyhow::Error {
    let cd = |alpha_rad: f64| model.force(&Flow::steady(alpha_rad, TABLE_SPEED_M_S)).cd;
    let (zero, per_rad2) = (cd(0.0), (cd(range_rad) - cd(0.0)) / (range_rad * range_rad));
    let would_be = if per_rad2 > 0.0 { format!("at {:.0} deg", (zero / per_rad2).sqrt().to_degrees()) } else { "nowhere".into() };
    anyhow::anyhow!(
        "no best glide inside the valid range of {:.1} deg: with a drag of {zero:.3} + {per_rad2:.3} per rad2 it would be {would_be}, and L/D still rises at the end of the range; the drag per rad2 (hydro.hull_drag_per_rad2, log_HD_c of a Seaglider) is too small for this cd0, or was never measured at such angles",
        range_rad.to_degrees()
    )
}

/// Differences between a table and a polar on a grid of 8,000 angles, and at the best glide.
#[must_use]
pub fn compare(table: &Table<'_>, model: &impl Polar, best: &glide::Best) -> TableError {
    let mut e = TableError { cl: 0.0, cd: 0.0, l_over_d: 0.0, best_alpha_rad: 0.0, best_l_over_d: 0.0 };
    let mut top = (0.0, f64::NEG_INFINITY);
    // NaN stays: `max` of the standard library would drop it.
    let worst = |a: f64, b: f64| if b <= a { a } else { b };
    for i in 0..=8000 {
        let alpha = f64::from(table.alpha_max_rad()) * f64::from(i) / 8000.0;
        let t = table.at(alpha as f32);
        let (cl, cd) = (f64::from(t.cl), f64::from(t.cd));
        let m = model.force(&Flow::steady(alpha, TABLE_SPEED_M_S));
        e.cl = worst(e.cl, (cl - m.cl).abs());
        e.cd = worst(e.cd, (cd / m.cd - 1.0).abs());
        e.l_over_d = worst(e.l_over_d, (cl / cd - m.l_over_d()).abs() / best.l_over_d);
        if cl / cd > top.1 {
            top = (alpha, cl / cd);
        }
    }
    e.best_alpha_rad = (top.0 - best.alpha_rad).abs();
    e.best_l_over_d = (top.1 / best.l_over_d - 1.0).abs();
    e
}

/// Whether a file's bytes are a table that the controller takes for these wings.
///
/// # Errors
/// What is wrong with it, and the way out.
pub fn for_wings(bytes: &[u8], wings: Wings) -> anyhow::Result<()> {
    let why = match Table::parse(bytes, wings) {
        Ok(_) => return Ok(()),
        Err(polar::TableError::Length) => "is shorter or longer than it says: cut off, or no flight table",
        Err(polar::TableError::Format(_)) => "is no flight table, or one of another release",
        Err(polar::TableError::Crc) => "is damaged (its checksum is wrong)",
        Err(polar::TableError::Wings) => "is the table of the other wing set",
        Err(_) => "has values that no glider has",
    };
    anyhow::bail!("{why}; make a table with glider table --out FOLDER")
}

/// The table as Rust source for `firmware/polar/src/generated/`.
#[must_use]
pub fn rust_source(built: &Built, made_from: &str) -> String {
    let (name, wings) = match built.spec.wings {
        Wings::Standard => ("STANDARD", "standard"),
        Wings::LowAspectRatio => ("LOW_ASPECT_RATIO", "low-ar"),
    };
    let mut s = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(s, "//! Flight table of the {wings} wings. GENERATED, DO NOT EDIT: an edited byte fails the CRC and");
    let _ = writeln!(s, "//! the test that regenerates it. Change the vehicle file, then run:");
    let _ = writeln!(s, "//!     glider table --vehicle {made_from} --out firmware/polar/src/generated");
    let _ = writeln!(s, "//! Made from {made_from} (CRC-32 {:08x}), fit {:08x}.", built.spec.vehicle_id, built.spec.fit_id);
    let _ = writeln!(
        s,
        "//! {} points to {:.4} rad on {:.4} m2; (L/D)max {:.3} at {:.4} rad; L/D error {:.4} %.",
        POINTS,
        built.spec.alpha_max_rad,
        built.spec.area_m2,
        built.spec.best_l_over_d,
        built.spec.best_alpha_rad,
        100.0 * built.error.l_over_d
    );
    let _ = writeln!(s, "\n/// The table; layout in `polar::format`.");
    let _ = writeln!(s, "#[rustfmt::skip]\npub const {name}: &[u8] = &[");
    for line in built.bytes.chunks(16) {
        let row: Vec<String> = line.iter().map(|b| format!("0x{b:02x}")).collect();
        let _ = writeln!(s, "    {},", row.join(", "));
    }
    s.push_str("];\n");
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::vehicles::{Model, sea_name, wings_name};

    #[test]
    fn committed_tables_are_what_their_vehicle_files_give() {
        for wings in [Wings::Standard, Wings::LowAspectRatio] {
            let model = Model::sea(wings).unwrap();
            let built = build(&model, wings, model.id, 0).unwrap();
            println!("{}: {} bytes, {:?}", wings_name(wings), built.bytes.len(), built.error);
            let committed = polar::builtin(wings).unwrap();
            assert_eq!(committed.bytes(), &built.bytes[..], "run: glider table --out firmware/polar/src/generated");
            let file = format!("../../firmware/polar/src/generated/{}.rs", wings_name(wings).replace("low-ar", "low_aspect_ratio"));
            let source = std::fs::read_to_string(file).unwrap();
            assert_eq!(source, rust_source(&built, &format!("vehicles/{}.toml", sea_name(wings))));
        }
    }

    #[test]
    fn accuracy_tables_follow_every_built_in_vehicle() {
        for (name, _) in crate::flight::vehicles::BUILT_IN_VEHICLES {
            let model = Model::load(std::path::Path::new(name), None).unwrap();
            let e = build(&model, model.wings, 0, 0).unwrap().error;
            // Fractions of the f64 model over the whole valid range; the last is a grid search's half step, rad.
            assert!(e.l_over_d <= 0.002 && e.cd <= 0.002 && e.cl <= 0.002 && e.best_l_over_d <= 1e-3, "{name}: {e:?}");
            assert!(e.best_alpha_rad <= 0.002, "{name}: {e:?}");
        }
    }

    /// Once none for an angle of zero lift (lift at α = 0), and that of a vehicle that drags more in climbs was its dive's.
    #[test]
    fn regress_every_effect_that_may_be_added_can_be_flown() {
        for wings in [Wings::Standard, Wings::LowAspectRatio] {
            let constants = *Model::sea(wings).unwrap().constants();
            let without = build(&hydro::ForceModel::new(constants, &[]), wings, 0, 0).unwrap().spec.best_l_over_d;
            for effect in hydro::effects::CATALOGUE {
                let p = &effect.parameters[0];
                // A stall below 2.3 degrees is none: the law's rounded corner reaches to zero there, and no table is made of it.
                let low = if effect.name == "stall" { 0.04 } else { p.low };
                for size in [-1.5, -1.0, 1.0, 1.5].map(|times| (p.off + times * p.typical).clamp(low, p.high)) {
                    let active = [hydro::effects::Active::sized(effect, size)];
                    let built = build(&hydro::ForceModel::new(constants, &active), wings, 0, 0);
                    let name = format!("{wings:?}, {} {size} {}", effect.name, p.unit);
                    let best = built.unwrap_or_else(|e| panic!("{name}: {e:#}")).spec.best_l_over_d;
                    // Half the vehicle's added drag, as the table is of dive and climb.
                    if effect.name == "climb_drag" && size > 0.0 {
                        assert!(best < without, "{name}: {best} beside {without}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_polar_that_never_turns_over_gets_no_table() {
        let mut c = *Model::sea(Wings::Standard).unwrap().constants();
        c.hull_drag_per_rad2 = 0.0;
        let e = build(&hydro::ForceModel::new(c, &[]), Wings::Standard, 0, 0).unwrap_err();
        assert!(e.to_string().contains("still rises"), "{e}");
    }
}
