//! Between a vehicle's history and its board: the constants that the board judges its glides by, and what its packets say.

use anyhow::Context as _;
use discovery::history::file::History;
use discovery::history::flight::{Said, by_sent, sent_one_by_one};
use discovery::history::glide::Glider;
use discovery::history::learn::Learnt;
use discovery::history::mission::SentDive;
use discovery::history::numbers::{BALLAST_OFFSET, BALLAST_SCALE, COMPRESSIBILITY, EXPANSION, NUMBERS, Numbers, PITCH_OFFSET, PITCH_SCALE};
use discovery::history::sent::Sent;
use discovery::workbench::timeline::{Followed, Mission};
use evidence::factor::WIDTH;
use evidence::{Packet, SIZES, Vehicle};
use rig::flight::tables;
use signals::{Surfacing, Wings};
use std::path::{Path, PathBuf};

/// Density at which the trim of the file is that of the board, kg/m³.
const TRIM_KG_M3: f64 = 1025.0;

/// The vehicle file that a history lies beside.
///
/// # Errors
/// There is none.
pub fn vehicle_of_history(history: &Path) -> anyhow::Result<PathBuf> {
    let mut files = ["toml", "json"].map(|e| history.with_extension(e)).into_iter().filter(|p| p.is_file());
    files.next().with_context(|| format!("{}: no vehicle file of that name beside it; name it with --vehicle", history.display()))
}

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

/// Refuses constants of a vehicle that is not that of the file: what packets say is a straight line from them.
fn of_this_vehicle(board: &Vehicle, glider: &Glider) -> anyhow::Result<()> {
    /// By so much the volume may differ (guess).
    const MOST: f64 = 0.05;
    let (on_board, file) = (f64::from(board.volume_m3), glider.hull_m3());
    anyhow::ensure!(
        (on_board / file - 1.0).abs() < MOST,
        "the board's configuration is of a hull of {:.1} kg and {:.2} L, the vehicle file has {:.2} L: write the vehicle's numbers under [hull] and upload the configuration first",
        board.mass_kg,
        1e3 * on_board,
        1e3 * file
    );
    Ok(())
}

/// A history as the board has it: counted from its constants, in its sizes.
///
/// # Errors
/// A history that does not predict itself, or that no vehicle can have.
pub fn for_board(learnt: &Learnt, glider: &Glider, board: &Vehicle) -> anyhow::Result<evidence::History> {
    of_this_vehicle(board, glider)?;
    anyhow::ensure!(learnt.predicts_itself(), "the dives of the history are not alike: it judges nothing");
    let sizes = Numbers::from_fn(|i, _| glider.sizes[i] / f64::from(SIZES[i]));
    let mean = (learnt.at + Numbers::from_column_slice(learnt.between.mean.as_slice()) - beyond_file(board, glider)).component_mul(&sizes);
    let root = learnt.between.next().cholesky().context("the history's covariance is none")?.l();
    let history = evidence::History {
        vehicle_id: board.id(),
        usual_level: learnt.usual_level as f32,
        mean: std::array::from_fn(|i| mean[i] as f32),
        spread: std::array::from_fn(|i| std::array::from_fn(|k| (root[(i, k)] * sizes[i]) as f32)),
    };
    anyhow::ensure!(history.encode().is_some(), "the history is a hundred sizes from the constants on board: not of this vehicle");
    Ok(history)
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

/// Packets as one vehicle's: what they say, in its sizes and counted from its file.
struct Packets {
    glider: Glider,
    /// Place in the list of messages, place in the file, packet, what it says.
    all: Vec<(usize, String, Packet, Sent)>,
}

impl Judge<'_> {
    /// The packets of messages; none where no message has one.
    fn read(&self, messages: &[(String, Surfacing)]) -> anyhow::Result<Option<Packets>> {
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
        let drive_m3 = self.history.map(|h| h.0.head.drive_m3).or_else(|| read.first().map(|p| f64::from(p.2.drive_m3)));
        let Some(drive_m3) = drive_m3.filter(|_| !read.is_empty()) else { return Ok(None) };
        let reference_degc = self.history.map_or(self.vehicle.constants.reference_temperature_degc, |h| h.0.head.reference_degc);
        let glider = Glider::new(self.vehicle, reference_degc, drive_m3);
        if let Some(board) = &self.board {
            of_this_vehicle(board, &glider)?;
        }
        let origin = self.board.map_or_else(Numbers::zeros, |board| beyond_file(&board, &glider));
        let of = |(k, place, packet): (usize, String, Packet)| {
            let mut sent = sent(&packet, &glider);
            sent.count_from(&-origin);
            (k, place, packet, sent)
        };
        let all = read.into_iter().map(of).collect();
        Ok(Some(Packets { glider, all }))
    }

    /// What each message of a mission says, in the order of time; none of one without a packet, or that nothing judges.
    ///
    /// # Errors
    /// A packet of other constants, or one that no dive can give.
    pub fn judge(&self, messages: &[(String, Surfacing)]) -> anyhow::Result<Vec<Option<Said>>> {
        let mut out = vec![None; messages.len()];
        let Some(Packets { glider, all }) = self.read(messages)? else { return Ok(out) };
        let places: Vec<usize> = all.iter().map(|p| p.0).collect();
        let all: Vec<(String, Sent)> = all.into_iter().map(|(_, place, _, sent)| (place, sent)).collect();
        let said = match self.history {
            Some((history, name)) => all.chunks(1).map(|one| by_sent(history, name, one, self.vehicle)).collect(),
            None => sent_one_by_one(&all, &glider),
        };
        places.into_iter().zip(said).for_each(|(k, said)| out[k] = said);
        Ok(out)
    }

    /// What all messages say together, as the dives of a flight do; without a history what the last says beside those before it.
    ///
    /// # Errors
    /// As of [`Judge::judge`], or nothing to judge or to judge by.
    pub fn together(&self, messages: &[(String, Surfacing)]) -> anyhow::Result<Said> {
        let Packets { glider, all } = self.read(messages)?.context("no message has a packet of the glides")?;
        let all: Vec<(String, Sent)> = all.into_iter().map(|(_, place, _, sent)| (place, sent)).collect();
        let said = match self.history {
            Some((history, name)) => by_sent(history, name, &all, self.vehicle),
            None => sent_one_by_one(&all, &glider).pop().flatten(),
        };
        said.with_context(|| format!("{} packets and no history: three before the one that is judged are needed", all.len()))
    }

    /// The messages of a mission, in the order of time, as its dives. A clock that began anew goes on where it ended.
    ///
    /// # Errors
    /// As of [`Judge::judge`], or no packet.
    pub fn mission(&self, messages: &[(String, Surfacing)]) -> anyhow::Result<Mission> {
        let Packets { glider, all } = self.read(messages)?.context("no message has a packet of the glides")?;
        let mut notes = Vec::new();
        if all.len() < messages.len() {
            notes.push(format!("{} of {} surfacings have no packet of the glides: left out", messages.len() - all.len(), messages.len()));
        }
        let (mut zero_s, mut end_s) = (-all.first().map_or(0.0, |p| f64::from(p.2.start_s)), 0.0);
        let one = |(k, place, packet, sent): (usize, String, Packet, Sent)| {
            let mut start_s = zero_s + f64::from(packet.start_s);
            if start_s < end_s {
                (zero_s, start_s) = (end_s - f64::from(packet.start_s), end_s);
            }
            end_s = start_s + f64::from(packet.duration_s);
            let depth_m = f64::from(messages[k].1.deepest_m);
            let dive = Followed { flight: place.clone(), segment: k as u32, depth_m, rows: usize::from(packet.rows) };
            (dive, SentDive { id: place, start_s, pitch_rad: f64::from(packet.pitch_rad), sent })
        };
        Ok(Mission::of_sent(self.vehicle, glider, all.into_iter().map(one).collect(), notes))
    }
}
