//! Between a vehicle's history and its board: the constants that the board judges its glides by, and what its packets say.

use discovery::history::glide::Glider;
use discovery::history::numbers::{BALLAST_OFFSET, BALLAST_SCALE, COMPRESSIBILITY, EXPANSION, NUMBERS, Numbers, PITCH_OFFSET, PITCH_SCALE};
use discovery::history::sent::Sent;
use evidence::factor::WIDTH;
use evidence::{Packet, SIZES, Vehicle};
use rig::flight::tables;
use signals::Wings;

/// Density at which the trim of the file is that of the board, kg/m³.
const TRIM_KG_M3: f64 = 1025.0;

/// Constants and table of a vehicle whose numbers are `x` sizes beyond its file, as its board has them.
///
/// # Errors
/// No table follows from such a vehicle.
pub fn board(glider: &Glider, x: &Numbers, wings: Wings) -> anyhow::Result<(Vehicle, Vec<u8>)> {
    let by = glider.moved(x);
    let claims = glider.claims();
    let hull_m3 = glider.hull_m3();
    let pitch_gain = by[PITCH_SCALE].exp();
    let vehicle = Vehicle {
        mass_kg: (TRIM_KG_M3 * hull_m3 + claims[BALLAST_OFFSET] + by[BALLAST_OFFSET]) as f32,
        volume_m3: hull_m3 as f32,
        compressibility_per_pa: (claims[COMPRESSIBILITY] + by[COMPRESSIBILITY]) as f32,
        expansion_per_k: (claims[EXPANSION] + by[EXPANSION]) as f32,
        reference_degc: glider.reference_degc as f32,
        ballast_gain: (claims[BALLAST_SCALE] + by[BALLAST_SCALE]).exp() as f32,
        pitch_gain: (pitch_gain * claims[PITCH_SCALE].exp()) as f32,
        pitch_offset_rad: (pitch_gain * claims[PITCH_OFFSET] + by[PITCH_OFFSET]) as f32,
    };
    Ok((vehicle, tables::build(&glider.forces(&by), wings, 0, 0)?.bytes))
}

/// What a packet says, in the sizes of a vehicle's history, counted from the constants on board.
#[must_use]
pub fn sent(packet: &Packet, glider: &Glider) -> Sent {
    let lines: [[f64; WIDTH]; NUMBERS] = packet.lines.map(|line| line.map(f64::from));
    let board = Numbers::from_fn(|i, _| f64::from(SIZES[i]));
    let scatter = (f64::from(packet.scatter), f64::from(packet.directions));
    Sent::new(&lines, &board, &glider.sizes, scatter, f64::from(packet.variance))
}
