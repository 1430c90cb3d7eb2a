//! Usual numbers of the glider classes, for a flight whose files do not state them.
//!
//! Sources: G = gliderflight 1.2.1 (defaults for a Slocum), M = Merckelbach et al. 2010, J. Atmos. Oceanic Technol. 27,
//! S = constants of the Seaglider base station. "guess" is a guess; tolerances are 1 sigma of sister vehicles, all guesses.

use super::draft::Draft;

/// A class of gliders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Slocum with the shallow pump.
    Slocum200,
    /// Slocum with the deep oil bladder.
    Slocum1000,
    /// Slocum G3.
    SlocumG3,
    /// Seaglider, 1000 m, low-drag fairing.
    Seaglider,
    /// SeaExplorer, without wings.
    SeaExplorer,
    /// Nothing is known of it.
    Unknown,
}

/// Numbers of a class, and where they are from.
struct Usual {
    about: &'static str,
    mass_kg: (f64, &'static str),
    compressibility: (f64, f64, &'static str),
    expansion: (f64, f64, &'static str),
    lift_slope: (f64, f64, &'static str),
    cd0: (f64, f64, &'static str),
    drag_per_rad2: (f64, &'static str),
    drag_exponent: Option<f64>,
}

impl Class {
    /// Every class.
    pub const ALL: [Self; 6] = [Self::Slocum200, Self::Slocum1000, Self::SlocumG3, Self::Seaglider, Self::SeaExplorer, Self::Unknown];

    /// Its name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Slocum200 => "slocum-200",
            Self::Slocum1000 => "slocum-1000",
            Self::SlocumG3 => "slocum-g3",
            Self::Seaglider => "seaglider",
            Self::SeaExplorer => "seaexplorer",
            Self::Unknown => "unknown",
        }
    }

    /// One line on it.
    #[must_use]
    pub fn about(self) -> &'static str {
        self.usual().about
    }

    /// Slocum by the depth it went to: the shallow pump's hull is rated to 200 m.
    #[must_use]
    pub fn slocum(deepest_dbar: f64) -> Self {
        if deepest_dbar > 250.0 { Self::Slocum1000 } else { Self::Slocum200 }
    }

    fn usual(self) -> Usual {
        const G: &str = "gliderflight 1.2.1";
        const GUESS: &str = "guess";
        let slocum = Usual {
            about: "Slocum G1 or G2, shallow pump (200 m), 1 m wings",
            mass_kg: (65.0, "guess: 1.5 m hull with science bay, 52 to 73 kg"),
            compressibility: (5e-10, 0.15, G),
            expansion: (5e-5, 0.4, "guess: aluminium hull 7e-5 less its oil"),
            lift_slope: (7.5343, 0.15, "gliderflight 1.2.1, wing and hull together"),
            cd0: (0.15, 0.25, G),
            drag_per_rad2: (10.5, G),
            drag_exponent: None,
        };
        match self {
            Self::Slocum200 => slocum,
            Self::Slocum1000 => Usual {
                about: "Slocum G1 or G2, oil bladder (1000 m), 1 m wings",
                compressibility: (5e-10, 0.25, "guess, as the shallow hull"),
                cd0: (0.15, 0.3, G),
                ..slocum
            },
            Self::SlocumG3 => Usual {
                about: "Slocum G3, shallow or deep",
                mass_kg: (68.0, "guess: 65 to 80 kg with the bays"),
                compressibility: (5e-10, 0.25, "guess, as the G2 hull"),
                cd0: (0.15, 0.35, "guess, as the G2"),
                ..slocum
            },
            Self::Seaglider => Usual {
                about: "Seaglider, 1000 m, 1 m wings",
                mass_kg: (52.0, "usual, 50 to 56 kg"),
                compressibility: (4.1e-10, 0.15, "documented default of the hull that compresses like the sea"),
                expansion: (7.05e-5, 0.2, "documented default"),
                // hd_a 0.003, hd_b 0.00984, hd_c 5.7e-6 on the square of 1.8 m, brought to 0.1 m2 (aspect 1).
                lift_slope: (5.569_15, 0.25, "documented default hd_a = 0.003"),
                cd0: (0.1223, 0.3, "documented default hd_b = 0.00984 at 0.30 m/s"),
                drag_per_rad2: (0.606_27, "documented default hd_c = 5.7e-6"),
                drag_exponent: Some(0.5),
            },
            Self::SeaExplorer => Usual {
                about: "SeaExplorer, 1000 m, hull without wings",
                mass_kg: (59.0, "maker's data sheet"),
                compressibility: (4.5e-10, 0.25, GUESS),
                expansion: (5e-5, 0.5, GUESS),
                lift_slope: (3.0, 0.5, "guess: a hull of 0.25 m with tail fins and no wings"),
                cd0: (0.1, 0.4, "guess: hull of 0.25 m, 0.2 on its frontal area"),
                drag_per_rad2: (3.0, GUESS),
                drag_exponent: None,
            },
            Self::Unknown => Usual {
                about: "any glider: numbers of a Slocum with twice the tolerances",
                mass_kg: (60.0, "guess: gliders have 50 to 75 kg"),
                compressibility: (4.5e-10, 0.3, GUESS),
                expansion: (5e-5, 0.5, GUESS),
                lift_slope: (7.0, 0.4, GUESS),
                cd0: (0.15, 0.5, GUESS),
                drag_per_rad2: (6.0, GUESS),
                drag_exponent: None,
            },
        }
    }

    /// A vehicle of this class, all but its hull volume, which is a matter of ballasting.
    #[must_use]
    pub fn draft(self) -> Draft {
        let usual = self.usual();
        let mut d = Draft::default();
        d.about.push(usual.about.to_owned());
        d.say("format", "glider-trial/1", "");
        d.say("case", self.name(), "");
        d.say("site", "sea", "");
        d.set("gravity_m_s2", 9.81, "");
        d.set("mass_kg", usual.mass_kg.0, usual.mass_kg.1);
        d.set("hull_compressibility_per_pa", usual.compressibility.0, usual.compressibility.2);
        d.set("hull_thermal_expansion_per_k", usual.expansion.0, usual.expansion.2);
        d.set("reference_temperature_degc", 15.0, "");
        d.say(crate::vehicle::CURRENT_KEY, "unknown", "");
        d.say("wing.name", "standard", "");
        d.set("wing.aspect_ratio", 6.0, "not used: lift is stated as one slope");
        d.set("wing.area_m2", REFERENCE_AREA_M2, "");
        d.set("wing.sweep_deg", 0.0, "not used");
        // Not the square of the hull's length: flow across the hull is stated on this area.
        d.set("hydro.reference_area_m2", REFERENCE_AREA_M2, "");
        d.set("hydro.wing_lift_slope_per_rad", 0.0, "all of it in the hull's slope");
        d.set("hydro.hull_lift_slope_per_rad", usual.lift_slope.0, usual.lift_slope.2);
        d.set("hydro.hull_area_m2", REFERENCE_AREA_M2, "");
        d.set("hydro.lift_quadratic_per_rad2", 0.0, "");
        d.set("hydro.cd0", usual.cd0.0, usual.cd0.2);
        d.set("hydro.induced_k", 0.0, "in the drag per rad2");
        d.set("hydro.hull_drag_per_rad2", usual.drag_per_rad2.0, usual.drag_per_rad2.1);
        d.set("hydro.added_mass_surge", 0.2, "gliderflight 1.2.1, a Slocum's");
        d.set("hydro.added_mass_heave", 0.92, "gliderflight 1.2.1, a Slocum's");
        if let Some(exponent) = usual.drag_exponent {
            d.set("effects.reynolds_drag.exponent", exponent, "twice hd_s with its sign changed");
        }
        let why = "guess: scatter of sister vehicles, 1 sigma";
        d.set("tolerance_1sigma.cd0_relative", usual.cd0.1, why);
        d.set("tolerance_1sigma.lift_slope_relative", usual.lift_slope.1, why);
        d.set("tolerance_1sigma.lift_quadratic_relative", 0.1, "");
        d.set("tolerance_1sigma.trim_volume_cc", 100.0, "guess: ballasting");
        d.set("tolerance_1sigma.ballast_gain_relative", 0.02, "guess");
        d.set("tolerance_1sigma.pitch_zero_rad", 0.0175, "guess: one degree");
        d.set("tolerance_1sigma.hull_compressibility_relative", usual.compressibility.1, why);
        d.set("tolerance_1sigma.hull_thermal_expansion_relative", usual.expansion.1, why);
        d.set("tolerance_1sigma.added_mass_surge", 0.05, "guess");
        d.set("tolerance_1sigma.added_mass_heave", 0.1, "guess");
        d.set("background_vertical_water_motion.rms_m_s", 0.005, "guess: open sea, quiet");
        d.set("background_vertical_water_motion.correlation_time_s", 90.0, "guess");
        d
    }
}

/// Area to which the coefficients of every class refer, m².
pub const REFERENCE_AREA_M2: f64 = 0.1;
