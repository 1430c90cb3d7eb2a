//! What water is around the vehicle?
//!
//! Profiles of density and temperature (from salinity by TEOS-10, crate `gsw`),
//! currents that vary in depth, an internal wave of the lowest mode,
//! background vertical motion, bottom and surface.
//!
//! TEOS-10 is evaluated once per scenario on a grid; a lookup is one linear
//! interpolation. Temperatures are conservative temperatures (they differ from
//! in-situ ones by less than 0.1 K above 1000 m).

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Standard gravity used throughout, m/s² (flight format, sec. 2).
pub const GRAVITY_M_S2: f64 = 9.81;
/// Cells of the tabulated column.
const CELLS: usize = 2048;

/// Where density and temperature come from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Summer lake: fresh, 18 °C over 6 °C, thermocline at 10 m.
    #[default]
    Lake,
    /// Baltic-like: salinity 7.5 g/kg, thermocline at 18 m, halocline at 60 m.
    Baltic,
    /// Subtropical deep sea: 26 °C to 4 °C, 36.5 to 35 g/kg.
    DeepSea,
    /// Constant density, kg/m³, and 10 °C: nothing changes with depth.
    Uniform(f64),
    /// Given levels, in order of depth.
    Levels(Vec<Level>),
    /// A csv file: columns `depth_m` and `temperature_degc`, and either `absolute_salinity_g_kg` or `density_kg_m3`.
    File(PathBuf),
}

/// One level of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Depth, m.
    pub depth_m: f64,
    /// Conservative temperature, °C.
    pub temperature_degc: f64,
    /// Absolute salinity, g/kg.
    #[serde(default)]
    pub absolute_salinity_g_kg: f64,
    /// In-situ density, kg/m³; none: by TEOS-10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
}

/// Current at one depth; linear between, constant outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurrentLevel {
    /// Depth, m.
    pub depth_m: f64,
    /// Water velocity to the north, m/s.
    pub north_m_s: f64,
    /// Water velocity to the east, m/s.
    pub east_m_s: f64,
}

/// The sea or lake of a scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ocean {
    /// Density and temperature.
    pub profile: Profile,
    /// Water depth, m.
    pub water_depth_m: f64,
    /// Horizontal currents.
    pub current: Vec<CurrentLevel>,
    /// Ordinary small vertical water motion, rms, m/s.
    pub background_rms_m_s: f64,
    /// Its correlation time, s.
    pub background_time_s: f64,
    /// Height of surface waves (standard deviation), m: seen by the pressure sensors near the surface.
    pub wave_height_m: f64,
}

impl Default for Ocean {
    /// A calm lake of 60 m.
    fn default() -> Self {
        Self {
            profile: Profile::Lake,
            water_depth_m: 60.0,
            current: Vec::new(),
            background_rms_m_s: 0.0,
            background_time_s: 120.0,
            wave_height_m: 0.02,
        }
    }
}

impl Ocean {
    /// A calm Baltic-like sea of 90 m.
    #[must_use]
    pub fn baltic() -> Self {
        Self { profile: Profile::Baltic, water_depth_m: 90.0, ..Self::default() }
    }

    /// A calm shelf sea of 250 m with a deep-sea profile's upper part.
    #[must_use]
    pub fn sea() -> Self {
        Self { profile: Profile::DeepSea, water_depth_m: 250.0, ..Self::default() }
    }

    /// A calm deep sea of 1500 m.
    #[must_use]
    pub fn deep() -> Self {
        Self { profile: Profile::DeepSea, water_depth_m: 1500.0, ..Self::default() }
    }
}

/// One cell of the tabulated column: value at its top, and gradient.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cell {
    rho: f64,
    rho_z: f64,
    temperature: f64,
    temperature_z: f64,
    pressure_pa: f64,
    pressure_z: f64,
    north: f64,
    north_z: f64,
    east: f64,
    east_z: f64,
}

/// Water at one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Water {
    pub(crate) rho: f64,
    pub(crate) temperature: f64,
    pub(crate) pressure_pa: f64,
    pub(crate) north: f64,
    pub(crate) east: f64,
    pub(crate) north_z: f64,
    pub(crate) east_z: f64,
}

/// The column, tabulated.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    cells: Vec<Cell>,
    per_m: f64,
    dz: f64,
    pub(crate) depth_m: f64,
}

impl Column {
    /// Tabulates an ocean.
    pub(crate) fn new(ocean: &Ocean, extra_current: impl Fn(f64) -> (f64, f64)) -> Result<Self, String> {
        let depth_m = ocean.water_depth_m;
        if !(depth_m.is_finite() && depth_m >= 5.0) {
            return Err(format!("ocean.water_depth_m is {depth_m}, it must be at least 5"));
        }
        let levels = match &ocean.profile {
            Profile::File(path) => read_levels(path)?,
            Profile::Levels(levels) => levels.clone(),
            _ => Vec::new(),
        };
        if matches!(ocean.profile, Profile::File(_) | Profile::Levels(_)) {
            check_levels(&levels)?;
        }
        let dz = depth_m / CELLS as f64;
        let mut nodes = Vec::with_capacity(CELLS + 1);
        let mut pressure_pa = 0.0;
        let mut last_rho = None;
        for i in 0..=CELLS {
            let z = i as f64 * dz;
            // Density at this node with the pressure extrapolated from the node above; 1e-7 relative per cell.
            let guess_pa = pressure_pa + last_rho.map_or(0.0, |r: f64| r * GRAVITY_M_S2 * dz);
            let (temperature, rho) = water_at(&ocean.profile, &levels, z, guess_pa)?;
            if let Some(above) = last_rho {
                pressure_pa += 0.5 * (above + rho) * GRAVITY_M_S2 * dz;
            }
            last_rho = Some(rho);
            let (north, east) = current_at(&ocean.current, z);
            let (n2, e2) = extra_current(z);
            nodes.push([rho, temperature, pressure_pa, north + n2, east + e2]);
        }
        let cells: Vec<_> = nodes
            .windows(2)
            .map(|p| {
                let g = |k: usize| (p[1][k] - p[0][k]) / dz;
                Cell {
                    rho: p[0][0],
                    rho_z: g(0),
                    temperature: p[0][1],
                    temperature_z: g(1),
                    pressure_pa: p[0][2],
                    pressure_z: g(2),
                    north: p[0][3],
                    north_z: g(3),
                    east: p[0][4],
                    east_z: g(4),
                }
            })
            .collect();
        if let Some(bad) = cells.iter().find(|c| !(900.0..1100.0).contains(&c.rho)) {
            return Err(format!("the ocean profile gives a density of {} kg/m3, water has 900 to 1100", bad.rho));
        }
        Ok(Self { cells, per_m: 1.0 / dz, dz, depth_m })
    }

    /// Water at depth `z` (m); `lifted` is how far the isopycnals are up, m.
    #[inline]
    pub(crate) fn at(&self, z: f64, lifted: f64) -> Water {
        let (c, d) = self.cell(z);
        let (s, e) = if lifted == 0.0 { (c, d) } else { self.cell(z + lifted) };
        Water {
            // Lifted water brings its density along; its adiabatic expansion (4e-6/m) is neglected.
            rho: s.rho + s.rho_z * e,
            temperature: s.temperature + s.temperature_z * e,
            pressure_pa: c.pressure_pa + c.pressure_z * d,
            north: c.north + c.north_z * d,
            east: c.east + c.east_z * d,
            north_z: c.north_z,
            east_z: c.east_z,
        }
    }

    #[inline]
    fn cell(&self, z: f64) -> (&Cell, f64) {
        let z = z.max(0.0);
        let i = ((z * self.per_m) as usize).min(self.cells.len() - 1);
        (&self.cells[i], (z - i as f64 * self.dz).min(self.dz))
    }
}

fn water_at(profile: &Profile, levels: &[Level], z: f64, pressure_pa: f64) -> Result<(f64, f64), String> {
    let step = |centre: f64, width: f64| 0.5 * (1.0 + ((z - centre) / width).tanh());
    let (temperature, salinity) = match profile {
        Profile::Uniform(rho) => return Ok((10.0, *rho)),
        Profile::Lake => (18.0 - 12.0 * step(10.0, 4.0), 0.2),
        Profile::Baltic => (16.7 - 9.5 * step(18.0, 5.0), 7.5 + 4.0 * step(60.0, 6.0)),
        Profile::DeepSea => (4.0 + 22.0 * (-z / 250.0).exp(), 35.0 + 1.5 * (-z / 300.0).exp()),
        Profile::Levels(_) | Profile::File(_) => {
            let at = |f: fn(&Level) -> f64| between(levels, z, |l| l.depth_m, f);
            let temperature = at(|l| l.temperature_degc);
            if levels.iter().all(|l| l.density_kg_m3.is_some()) {
                return Ok((temperature, at(|l| l.density_kg_m3.unwrap_or(f64::NAN))));
            }
            (temperature, at(|l| l.absolute_salinity_g_kg))
        }
    };
    let rho = gsw::volume::rho(salinity, temperature, pressure_pa * 1e-4)
        .map_err(|e| format!("TEOS-10 refuses the profile at {z:.1} m: {e:?}"))?;
    Ok((temperature, rho))
}

fn current_at(levels: &[CurrentLevel], z: f64) -> (f64, f64) {
    if levels.is_empty() {
        return (0.0, 0.0);
    }
    (between(levels, z, |l| l.depth_m, |l| l.north_m_s), between(levels, z, |l| l.depth_m, |l| l.east_m_s))
}

/// Linear in depth between levels, constant outside. `levels` is not empty.
fn between<L>(levels: &[L], z: f64, depth: fn(&L) -> f64, value: fn(&L) -> f64) -> f64 {
    let below = levels.iter().position(|l| depth(l) >= z).unwrap_or(levels.len() - 1);
    let above = if depth(&levels[below]) > z { below.saturating_sub(1) } else { below };
    let (a, b) = (&levels[above], &levels[below]);
    let span = depth(b) - depth(a);
    if span > 0.0 { value(a) + (value(b) - value(a)) * ((z - depth(a)) / span).clamp(0.0, 1.0) } else { value(b) }
}

fn check_levels(levels: &[Level]) -> Result<(), String> {
    if levels.is_empty() {
        return Err("the ocean profile has no level".into());
    }
    if levels.iter().any(|l| !(l.depth_m.is_finite() && l.temperature_degc.is_finite() && l.absolute_salinity_g_kg.is_finite())) {
        return Err("the ocean profile has a value that is not finite".into());
    }
    if levels.windows(2).any(|p| p[1].depth_m <= p[0].depth_m) {
        return Err("the ocean profile's depths must increase".into());
    }
    Ok(())
}

fn read_levels(path: &PathBuf) -> Result<Vec<Level>, String> {
    let name = path.display();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|e| format!("{name}: {e}"))?;
    let headers = reader.headers().map_err(|e| format!("{name}: {e}"))?.clone();
    let has = |c: &str| headers.iter().any(|h| h == c);
    for column in ["depth_m", "temperature_degc"] {
        if !has(column) {
            return Err(format!("{name}: line 1: no column '{column}'"));
        }
    }
    if !has("absolute_salinity_g_kg") && !has("density_kg_m3") {
        return Err(format!("{name}: line 1: needs a column 'absolute_salinity_g_kg' or 'density_kg_m3'"));
    }
    reader.deserialize().map(|row| row.map_err(|e| format!("{name}: {e}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(profile: Profile, depth_m: f64) -> Column {
        Column::new(&Ocean { profile, water_depth_m: depth_m, ..Ocean::default() }, |_| (0.0, 0.0)).unwrap()
    }

    #[test]
    fn validate_table_agrees_with_teos10_between_its_nodes() {
        let c = column(Profile::DeepSea, 1500.0);
        for z in [0.1, 33.3, 100.0, 431.7, 999.9] {
            let w = c.at(z, 0.0);
            let s = 35.0 + 1.5 * (-z / 300.0f64).exp();
            let t = 4.0 + 22.0 * (-z / 250.0f64).exp();
            let rho = gsw::volume::rho(s, t, w.pressure_pa * 1e-4).unwrap();
            // 1e-3 kg/m3 is 0.05 g of buoyancy: a hundredth of the pump's dead-band.
            assert!((w.rho - rho).abs() < 1e-3, "{z} m: {} {rho}", w.rho);
        }
        let w = c.at(1000.0, 0.0);
        // 1000 m of sea water of 1025..1032 kg/m3.
        assert!((1.005e7..1.012e7).contains(&w.pressure_pa), "{}", w.pressure_pa);
    }

    #[test]
    fn stratification_is_stable_in_every_built_in_profile() {
        for p in [Profile::Lake, Profile::Baltic, Profile::DeepSea] {
            let c = column(p.clone(), 200.0);
            let mut last = 0.0;
            for i in 0..200 {
                let rho = c.at(f64::from(i), 0.0).rho;
                assert!(rho > last, "{p:?} {i} m");
                last = rho;
            }
        }
    }

    #[test]
    fn given_levels_are_interpolated_and_bad_ones_refused() {
        let level = |d, t, r| Level { depth_m: d, temperature_degc: t, absolute_salinity_g_kg: 0.0, density_kg_m3: Some(r) };
        let c = column(Profile::Levels(vec![level(0.0, 20.0, 1000.0), level(10.0, 10.0, 1002.0)]), 40.0);
        assert!((c.at(5.0, 0.0).rho - 1001.0).abs() < 1e-9 && (c.at(30.0, 0.0).rho - 1002.0).abs() < 1e-9);
        assert!((c.at(2.5, 2.5).rho - 1001.0).abs() < 1e-9, "isopycnals up: water from below");
        let bad = Ocean { profile: Profile::Levels(vec![level(5.0, 1.0, 1000.0), level(5.0, 1.0, 1000.0)]), ..Ocean::default() };
        assert!(Column::new(&bad, |_| (0.0, 0.0)).unwrap_err().contains("increase"));
    }
}
