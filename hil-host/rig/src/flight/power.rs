//! What a mission takes from the battery: each part's current in each of its states, and for how long it is in them.
//!
//! Currents are the datasheets' typical ones at room temperature where a source stands beside them; the others are guesses until
//! there is a board to measure. Times are those that the board's own loop enters on models of its parts
//! ([`crate::seats::parts`]); what the constants of the firmware make of them is beside them, and a test compares.

use crate::flight::closed_loop::{FlightError, Setup};
use crate::flight::outcome::Outcome;
use crate::flight::own_parts;
use bay::supplies::COMPASS_LEAD_MS;
use parts::Work;
use plant::World;
use serde_json::{Value, json};

/// Battery voltage that currents are stated at, V.
pub const AT_V: f64 = 12.0;
/// Efficiency of the converters from the battery to 3.3 and 5 V (guess).
const CONVERTER: f64 = 0.85;
/// Capacity of the battery, A·h: that of the firmware's gauge.
const CAPACITY_AH: f64 = bay::parts::CAPACITY_C as f64 / 3600.0;

/// When a part takes a current.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum When {
    /// Always.
    Always,
    /// While it works, or has its supply.
    Works(Work),
    /// While the processor sleeps.
    Asleep,
}

/// Part, state, current in mA at its rail in V, when, source.
type Load = (&'static str, &'static str, f64, f64, When, &'static str);

const LOADS: [Load; 19] = [
    ("STM32F405 at 16 MHz", "running", 7.0, 3.3, When::Works(Work::Processor), "DS8626 section 5.3.6, about"),
    ("STM32F405 at 16 MHz", "sleeping (WFI)", 4.0, 3.3, When::Asleep, "DS8626 section 5.3.6, about"),
    ("STM32F405", "stopped (STOP)", 0.28, 3.3, When::Works(Work::Stop), "DS8626 section 5.3.6, low power"),
    ("MS5837-30BA", "converting", 1.25, 3.3, When::Works(Work::Pressure), "TE MS5837-30BA page 3"),
    ("ADS1115", "converting", 0.15, 3.3, When::Works(Work::Adc), "SBAS444 section 6.5"),
    ("MPXA6115A", "on", 6.0, 5.0, When::Works(Work::Analog), "MPXA6115A table 1"),
    ("pots, leak loop", "on", 0.8, 3.3, When::Works(Work::Analog), "guess"),
    ("INA226", "on", 0.33, 3.3, When::Always, "SBOS547 section 6.5"),
    ("OS5000 compass", "on", 30.0, 3.3, When::Works(Work::Compass), "OS5000 manual, specifications"),
    ("GPS receiver", "on", 25.0, 3.3, When::Works(Work::Gps), "guess"),
    ("Iridium 9602", "on", 45.0, 5.0, When::Works(Work::Modem), "9602 developer's guide, power consumption"),
    ("Iridium 9602", "in a session", 145.0, 5.0, When::Works(Work::ModemSession), "the same, less what it takes when on"),
    ("W25Q128JV", "programming", 20.0, 3.3, When::Works(Work::Program), "W25Q128JV section 9.5"),
    ("W25Q128JV", "erasing", 20.0, 3.3, When::Works(Work::Erase), "W25Q128JV section 9.5"),
    ("W25Q128JV", "resting", 0.01, 3.3, When::Always, "W25Q128JV section 9.5"),
    ("fin servo", "holding", 5.0, 5.0, When::Works(Work::Servo), "guess"),
    ("two DRV8873 bridges", "awake", 10.0, AT_V, When::Works(Work::Bridges), "SLVSDY7 section 6.5"),
    ("two DRV8873 bridges", "asleep", 0.03, AT_V, When::Always, "SLVSDY7 section 6.5"),
    ("converters", "without load", 0.1, AT_V, When::Always, "guess"),
];

/// One line of the budget.
#[derive(Clone, Debug)]
pub struct Row {
    /// Part and state.
    pub what: String,
    /// Current at its rail in that state, mA.
    pub ma: f64,
    /// Rail, V.
    pub rail_v: f64,
    /// Share of the time that it is in that state.
    pub share: f64,
    /// Mean at [`AT_V`], mA.
    pub mean_ma: f64,
    /// Where the current is from.
    pub source: &'static str,
}

/// Budget of a mission.
#[derive(Clone, Debug)]
pub struct Budget {
    /// Controller and sensors.
    pub rows: Vec<Row>,
    /// Their mean at [`AT_V`], mA.
    pub electronics_ma: f64,
    /// Pump, battery mass and fin by the plant's energies, mean at [`AT_V`], mA.
    pub motors_ma: f64,
    /// The flight it is of.
    pub flight: Outcome,
    /// Pressure and ADC conversions, compass on, s a cycle, as flown and as the firmware's constants make them at least.
    pub per_cycle_s: [(f64, f64); 3],
}

impl Budget {
    /// Days until the battery is empty if missions like this one follow each other.
    #[must_use]
    pub fn endurance_days(&self) -> f64 {
        CAPACITY_AH * 1e3 / (self.electronics_ma + self.motors_ma) / 24.0
    }

    /// As JSON.
    #[must_use]
    pub fn document(&self) -> Value {
        let digits = |x: f64| (x * 1e4).round() / 1e4;
        json!({ "at_v": AT_V, "electronics_ma": digits(self.electronics_ma), "motors_ma": digits(self.motors_ma), "capacity_ah": CAPACITY_AH,
            "endurance_days": digits(self.endurance_days()), "mission_h": digits(self.flight.duration_s / 3600.0), "end": self.flight.end.to_string(),
            "rows": self.rows.iter().map(|r| json!({ "what": r.what, "ma": r.ma, "rail_v": r.rail_v, "share": digits(r.share), "mean_ma": digits(r.mean_ma), "source": r.source })).collect::<Vec<_>>() })
    }
}

/// Flies a mission on the board's own parts and adds up.
///
/// # Errors
/// The board refused or fell silent.
pub fn budget(world: World, setup: &Setup) -> Result<Budget, FlightError> {
    let mut board = own_parts::board(world, setup);
    let flight = own_parts::fly(&mut board, setup, &mut |_| Ok(()), &mut |_| {})?;
    let board = board.wire();
    let clock = &board.bench.clock;
    let seconds = clock.now_ns() as f64 * 1e-9;
    let share = |when: When| match when {
        When::Always => 1.0,
        When::Works(work) => clock.worked_s(work) / seconds,
        When::Asleep => 1.0 - (clock.worked_s(Work::Processor) + clock.worked_s(Work::Stop)) / seconds,
    };
    let rows: Vec<Row> = LOADS
        .iter()
        .map(|(part, state, ma, rail_v, when, source)| {
            let (share, loss) = (share(*when), if *rail_v < AT_V { CONVERTER } else { 1.0 });
            Row { what: format!("{part}, {state}"), ma: *ma, rail_v: *rail_v, share, mean_ma: ma * share * rail_v / AT_V / loss, source }
        })
        .collect();
    let energy = board.around.borrow().world.energy();
    let motors_ma = (energy.pump_j + energy.battery_motor_j + energy.fin_j) / seconds / AT_V * 1e3;
    let cycles = flight.cycles as f64;
    let conversion = |work| clock.worked_s(work) / cycles;
    let least = [4.0 * f64::from(devices::pressure::CONVERSION_US) * 1e-6, 4.0 * f64::from(devices::adc::CONVERSION_MS) * 1e-3];
    Ok(Budget {
        electronics_ma: rows.iter().map(|r| r.mean_ma).sum(),
        rows,
        motors_ma,
        per_cycle_s: [
            (conversion(Work::Pressure), least[0]),
            (conversion(Work::Adc), least[1]),
            (conversion(Work::Compass), COMPASS_LEAD_MS as f64 * 1e-3),
        ],
        flight,
    })
}
