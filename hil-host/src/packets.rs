//! Between a vehicle's history and its board: the constants that the board judges its glides by, and what its packets say.

use discovery::history::file::History;
use discovery::history::flight::{Said, by_sent, sent_one_by_one};
use discovery::history::glide::Glider;
use discovery::history::numbers::{BALLAST_OFFSET, BALLAST_SCALE, COMPRESSIBILITY, EXPANSION, NUMBERS, Numbers, PITCH_OFFSET, PITCH_SCALE};
use discovery::history::sent::Sent;
use evidence::factor::WIDTH;
use evidence::{Packet, SIZES, Vehicle};
use rig::flight::tables;
use signals::{Surfacing, Wings};

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

/// How far the constants on board are from the numbers of the vehicle file, in sizes. Drag and lift are those of its table: the file's.
#[must_use]
pub fn beyond_file(board: &Vehicle, glider: &Glider) -> Numbers {
    let claims = glider.claims();
    let mut out = Numbers::zeros();
    let v = board;
    out[BALLAST_OFFSET] = f64::from(v.mass_kg) - TRIM_KG_M3 * f64::from(v.volume_m3);
    out[COMPRESSIBILITY] = f64::from(v.compressibility_per_pa);
    out[EXPANSION] = f64::from(v.expansion_per_k);
    out[PITCH_OFFSET] = f64::from(v.pitch_offset_rad);
    out[PITCH_SCALE] = f64::from(v.pitch_gain).ln();
    out[BALLAST_SCALE] = f64::from(v.ballast_gain).ln();
    for i in [BALLAST_OFFSET, COMPRESSIBILITY, EXPANSION, PITCH_OFFSET, PITCH_SCALE, BALLAST_SCALE] {
        out[i] = (out[i] - claims[i]) / glider.sizes[i];
    }
    out
}

/// What judges the packets of surfacings: a vehicle and its history, or its own earlier surfacings, and the constants on board.
pub struct Judge<'a> {
    /// Vehicle file.
    pub vehicle: &'a logs::Vehicle,
    /// Its history, and the history's name.
    pub history: Option<(&'a History, &'a str)>,
    /// Constants that the board judges by; none: those of the vehicle file.
    pub board: Option<Vehicle>,
}

impl Judge<'_> {
    /// What each message of a mission says, in the order of time; none of one without a packet, or that nothing judges.
    ///
    /// # Errors
    /// A packet of other constants, or one that no dive can give.
    pub fn judge(&self, messages: &[(String, Surfacing)]) -> anyhow::Result<Vec<Option<Said>>> {
        let mut read = Vec::new();
        for (k, (place, message)) in messages.iter().enumerate() {
            let Some(bytes) = &message.packet else { continue };
            let packet = Packet::decode(bytes).map_err(|_| anyhow::anyhow!("{place}: its packet has a number that no dive can give"))?;
            if let Some(board) = &self.board {
                anyhow::ensure!(
                    board.id() == packet.vehicle_id,
                    "{place}: the board judges by the constants {:08x}, the configuration has {:08x}; name the one that was flown",
                    packet.vehicle_id,
                    board.id()
                );
            }
            read.push((k, place.clone(), packet));
        }
        let mut out = vec![None; messages.len()];
        let Some(drive_m3) = self.history.map(|h| h.0.head.drive_m3).or_else(|| read.first().map(|p| f64::from(p.2.drive_m3))) else {
            return Ok(out);
        };
        let reference_degc = self.history.map_or(self.vehicle.constants.reference_temperature_degc, |h| h.0.head.reference_degc);
        let glider = Glider::new(self.vehicle, reference_degc, drive_m3);
        let origin = self.board.map_or_else(Numbers::zeros, |board| beyond_file(&board, &glider));
        let all = read.iter().map(|(_, place, packet)| {
            let mut sent = sent(packet, &glider);
            sent.count_from(&-origin);
            (place.clone(), sent)
        });
        let all: Vec<(String, Sent)> = all.collect();
        let said = match self.history {
            Some((history, name)) => all.into_iter().map(|(unit, sent)| Some(by_sent(history, name, &unit, sent, self.vehicle))).collect(),
            None => sent_one_by_one(&all, &glider),
        };
        read.iter().zip(said).for_each(|((k, ..), said)| out[*k] = said);
        Ok(out)
    }
}
