//! Packets of surfacings against full logs: the dives of real missions replayed through the code that flies, errors injected, and
//! whether the same history says the same of both.

use discovery::history::flight::sent_one_by_one;
use discovery::history::judge::{Judgement, judge, judge_summary};
use discovery::history::learn::{Learnt, linear_about};
use discovery::history::numbers::{DRAG_LEVEL, Numbers, SLOPE_OF_LIFT};
use discovery::history::rows::Unit;
use discovery::history::summary::Summary;
use evidence::{Detector, Dives, PACKET_BYTES, Packet, SIZES};
use helm::glides::{PA_PER_M, cycle, is_enough};
use logs::Flight;
use polar::Table;
use serde::Serialize;
use signals::{Micros, Phase, Reading, SensorFrame, Wings};

use super::missions::{ERRORS, Error, Histories, Mission, Share, injected, names, part_of, spread};
use crate::packets::{board, for_board, sent};

/// Units that errors are injected into.
const REPLAYED: usize = 8;
/// Quiet surfacings that a mission's own history is learnt from.
const MOST_CONTROLS: usize = 24;

/// The frames of a part of a log, as the board would have them: at each pressure what the other sensors said last, with its age.
fn frames(part: &Flight) -> Vec<SensorFrame> {
    let columns = [&part.pitch_rad, &part.roll_rad, &part.ballast_m3, &part.density_kg_m3, &part.temperature_degc];
    let mut last = [None; 5];
    let mut out = Vec::new();
    let begin_s = part.time_s.first().copied().unwrap_or(0.0);
    let mut before_s = f64::NEG_INFINITY;
    for (i, (&t, &p)) in part.time_s.iter().zip(&part.pressure_pa).enumerate() {
        for (last, column) in last.iter_mut().zip(columns) {
            if column[i].is_finite() {
                *last = Some((t, column[i]));
            }
        }
        if !p.is_finite() || t - before_s < 0.2 {
            continue;
        }
        before_s = t;
        let [pitch_rad, roll_rad, ballast_m3, density_kg_m3, temperature_degc] = last.map(|of| match of {
            Some((at, value)) => Reading::Sampled { value: value as f32, age_ms: ((t - at) * 1e3) as u32 },
            None => Reading::Missing,
        });
        let (time, depth_m) = (Micros(((t - begin_s) * 1e6) as u64), Reading::now(p as f32 / PA_PER_M));
        let frame =
            SensorFrame { time, depth_m, pitch_rad, roll_rad, ballast_m3, density_kg_m3, temperature_degc, ..SensorFrame::default() };
        out.push(frame);
    }
    out
}

/// Puts an error of the log into frames, as [`injected`] does into rows.
fn spoil(frames: &mut [SensorFrame], error: Error, share: f64, drive_m3: f64) {
    let drive = (drive_m3 / 200e-6).min(1.0);
    for frame in frames {
        let (Reading::Sampled { value: pitch_rad, .. }, Reading::Sampled { value: ballast_m3, .. }) =
            (&mut frame.pitch_rad, &mut frame.ballast_m3)
        else {
            continue;
        };
        match error {
            Error::PitchOffset(by) => *pitch_rad += (share * by) as f32,
            Error::PitchScale(by) => *pitch_rad *= (1.0 + share * by) as f32,
            Error::Ballast(by) => *ballast_m3 += (share * by * drive) as f32,
            Error::BallastScale(by) => *ballast_m3 *= (1.0 + share * by) as f32,
            Error::Drag(_) | Error::Compressibility(_) | Error::Expansion(_) => {}
        }
    }
}

/// What is said of one dive: by the full log, what its own summary says without being linearised anew, and what the packet says.
struct Three {
    log: Judgement,
    summary: Judgement,
    exact: Judgement,
    packet: Judgement,
}

/// The packet of frames as it comes off the wire.
fn packet(histories: &Histories<'_>, frames: &[SensorFrame], claimed: &Numbers) -> Option<(Packet, Packet)> {
    let (vehicle, bytes) = board(&histories.glider, claimed, Wings::Standard).ok()?;
    let table = Table::parse(&bytes, Wings::Standard).ok()?;
    let mut dives = Dives::new();
    for frame in frames {
        match cycle(frame, Phase::Dive) {
            Some(cycle) => dives.take(&vehicle, &table, &cycle),
            None => dives.interrupt(),
        }
    }
    let made = dives.packet(0);
    let bytes: [u8; PACKET_BYTES] = made.encode()?;
    Some((made, Packet::decode(&bytes).ok()?))
}

fn judged(histories: &Histories<'_>, history: &Learnt, unit: &Unit, frames: &[SensorFrame], claimed: &Numbers) -> Option<Three> {
    let glider = &histories.glider;
    let linear = linear_about(unit, glider, claimed, &Numbers::zeros());
    let own = Summary::of(&linear, linear.own_level(Some(history.usual_level)));
    let (made, read) = packet(histories, frames, claimed)?;
    let of = |p: &Packet| judge_summary(&sent(p, glider).summary(Some(history.usual_level)), history);
    Some(Three { log: judge(unit, glider, history, claimed), summary: judge_summary(&own, history), exact: of(&made), packet: of(&read) })
}

/// How often the others say what the full log says.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Agreement {
    /// The log's summary, not linearised anew: the same verdict (quiet, or a name in common).
    pub summary: Share,
    /// The packet before it is bytes.
    pub exact: Share,
    /// The packet.
    pub packet: Share,
    /// The packet's class is the log's, name for name.
    pub same_class: Share,
    /// Right names of the log, and of the packet.
    pub right: [Share; 2],
    /// Where packet and log differ.
    pub differ: Vec<String>,
}

fn agrees(a: &Judgement, b: &Judgement) -> bool {
    if a.class.is_empty() { b.class.is_empty() } else { a.class.iter().any(|i| b.class.contains(i)) }
}

impl Agreement {
    fn count(&mut self, what: &str, three: &Three, number: Option<usize>) {
        let Three { log, summary, exact, packet } = three;
        self.summary.count(agrees(log, summary));
        self.exact.count(agrees(log, exact));
        self.packet.count(agrees(log, packet));
        let sorted = |j: &Judgement| {
            let mut class = j.class.clone();
            class.sort_unstable();
            class
        };
        self.same_class.count(sorted(log) == sorted(packet));
        if let Some(number) = number {
            self.right[0].count(log.class.contains(&number));
            self.right[1].count(packet.class.contains(&number));
        }
        if !agrees(log, packet) {
            let of = |j: &Judgement| {
                let most = j.ln_bayes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                format!("{} ({most:.1})", names(&j.class).join("+"))
            };
            self.differ.push(format!("{what}: log {}, summary {}, exact {}, packet {}", of(log), of(summary), of(exact), of(packet)));
        }
    }
}

/// Untouched segments, and errors of both sizes, of a mission with so many controls.
#[must_use]
pub fn agreement(mission: &Mission, controls: usize) -> [Agreement; 2] {
    let mut histories = Histories::new(mission, controls);
    let (mut untouched, mut errors) = (Agreement::default(), Agreement::default());
    let judged_units: Vec<usize> = (controls..mission.units.len()).collect();
    for &i in &judged_units {
        let unit = &mission.units[i];
        let history = histories.before(i).clone();
        let Some((part, _)) = part_of(mission, unit) else { continue };
        if let Some(three) = judged(&histories, &history, unit, &frames(&part), &history.at) {
            untouched.count(&unit.id, &three, None);
        }
    }
    for i in spread(&judged_units, REPLAYED) {
        let history = histories.before(i).clone();
        let Some((part, _)) = part_of(mission, &mission.units[i]) else { continue };
        for share in [1.0, 0.5] {
            for error in ERRORS {
                let (unit, claimed, _) = injected(&mission.units[i], &history.at, &histories.glider, error, share);
                let mut spoilt = frames(&part);
                spoil(&mut spoilt, error.1, share, histories.glider.drive_m3);
                if let Some(three) = judged(&histories, &history, &unit, &spoilt, &claimed) {
                    errors.count(&format!("{} {} x{share}", unit.id, error.0), &three, Some(error.2));
                }
            }
        }
    }
    [untouched, errors]
}

/// What the detector on board says of a mission after the dives that its history was learnt from.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Detected {
    /// Surfacings as they were, and alarms in them.
    pub quiet: Share,
    /// Of a vehicle with half as much drag again from one surfacing on, each in turn: alarms in its first or second.
    pub in_two: Share,
}

/// Replays the detector over a mission of which the first dives, so many, are its history.
///
/// # Errors
/// A history that is none for a board.
pub fn detected(mission: &Mission, controls: usize) -> anyhow::Result<Detected> {
    let mut histories = Histories::new(mission, controls);
    let learnt = histories.before(controls).clone();
    let (glider, from) = (&histories.glider, histories.from);
    let (vehicle, _) = board(glider, &from, Wings::Standard)?;
    let mut known = for_board(&learnt, glider, &vehicle)?;
    // The table on board has the drag and lift of the first dives, not those of the file.
    for i in [DRAG_LEVEL, SLOPE_OF_LIFT] {
        known.mean[i] -= (from[i] * glider.sizes[i] / f64::from(SIZES[i])) as f32;
    }
    let packets = |more_drag: f64| -> Vec<Packet> {
        let mut claimed = from;
        claimed[DRAG_LEVEL] -= more_drag.ln_1p() / glider.sizes[DRAG_LEVEL];
        let parts = mission.units.iter().skip(controls).filter_map(|unit| part_of(mission, unit));
        let made = parts.filter_map(|(part, _)| packet(&histories, &frames(&part), &claimed));
        // One vehicle, whatever the table that it is given has of its drag.
        made.map(|(made, _)| Packet { vehicle_id: known.vehicle_id, ..made }).filter(is_enough).collect()
    };
    let (sound, fouled) = (packets(0.0), packets(0.5));
    let mut out = Detected::default();
    let mut detector = Detector::new();
    for (i, packet) in sound.iter().enumerate() {
        let mut from_here = detector;
        out.in_two.count(fouled.iter().skip(i).take(2).any(|p| from_here.take(&known, p)));
        out.quiet.count(detector.take(&known, packet));
    }
    Ok(out)
}

/// Names in each surfacing of a mission judged from its packets alone, by the quiet surfacings before it; none of the first three. From
/// unit `event` on the vehicle has half as much drag again as the table on board says.
#[must_use]
pub fn from_packets_alone(mission: &Mission, event: usize) -> Vec<Option<Vec<String>>> {
    let histories = Histories::new(mission, MOST_CONTROLS);
    let mut all = Vec::new();
    for (i, unit) in mission.units.iter().enumerate() {
        let mut claimed = histories.from;
        if i >= event {
            claimed[DRAG_LEVEL] -= 1.5_f64.ln() / histories.glider.sizes[DRAG_LEVEL];
        }
        let Some((part, _)) = part_of(mission, unit) else { continue };
        if let Some((_, read)) = packet(&histories, &frames(&part), &claimed) {
            all.push((unit.id.clone(), sent(&read, &histories.glider)));
        }
    }
    let said = sent_one_by_one(&all, &histories.glider);
    said.into_iter().map(|said| said.map(|s| names(&s.judgement.class))).collect()
}
