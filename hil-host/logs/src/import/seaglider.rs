//! Dives of a Seaglider, one NetCDF of its base station each: one flight, and the vehicle from the constants in the files.
//!
//! Volume at a reading v of the buoyancy device (cm³; C_VBD, VBD_MIN counts, VBD_CNV cm³ a count, negative)
//! ```text
//! V = volmax + (C_VBD − VBD_MIN)·VBD_CNV + v − vbdbias,   times exp(−abs_compress·p + therm_expan·(T − temp_ref))
//! L = q l² a α,   D = q l² (b q^s + c α²),   q = ½ ρ U², α in degrees,   a, b, c, s = hd_a, hd_b, hd_c, hd_s
//! ```
//! Brought to the reference area of the classes, 0.1 m²; b q^s becomes CD0 at 0.30 m/s with the effect `reynolds_drag`.
//! The units that the files state for volmax, abs_compress and therm_expan are wrong; sizes tell.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::classes::{Class, REFERENCE_AREA_M2};
use super::draft::Draft;
use super::netcdf::{self, Scalars};
use super::reader::Reader;
use super::{FileNote, ImportError, Imported, Report, join};

/// One NetCDF of the base station a dive.
pub(super) const SEAGLIDER_DIVES: Reader = Reader {
    name: "Seaglider dives",
    claims: |path| dive_of(path).is_some(),
    a_dive_a_file: true,
    import: |files, _| import(files),
    ..Reader::PLAIN
};

/// Glider and dive of a name `pGGGDDDD.nc`, also with what archives and browsers append (`pGGGDDDD_YYYYMMDD.nc`, `pGGGDDDD (1).nc`).
#[must_use]
pub fn dive_of(path: &Path) -> Option<(u32, u32)> {
    let name = path.file_name()?.to_str()?.to_ascii_lowercase();
    let (digits, appended) = name.strip_prefix('p')?.strip_suffix(".nc")?.split_at_checked(7)?;
    let numbers = digits.bytes().all(|b| b.is_ascii_digit()) && (appended.is_empty() || appended.starts_with(['_', '-', ' ', '.', '(']));
    numbers.then(|| Some((digits[..3].parse().ok()?, digits[3..].parse().ok()?))).flatten()
}

/// Files by glider and dive.
type Dives<'a> = BTreeMap<(u32, u32), &'a PathBuf>;

/// The file of each dive; of several of one dive the largest, and what is said of the others.
fn dives(files: &[PathBuf]) -> (Dives<'_>, Vec<(String, String)>) {
    let (mut out, mut others) = (BTreeMap::new(), Vec::new());
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut known: Vec<((u32, u32), u64, &PathBuf)> =
        files.iter().filter_map(|f| Some((dive_of(f)?, std::fs::metadata(f).map_or(0, |m| m.len()), f))).collect();
    known.sort_by_key(|(dive, bytes, path)| (*dive, std::cmp::Reverse(*bytes), *path));
    for (dive, _, path) in known {
        match out.get(&dive) {
            None => drop(out.insert(dive, path)),
            Some(held) => others.push((name(path), format!("is of dive {} as {} is, which is read", dive.1, name(held)))),
        }
    }
    (out, others)
}

/// Imports the dives of one glider as one flight.
///
/// # Errors
/// Dives of two gliders; nothing usable.
pub fn import(files: &[PathBuf]) -> Result<Imported, ImportError> {
    let (dives, others) = dives(files);
    let gliders: std::collections::BTreeSet<u32> = dives.keys().map(|k| k.0).collect();
    let folder = files.first().and_then(|f| f.parent()).unwrap_or(Path::new("."));
    if gliders.len() > 1 {
        let list: Vec<String> = gliders.iter().map(|g| format!("SG{g:03}")).collect();
        return Err(ImportError::new(folder, format!("dives of {} gliders ({}): import one at a time", list.len(), list.join(", "))));
    }
    let (mut parts, mut constants, mut refused, mut speeds) = (Vec::new(), Vec::new(), others, 0);
    for ((_, dive), path) in &dives {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let scalars = netcdf::scalars(path);
        if scalars.has("skipped_profile") {
            refused.push((name, "its profile was skipped by the base station".to_owned()));
            continue;
        }
        match netcdf::import(path) {
            Ok(mut part) => {
                part.report.segments = part.report.segments.iter().map(|_| format!("dive {dive}")).collect();
                // A dive is one segment, however long it is silent.
                part.flight.segment.fill(0);
                part.report.segments.truncate(1);
                part.report.files.iter_mut().for_each(|f| f.file.clone_from(&name));
                constants.push((*dive, scalars));
                speeds += netcdf::speed_witness(path, &mut part);
                parts.push((name, part));
            }
            Err(e) => refused.push((name, e.what)),
        }
    }
    same_middle(&mut parts, &constants);
    let begins: Vec<(u32, f64)> =
        parts.iter().zip(&constants).map(|((_, p), c)| (c.0, p.report.start_unix_s.unwrap_or(f64::NAN))).collect();
    let Some(mut imported) = join::join("Seaglider base station, one NetCDF a dive", parts) else {
        let why: Vec<String> = refused.iter().map(|(f, w)| format!("{f} {w}")).collect();
        return Err(ImportError::new(folder, format!("no dive can be used: {}", why.join("; "))));
    };
    for (file, what) in refused {
        imported.report.leave_out(format!("{file}: {what}"));
        imported.report.files.push(FileNote { file, rows: 0, problems: vec![what] });
    }
    join::numbered("dive", &begins, &mut imported.report);
    let glider = gliders.first().copied().unwrap_or_default();
    let (first, last) = (constants.first().map_or(0, |c| c.0), constants.last().map_or(0, |c| c.0));
    imported.flight.name = format!("sg{glider:03}-dives-{first}-{last}");
    if speeds > 0 {
        imported.report.note(format!("{speeds} values of speed through the water from the current profiler's inverse solution"));
    }
    imported.vehicle = Some(vehicle(glider, &constants, &mut imported.report));
    Ok(imported)
}

/// The middle of the buoyancy device may be set anew from dive to dive: readings of all are brought to that of the dive whose constants
/// make the vehicle, whatever other dives there are.
fn same_middle(parts: &mut [(String, Imported)], constants: &[(u32, Scalars)]) {
    let Some((_, of)) = newest(constants).filter(|(_, s)| s.get("log_C_VBD").is_some()) else { return };
    for ((_, part), (_, scalars)) in parts.iter_mut().zip(constants) {
        if let Some(off_cc) = middle_off_cc(|n| scalars.get(n), |n| of.get(n)) {
            from_middle(part, off_cc);
        }
    }
}

/// By how much readings of a dive are to be raised to count from the middle of the buoyancy device in another one, cm³; `log` and
/// `other` are the numbers of their logs.
pub(super) fn middle_off_cc(log: impl Fn(&str) -> Option<f64>, other: impl Fn(&str) -> Option<f64>) -> Option<f64> {
    Some((log("log_C_VBD")? - other("log_C_VBD")?) * log("log_VBD_CNV")?)
}

/// Raises a dive's readings, cm³, and says so.
pub(super) fn from_middle(part: &mut Imported, off_cc: f64) {
    if off_cc != 0.0 {
        part.flight.ballast_m3.iter_mut().for_each(|v| *v += off_cc * 1e-6);
        part.report.note(format!("C_VBD is another than in the newest dive: readings brought to that one's middle ({off_cc:+.1} cc)"));
    }
}

/// The dive whose constants were changed last: fitted ashore again and again, the newest stand.
fn newest(constants: &[(u32, Scalars)]) -> Option<&(u32, Scalars)> {
    constants.iter().max_by(|a, b| a.1.modified.cmp(&b.1.modified).then(a.0.cmp(&b.0)))
}

/// Compressibility that a hull can have: the documented default with three of its sigmas, 1/dbar.
const HULL_PER_DBAR: std::ops::Range<f64> = 2.2e-6..6.0e-6;

/// The vehicle that the newest constants describe; what they say differently from dive to dive is noted.
fn vehicle(glider: u32, constants: &[(u32, Scalars)], report: &mut Report) -> Draft {
    let mut draft = Class::Seaglider.draft();
    let Some((dive, newest)) = newest(constants) else { return draft };
    draft.about = vec![
        format!("Seaglider SG{glider:03}: constants of the base station in the file of dive {dive}, the newest."),
        "They were fitted with a density that ignores pressure: a start, not a calibrated model.".into(),
    ];
    draft.say("case", &format!("sg{glider:03}"), "");
    for name in ["sg_cal_volmax", "sg_cal_vbdbias", "sg_cal_hd_a", "sg_cal_hd_b", "sg_cal_hd_c", "sg_cal_abs_compress", "sg_cal_mass"] {
        let values: Vec<f64> = constants.iter().filter_map(|(_, s)| s.get(name)).collect();
        let (low, high) = (values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(0.0, f64::max));
        if high > low && low.is_finite() {
            report.note(format!("{name} is {low} to {high} in these files: {} of the newest is taken", newest.get(name).unwrap_or(high)));
        }
    }
    from_constants(&mut draft, newest, report);
    draft
}

/// What the constants of one dive, or a `sg_calib_constants.m`, say of the vehicle.
pub(super) fn from_constants(draft: &mut Draft, s: &Scalars, report: &mut Report) {
    let cal = |name: &str| s.get(&format!("sg_cal_{name}"));
    let log = |name: &str| s.get(&format!("log_{name}"));
    let deep = log("DEEPGLIDER") == Some(1.0);
    // No glider weighs a ton: such a number is in g, as the log's is.
    let in_kg = |mass: f64| if mass > 1000.0 { mass * 1e-3 } else { mass };
    let weighed = |mass: Option<f64>| mass.filter(|m| *m > 0.0);
    if let Some(mass) = weighed(cal("mass")).map(in_kg).or_else(|| weighed(log("MASS")).map(|g| g * 1e-3)) {
        draft.set("mass_kg", mass, if weighed(cal("mass")).is_some() { "sg_cal_mass" } else { "log_MASS" });
    }
    volume(draft, s, report);
    if let Some(cc) = log("VBD_CNV").filter(|cc| *cc > 0.0) {
        report.note(format!("VBD_CNV is {cc} cm3 a count: in every Seaglider more counts are less oil; is its sign lost?"));
    }
    if let Some(temperature) = cal("temp_ref") {
        draft.set("reference_temperature_degc", temperature, "sg_cal_temp_ref");
    }
    if let Some(expansion) = cal("therm_expan") {
        draft.set("hull_thermal_expansion_per_k", expansion, "sg_cal_therm_expan, 1/K");
    }
    if deep {
        draft.set("hull_compressibility_per_pa", 2.1e-10, "documented default of the DeepGlider");
        draft.set("hull_thermal_expansion_per_k", cal("therm_expan").unwrap_or(6.2e-5), "sg_cal_therm_expan or the DeepGlider's default");
    }
    // A fit against a density that ignores pressure takes the water's compressibility off the hull's.
    let stated = cal("abs_compress");
    let believable = stated.is_none_or(|c| deep || HULL_PER_DBAR.contains(&c));
    match stated {
        Some(c) if believable => draft.set("hull_compressibility_per_pa", c * 1e-4, "sg_cal_abs_compress, 1/dbar"),
        Some(c) => report.note(format!(
            "sg_cal_abs_compress = {c:e} /dbar is no hull's: it was fitted with a density that ignores pressure; the class's {:e} /Pa is taken",
            draft.get("hull_compressibility_per_pa").unwrap_or(f64::NAN)
        )),
        None => {}
    }
    let fitted = Hydro::of(|n| cal(n));
    let on_board = Hydro::of(|n| log(&n.to_ascii_uppercase()));
    // The set that was fitted together with such a compressibility has the same error in it.
    let named = |set: Option<Hydro>, name: &'static str| set.map(|h| (h, name));
    let (ashore, aboard) = (named(fitted, "sg_cal_hd"), named(on_board, "log_HD"));
    let state = |set: Hydro, draft: &mut Draft, name: &str| set.state(draft, name, cal("rho0"), cal("glider_length"), cal("hd_s"));
    let (first, second) = if believable { (ashore, aboard) } else { (aboard, ashore) };
    if let (Some((taken, name)), Some((passed, passed_name))) = (first, second) {
        let mut other = draft.clone();
        state(passed, &mut other, passed_name);
        state(taken, draft, name);
        draft.other = Some((Box::new(other), [name, passed_name]));
        report.note(format!("two sets of lift and drag are in the files: {name} ({taken}), {passed_name} ({passed})"));
        draft.about.push(format!("Lift and drag in the files: {name} ({taken}), {passed_name} ({passed})."));
    } else if let Some((set, name)) = first.or(second) {
        state(set, draft, name);
    }
    if let Some(mass) = cal("mass_comp").filter(|m| *m > 0.0) {
        report.note(format!("a compressee of {mass} kg is on board: its volume is not modelled"));
    }
}

/// Hull volume at reading 0.
fn volume(draft: &mut Draft, s: &Scalars, report: &mut Report) {
    let cal = |name: &str| s.get(&format!("sg_cal_{name}"));
    let log = |name: &str| s.get(&format!("log_{name}"));
    let (Some(c), Some(least), Some(cc)) = (log("C_VBD"), log("VBD_MIN"), log("VBD_CNV")) else { return };
    let middle_cc = (c - least) * cc;
    // By its size it is in cm3, litres or m3.
    let in_cc = |v: f64| match v {
        v if v > 1000.0 => v,
        v if v > 5.0 => v * 1e3,
        v => v * 1e6,
    };
    let stated = cal("volmax").map(|v| (in_cc(v), "volmax + (C_VBD - VBD_MIN) VBD_CNV"));
    // RHO in g/cm3, MASS in g.
    let from_log = || Some((log("MASS")? / log("RHO")? - middle_cc, "MASS / RHO"));
    let Some((volmax, name)) = stated.or_else(from_log) else { return };
    let hull_cc = volmax + middle_cc - cal("vbdbias").unwrap_or(0.0);
    let floats = draft.get("mass_kg").map_or(f64::NAN, |kg| kg / hull_cc * 1e6);
    if (900.0..1200.0).contains(&floats) {
        draft.set("hull_volume_m3", hull_cc * 1e-6, &format!("{name} - vbdbias"));
    } else {
        let what = format!("{name} - vbdbias = {hull_cc:.0} cm3");
        report.leave_out(format!("{what} is no volume of this glider: it would float at {floats:.0} kg/m3"));
    }
}

/// Lift and drag in the Seaglider's form.
#[derive(Clone, Copy)]
struct Hydro {
    a: f64,
    b: f64,
    c: f64,
}

impl std::fmt::Display for Hydro {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a {}, b {}, c {}", self.a, self.b, self.c)
    }
}

impl Hydro {
    fn of(get: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        Some(Self { a: get("hd_a")?, b: get("hd_b")?, c: get("hd_c")? }).filter(|h| h.a > 0.0 && h.b > 0.0 && h.c >= 0.0)
    }

    fn state(self, draft: &mut Draft, name: &str, rho0: Option<f64>, length_m: Option<f64>, exponent: Option<f64>) {
        let degrees = 180.0 / std::f64::consts::PI;
        let (rho0, length_m, exponent) = (rho0.unwrap_or(1027.5), length_m.unwrap_or(1.8), exponent.unwrap_or(-0.25));
        // rho0 comes in kg/m3, or in g/m3 as the log writes it.
        let rho0 = if rho0 > 1e5 { rho0 * 1e-3 } else { rho0 };
        // Or in g/cm3, as the log's RHO is.
        let rho0 = if (0.9..1.1).contains(&rho0) { rho0 * 1e3 } else { rho0 };
        let areas = length_m * length_m / REFERENCE_AREA_M2;
        draft.set("hydro.hull_lift_slope_per_rad", self.a * degrees * areas, &format!("{name}_a = {}", self.a));
        let dynamic_pa = 0.5 * rho0 * 0.3 * 0.3;
        draft.set("hydro.cd0", self.b * dynamic_pa.powf(exponent) * areas, &format!("{name}_b = {}, at 0.30 m/s", self.b));
        draft.set("hydro.hull_drag_per_rad2", self.c * degrees * degrees * areas, &format!("{name}_c = {}", self.c));
        draft.set("effects.reynolds_drag.exponent", -2.0 * exponent, "-2 hd_s");
        draft.set("tolerance_1sigma.cd0_relative", 0.25, "guess; the two sets of a glider differ by more");
        draft.set("tolerance_1sigma.lift_slope_relative", 0.2, "fits of one vehicle within two weeks scatter by 17 %");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_names_of_dives_from_archives_and_browsers() {
        for name in ["p1710104.nc", "P1710104.NC", "p1710104_20131023.nc", "p1710104 (1).nc"] {
            assert_eq!(dive_of(Path::new(name)), Some((171, 104)), "{name}");
        }
        for name in ["p171010.nc", "p17101041.nc", "p1710104b.nc", "p1710104.txt", "q1710104.nc", "p171010\u{e9}.nc"] {
            assert_eq!(dive_of(Path::new(name)), None, "{name}");
        }
        let files = ["p1710104_20131023.nc", "p1710104.nc", "p1710105.nc"].map(PathBuf::from);
        let (of, others) = dives(&files);
        assert_eq!((of.len(), of[&(171, 104)], others.len()), (2, &files[1], 1));
        assert!(others[0].0 == "p1710104_20131023.nc" && others[0].1.contains("is of dive 104 as p1710104.nc is"), "{others:?}");
    }

    #[test]
    fn regress_constants_in_other_units_give_the_same_vehicle() {
        let draft = |changes: &[(&str, f64)]| {
            let mut values: BTreeMap<String, f64> = [
                ("sg_cal_mass", 54.12),
                ("sg_cal_volmax", 53_285.5),
                ("sg_cal_rho0", 1027.5),
                ("sg_cal_hd_a", 0.0038),
                ("sg_cal_hd_b", 0.0105),
                ("sg_cal_hd_c", 9.8e-6),
                ("log_C_VBD", 2900.0),
                ("log_VBD_MIN", 500.0),
                ("log_VBD_CNV", -0.245),
            ]
            .map(|(name, value)| (name.to_owned(), value))
            .into();
            values.extend(changes.iter().map(|(name, value)| ((*name).to_owned(), *value)));
            let mut draft = Class::Seaglider.draft();
            from_constants(&mut draft, &Scalars::from_values(values), &mut Report::new("made"));
            ["mass_kg", "hull_volume_m3", "hydro.cd0", "hydro.hull_lift_slope_per_rad"].map(|key| draft.get(key).unwrap_or(f64::NAN))
        };
        let want = draft(&[]);
        assert!(want.iter().all(|v| v.is_finite()), "{want:?}");
        for change in [
            ("sg_cal_mass", 54_120.0),
            ("sg_cal_volmax", 53.2855),
            ("sg_cal_volmax", 0.053_285_5),
            ("sg_cal_rho0", 1.0275),
            ("sg_cal_rho0", 1_027_500.0),
        ] {
            let got = draft(&[change]);
            assert!(got.iter().zip(&want).all(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{change:?}: {got:?}, not {want:?}");
        }
    }
}
