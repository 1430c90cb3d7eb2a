//! Which variables of other people's files become which channel, by name and by unit.

/// What a variable can be.
pub(in crate::import) struct Wanted {
    /// Column of the flight format.
    pub column: &'static str,
    /// Usual names, best first; case does not matter.
    pub names: &'static [&'static str],
    /// CF standard names that a variable of any other name may have.
    pub standard: &'static [&'static str],
    /// Units it may have, with the factor to SI.
    pub units: &'static [(&'static str, f64)],
    /// Of `names`, those whose unit is known though the file states none, with the factor to SI.
    pub without_unit: &'static [(&'static str, f64)],
}

impl Wanted {
    /// What it can be in SI, in the sea or a lake; values outside are no measurements.
    #[must_use]
    pub fn possible(&self) -> std::ops::RangeInclusive<f64> {
        match self.names {
            n if n == TEMPERATURE.names => -3.0..=45.0,
            n if n == SALINITY.names => 1e-3..=45.0,
            n if n == CONDUCTIVITY.names => 1e-3..=8.0,
            n if n == DENSITY.names => 980.0..=1090.0,
            n if n == PITCH.names => -std::f64::consts::FRAC_PI_2..=std::f64::consts::FRAC_PI_2,
            _ => f64::NEG_INFINITY..=f64::INFINITY,
        }
    }

    /// What is taken off a number in `unit`, and by what it is multiplied then, to be in SI; none of a unit that is not known.
    #[must_use]
    pub fn in_si(&self, unit: &str) -> Option<(f64, f64)> {
        let factor = self.units.iter().find(|(u, _)| u.eq_ignore_ascii_case(unit)).map(|(_, f)| *f)?;
        let zero = |list: &[&str], zero: f64| if list.iter().any(|u| u.eq_ignore_ascii_case(unit)) { zero } else { 0.0 };
        let offset = if self.units == CELSIUS { zero(&KELVIN, 273.15) + zero(&FAHRENHEIT, 32.0) } else { 0.0 };
        Some((offset, factor))
    }
}

/// Units of temperature whose zero is not that of °C.
const KELVIN: [&str; 5] = ["k", "kelvin", "kelvins", "degree_kelvin", "degrees_kelvin"];
const FAHRENHEIT: [&str; 4] = ["degf", "f", "degree_fahrenheit", "fahrenheit"];

pub(in crate::import) const DEGREE: f64 = std::f64::consts::PI / 180.0;
const ANGLES: &[(&str, f64)] = &[
    ("degrees", DEGREE),
    ("degree", DEGREE),
    ("deg", DEGREE),
    ("degrees true", DEGREE),
    ("angular_degree", DEGREE),
    ("°", DEGREE),
    ("rad", 1.0),
    ("radian", 1.0),
    ("radians", 1.0),
];
const SALINITY_UNITS: &[(&str, f64)] = &[
    ("1", 1.0),
    ("1e-3", 1.0),
    ("0.001", 1.0),
    ("psu", 1.0),
    ("pss", 1.0),
    ("pss-78", 1.0),
    ("pss78", 1.0),
    ("unitless", 1.0),
    ("dimensionless", 1.0),
    // Practical salinity under the unit of absolute salinity is off by half a percent; files that say so mean the practical one.
    ("g/kg", 1.0),
    ("g kg-1", 1.0),
];
const CELSIUS: &[(&str, f64)] = &[
    ("degrees_celsius", 1.0),
    ("degree_celsius", 1.0),
    ("celsius", 1.0),
    ("degree_c", 1.0),
    ("degrees_c", 1.0),
    ("deg_c", 1.0),
    ("deg c", 1.0),
    ("degc", 1.0),
    ("°c", 1.0),
    ("c", 1.0),
    ("degrees celsius", 1.0),
    ("degree celsius", 1.0),
    ("k", 1.0),
    ("kelvin", 1.0),
    ("kelvins", 1.0),
    ("degree_kelvin", 1.0),
    ("degrees_kelvin", 1.0),
    ("degf", 5.0 / 9.0),
    ("f", 5.0 / 9.0),
    ("degree_fahrenheit", 5.0 / 9.0),
    ("fahrenheit", 5.0 / 9.0),
];
const DEGREES: &[(&str, f64)] = &[
    ("degrees_north", 1.0),
    ("degrees_east", 1.0),
    ("degree_north", 1.0),
    ("degree_east", 1.0),
    ("degreesnorth", 1.0),
    ("degreeseast", 1.0),
    ("degrees", 1.0),
];

pub(in crate::import) const PRESSURE: Wanted = Wanted {
    column: "pressure_dbar",
    names: &[
        "PRES_ADJUSTED",
        "ctd_pressure",
        "PRES",
        "sci_water_pressure",
        "pressure",
        "sea_water_pressure",
        "m_pressure",
        "m_water_pressure",
    ],
    standard: &["sea_water_pressure", "sea_water_pressure_due_to_sea_water"],
    units: &[
        ("dbar", 1e4),
        ("decibar", 1e4),
        ("decibars", 1e4),
        ("db", 1e4),
        ("bar", 1e5),
        ("bars", 1e5),
        ("pa", 1.0),
        ("kpa", 1e3),
        ("hpa", 100.0),
        ("mbar", 100.0),
        ("millibar", 100.0),
        ("mpa", 1e6),
        ("psi", 6_894.757),
    ],
    without_unit: &[],
};
/// In the place of a pressure that is not there.
pub(in crate::import) const DEPTH: Wanted = Wanted {
    column: "pressure_dbar",
    names: &["ctd_depth", "DEPTH", "depth", "m_depth", "eng_depth"],
    standard: &["depth"],
    units: &[("m", 1.0), ("meters", 1.0), ("meter", 1.0), ("metres", 1.0), ("metre", 1.0), ("cm", 0.01), ("ft", 0.3048), ("feet", 0.3048)],
    without_unit: &[],
};
pub(in crate::import) const TEMPERATURE: Wanted = Wanted {
    column: "sci_water_temp_degC",
    names: &["TEMP_ADJUSTED", "temperature", "TEMP", "sci_water_temp", "sea_water_temperature"],
    standard: &["sea_water_temperature"],
    units: CELSIUS,
    without_unit: &[],
};
pub(in crate::import) const SALINITY: Wanted = Wanted {
    column: "sci_density_kg_m3",
    names: &["PSAL_ADJUSTED", "salinity", "PSAL", "practical_salinity"],
    standard: &["sea_water_practical_salinity", "sea_water_salinity", "sea_water_absolute_salinity"],
    units: SALINITY_UNITS,
    without_unit: &[("salinity", 1.0), ("PSAL", 1.0), ("practical_salinity", 1.0)],
};
pub(in crate::import) const CONDUCTIVITY: Wanted = Wanted {
    column: "sci_density_kg_m3",
    names: &["conductivity", "CNDC", "sci_water_cond"],
    standard: &["sea_water_electrical_conductivity"],
    units: &[
        ("s/m", 1.0),
        ("s m-1", 1.0),
        ("ms/cm", 0.1),
        ("ms cm-1", 0.1),
        ("mhos/m", 1.0),
        ("ms/m", 1e-3),
        ("us/cm", 1e-4),
        ("µs/cm", 1e-4),
    ],
    without_unit: &[],
};
pub(in crate::import) const DENSITY: Wanted = Wanted {
    column: "sci_density_kg_m3",
    names: &["DENSITY", "density"],
    standard: &["sea_water_density"],
    units: &[("kg/m3", 1.0), ("kg m-3", 1.0), ("kg/m^3", 1.0), ("kg/m**3", 1.0), ("g/cm3", 1e3), ("g cm-3", 1e3), ("g/cm^3", 1e3)],
    without_unit: &[],
};
pub(in crate::import) const PITCH: Wanted = Wanted {
    column: "m_pitch_rad",
    names: &["eng_pitchAng", "PITCH", "GLIDER_PITCH", "pitch", "m_pitch"],
    standard: &["platform_pitch", "platform_pitch_angle", "platform_pitch_fore_up"],
    units: ANGLES,
    without_unit: &[],
};
pub(in crate::import) const ROLL: Wanted = Wanted {
    column: "m_roll_rad",
    names: &["eng_rollAng", "ROLL", "GLIDER_ROLL", "roll", "m_roll"],
    standard: &["platform_roll", "platform_roll_angle", "platform_roll_starboard_down"],
    units: ANGLES,
    without_unit: &[],
};
pub(in crate::import) const HEADING: Wanted = Wanted {
    column: "m_heading_rad",
    names: &["eng_head", "HEADING", "GLIDER_HEADING", "heading", "m_heading"],
    standard: &["platform_orientation", "platform_yaw"],
    units: ANGLES,
    without_unit: &[],
};
/// Seaglider's base station writes the volume of the buoyancy device in cm3 and states no unit, and so does what is made from it.
pub(in crate::import) const BALLAST: Wanted = Wanted {
    column: "m_ballast_pumped_cc",
    names: &[
        "eng_vbdCC",
        "vbdCC",
        "VBD_CC",
        "BALLAST",
        "GLIDER_BALLAST",
        "m_ballast_pumped",
        "m_de_oil_vol",
        "ballast",
        "ballast_pumped",
        "ballast_pos",
        "BallastPos",
        "oil_volume",
        "de_oil_vol",
    ],
    standard: &[],
    units: &[
        ("cc", 1e-6),
        ("cm3", 1e-6),
        ("cm^3", 1e-6),
        ("cm**3", 1e-6),
        ("cm³", 1e-6),
        ("cm-3", 1e-6),
        ("ml", 1e-6),
        ("m3", 1.0),
        ("m^3", 1.0),
        ("m**3", 1.0),
        ("l", 1e-3),
        ("liter", 1e-3),
        ("liters", 1e-3),
        ("litre", 1e-3),
        ("litres", 1e-3),
        ("in3", 1.638_706_4e-5),
        ("in^3", 1.638_706_4e-5),
    ],
    without_unit: &[("eng_vbdCC", 1e-6), ("vbdCC", 1e-6), ("VBD_CC", 1e-6)],
};
pub(in crate::import) const BATTERY: Wanted = Wanted {
    column: "m_battpos_m",
    names: &["BATTERY_POSITION", "m_battpos"],
    standard: &[],
    units: &[("m", 1.0), ("in", 0.0254), ("inch", 0.0254)],
    without_unit: &[],
};
/// Measured only: `GLIDE_SPEED` and `speed_gsm` of other people's files come out of a flight model.
pub(in crate::import) const SPEED: Wanted = Wanted {
    column: "speed_water_m_s",
    names: &["SPEED_WATER", "speed_through_water"],
    standard: &[],
    units: &[("m/s", 1.0), ("m s-1", 1.0), ("cm/s", 0.01)],
    without_unit: &[],
};
pub(in crate::import) const LATITUDE: Wanted = Wanted {
    column: "gps_north_m",
    names: &["log_gps_lat", "LATITUDE_GPS", "gps_lat", "m_gps_lat"],
    standard: &[],
    units: DEGREES,
    without_unit: &[("log_gps_lat", 1.0), ("LATITUDE_GPS", 1.0)],
};
pub(in crate::import) const LONGITUDE: Wanted = Wanted {
    column: "gps_east_m",
    names: &["log_gps_lon", "LONGITUDE_GPS", "gps_lon", "m_gps_lon"],
    standard: &[],
    units: DEGREES,
    without_unit: &[("log_gps_lon", 1.0), ("LONGITUDE_GPS", 1.0)],
};
/// Fixes in the local plane already, as our own export writes them.
pub(in crate::import) const EAST: Wanted =
    Wanted { column: "gps_east_m", names: &["GPS_EAST"], standard: &[], units: &[("m", 1.0)], without_unit: &[] };
pub(in crate::import) const NORTH: Wanted =
    Wanted { column: "gps_north_m", names: &["GPS_NORTH"], standard: &[], units: &[("m", 1.0)], without_unit: &[] };
/// Position of each row, interpolated or dead reckoned: only says in which sea it was.
pub(in crate::import) const ABOUT_LATITUDE: Wanted =
    Wanted { column: "place", names: &["LATITUDE", "latitude", "lat", "profile_lat"], standard: &[], units: DEGREES, without_unit: &[] };
pub(in crate::import) const ABOUT_LONGITUDE: Wanted =
    Wanted { column: "place", names: &["LONGITUDE", "longitude", "lon", "profile_lon"], standard: &[], units: DEGREES, without_unit: &[] };
/// Number of the dive of each row, or of the segment where our own export wrote it.
pub(in crate::import) const DIVE: [&str; 6] = ["divenum", "DIVE_NUMBER", "dive_number", "SEGMENT_NUMBER", "segment_number", "SEGMENT"];
