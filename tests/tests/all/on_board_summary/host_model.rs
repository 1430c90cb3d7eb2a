//! The glide on board against the workbench's: two programs for the same vehicle.

use discovery::history::glide::Glider;
use discovery::history::numbers::{BALLAST_OFFSET, NUMBERS, Numbers, SLOPE_OF_LIFT, sizes};
use discovery::history::rows::{Row, Unit};
use evidence::SIZES;
use evidence::glide::linearise;
use hil_host::packets::board;
use polar::Table;
use rig::flight::vehicles;
use signals::Wings;
use std::path::Path;

/// Rows of dives and climbs, flat and steep, shallow and deep, in warm and in cold water as light as the vehicle.
fn unit(glider: &Glider) -> Unit {
    let neutral_kg_m3 = 1025.0 + glider.claims()[BALLAST_OFFSET] / glider.hull_m3();
    let mut rows = Vec::new();
    for way in [-1.0, 1.0] {
        for pitch in [0.3, 0.45, 0.6] {
            for pressure_pa in [2e5, 9e5, 1.8e6] {
                let (density_kg_m3, temperature_degc) = (neutral_kg_m3 + 4.4e-7 * pressure_pa, 20.0 - 6e-6 * pressure_pa);
                let (pitch_rad, ballast_m3) = (way * pitch, way * 2e-4);
                rows.push(Row {
                    time_s: 0.0,
                    pressure_pa,
                    rise_m_s: way,
                    density_kg_m3,
                    temperature_degc,
                    pitch_rad,
                    roll_rad: 0.0,
                    heading_rad: 0.0,
                    ballast_m3,
                    way,
                    block: 0,
                });
            }
        }
    }
    Unit { rows, ..Unit::default() }
}

#[test]
fn sizes_on_board_are_those_of_the_catalogue() {
    let catalogue = sizes(200e-6);
    assert!((0..NUMBERS).all(|i| (f64::from(SIZES[i]) / catalogue[i] - 1.0).abs() < 1e-6), "{catalogue} {SIZES:?}");
}

#[test]
fn validate_derivatives_on_board_are_differences_of_the_host_model() {
    let vehicle = vehicles::read(Path::new("slocum-standard-sea")).expect("built in");
    let glider = Glider::new(&vehicle, 14.0, 200e-6);
    let unit = unit(&glider);
    // As the file has it, and a vehicle that is off.
    for off in [Numbers::zeros(), Numbers::from_column_slice(&[0.5, -0.4, 0.5, 0.3, -0.3, 0.4, -0.3, 0.2])] {
        let (constants, bytes) = board(&glider, &off, Wings::Standard).expect("a table");
        let table = Table::parse(&bytes, Wings::Standard).expect("parses");
        let rises = |number: usize, by: f64| {
            let mut at = off;
            at[number] += by;
            glider.rises(&unit, &glider.moved(&at))
        };
        let here = rises(0, 0.0);
        let differences: Vec<Vec<f64>> = (0..NUMBERS)
            .map(|i| rises(i, 0.05).iter().zip(rises(i, -0.05)).map(|(above, below)| (above - below) / 0.1).collect())
            .collect();
        let mut worst = [0.0_f64; NUMBERS];
        for (k, (row, rise)) in unit.rows.iter().zip(&here).enumerate() {
            let row = evidence::rows::Row {
                pressure_pa: row.pressure_pa as f32,
                rise_m_s: *rise as f32,
                density_kg_m3: row.density_kg_m3 as f32,
                temperature_degc: row.temperature_degc as f32,
                pitch_rad: row.pitch_rad as f32,
                ballast_m3: row.ballast_m3 as f32,
                ..evidence::rows::Row::default()
            };
            let said = linearise(&constants, &table, &row, 0.0).unwrap_or_else(|| panic!("no steady glide at {row:?}"));
            assert!(said.residual.abs() < 1e-3, "{} m/s at row {k}", said.residual);
            for i in 0..NUMBERS {
                // A size of a number that hardly moves the glide is compared with a millimetre a second.
                let off = (f64::from(said.by_number[i]) - differences[i][k]).abs() / differences[i][k].abs().max(1e-3);
                worst[i] = worst[i].max(off);
            }
        }
        eprintln!("largest relative differences: {worst:.4?}");
        // The table does not say which drag comes of lift: with the slope of lift it grows in the workbench's law, not on board.
        assert!((0..NUMBERS).all(|i| worst[i] < if i == SLOPE_OF_LIFT { 0.06 } else { 0.005 }), "{worst:?}");
    }
}
