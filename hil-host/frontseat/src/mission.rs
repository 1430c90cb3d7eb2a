//! The mission that the glider flies with a backseat, as the text of its mission file.
//!
//! Only the dive's actuators are linked to parameters (an argument of 1 000 000 means parameter a, 1 000 001 b, …). The climb is the
//! glider's own: full pump, its own pitch servo. So the file is safe by itself: whatever a dead board left standing, at the target depth
//! (or when it hovers) the glider turns and comes up, and without word from shore it ends the mission at the surface. A living board
//! never lets the glider reach that depth: its climbs are flown in the glider's dive.

use anyhow::{Context, bail};
use backseat::orders::bits;
use signals::Mission;

/// An argument from here on is a link to a parameter.
pub const LINK: f64 = 1e6;
/// Pitch of the glider's own glides, rad: the default of public missions.
pub const OWN_PITCH_RAD: f64 = 0.4538;
/// A volume that clips to all the pump has, cc.
const ALL_CC: f64 = 1000.0;

/// Who flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pilot {
    /// The backseat writes the actuators.
    Backseat,
    /// The glider flies the same depths alone.
    Own,
}

/// Depth of the glider's own turn, m.
#[must_use]
pub fn own_turn_m(mission: &Mission) -> f32 {
    bay::backseat_role::own_turn_m(mission.deepest_m())
}

/// Depth from which the glider aborts, m: that of its class (31, 102, 206, 360, 1050 m in public missions).
#[must_use]
pub fn abort_depth_m(working_depth_m: f32) -> f32 {
    match working_depth_m {
        d if d <= 30.0 => 31.0,
        d if d <= 100.0 => 102.0,
        d if d <= 200.0 => 206.0,
        d if d <= 350.0 => 360.0,
        _ => 1050.0,
    }
}

/// The mission file. `no_comms_s`: without word from shore for so long the mission ends at the surface.
#[must_use]
pub fn text(mission: &Mission, pilot: Pilot, working_depth_m: f32, no_comms_s: u32) -> String {
    let abort_m = abort_depth_m(working_depth_m);
    let own_turn = own_turn_m(mission).min(abort_m - 1.5);
    let head = format!(
        "# made by glider {version}: {what}\n\
         # Safe by itself: own turn at {own_turn} m, abort at {abort_m} m, home without comms after {no_comms_s} s.\n\
         sensor: c_science_send_all(bool) 1\n\
         sensor: u_use_current_correction(nodim) 0\n",
        version = env!("CARGO_PKG_VERSION"),
        what = match pilot {
            Pilot::Backseat => "a backseat flies the dive's actuators",
            Pilot::Own => "the glider's own servo flies",
        },
    );
    let safety = safety(mission, abort_m, no_comms_s);
    match pilot {
        Pilot::Backseat => [head.as_str(), START, &safety, &surfaces_by_bits(), EXTCTL, &linked_yo()].concat(),
        Pilot::Own => [head, safety, own_yo(mission)].concat(),
    }
}

/// Start values.
const START: &str = "\
    # Until the board writes, the vehicle floats.\n\
    sensor: u_mission_param_a(X) 1000\n\
    sensor: u_mission_param_b(X) 0\n\
    sensor: u_mission_param_c(X) 0\n\
    sensor: u_mission_param_d(X) 10\n\
    sensor: u_mission_param_e(X) 2\n";

/// The program at the backseat's line.
const EXTCTL: &str = "\
    behavior: sample  # the program at the backseat's line, always on\n\
    \x20   b_arg: sensor_type(enum) 90\n\
    \x20   b_arg: state_to_sample(enum) 15\n\
    \x20   b_arg: intersample_time(sec) 0\n";

/// What brings the vehicle up whatever the board does.
fn safety(mission: &Mission, abort_m: f32, no_comms_s: u32) -> String {
    format!(
        "behavior: abend\n\
         \x20   b_arg: overdepth(m) {abort_m}\n\
         \x20   b_arg: samedepth_for(sec) 1800\n\
         \x20   b_arg: stalled_for(sec) 1800\n\
         \x20   b_arg: undervolts(volts) 10\n\
         \x20   b_arg: vacuum_min(inHg) 4\n\
         \x20   b_arg: vacuum_max(inHg) 12\n\
         \x20   b_arg: leakdetect_sample_time(sec) 60\n\
         \x20   b_arg: no_comms_tod(sec) 259200\n\
         \x20   b_arg: max_mission_time(sec) {overtime}\n\
         behavior: surface  # without comms: the end of the mission\n\
         \x20   b_arg: start_when(enum) 12\n\
         \x20   b_arg: when_secs(sec) {no_comms_s}\n\
         \x20   b_arg: end_action(enum) 0\n",
        overtime = mission.max_duration_s.saturating_add(600),
    )
}

/// Surfacings that the board asks for.
fn surfaces_by_bits() -> String {
    let bit = |bit: u32, end_action: u8, what: &str| {
        format!(
            "behavior: surface  # {what}\n\
             \x20   b_arg: start_when(enum) 15\n\
             \x20   b_arg: when_secs(sec) {bit}\n\
             \x20   b_arg: end_action(enum) {end_action}\n"
        )
    };
    [
        bit(bits::EMERGENCY, 0, "the board's emergency"),
        bit(bits::FINISH, 0, "the board's mission is over"),
        bit(bits::COMMS, 2, "the board wants fix and shore"),
    ]
    .concat()
}

/// The dive is the board's, the climb the glider's. The linked depth is bounded by the file itself: abend stands above it.
fn linked_yo() -> String {
    format!(
        "behavior: yo\n\
         \x20   b_arg: start_when(enum) 2\n\
         \x20   b_arg: num_half_cycles_to_do(nodim) -1\n\
         \x20   b_arg: d_target_depth(m) {d}\n\
         \x20   b_arg: d_use_bpump(enum) 2\n\
         \x20   b_arg: d_bpump_value(X) {a}\n\
         \x20   b_arg: d_use_pitch(enum) 1\n\
         \x20   b_arg: d_pitch_value(X) {b}\n\
         \x20   b_arg: d_stop_when_hover_for(sec) 300\n\
         \x20   b_arg: c_target_depth(m) {e}\n\
         \x20   b_arg: c_use_bpump(enum) 2\n\
         \x20   b_arg: c_bpump_value(X) {ALL_CC}\n\
         \x20   b_arg: c_use_pitch(enum) 3\n\
         \x20   b_arg: c_pitch_value(X) {OWN_PITCH_RAD}\n\
         \x20   b_arg: c_stop_when_hover_for(sec) 300\n\
         behavior: set_heading\n\
         \x20   b_arg: use_heading(enum) 4\n\
         \x20   b_arg: heading_value(X) {c}\n",
        a = LINK,
        b = LINK + 1.0,
        c = LINK + 2.0,
        d = LINK + 3.0,
        e = LINK + 4.0,
    )
}

/// The first leg's depths and pump, with the glider's own servo.
fn own_yo(mission: &Mission) -> String {
    let leg = mission.legs.first().copied().unwrap_or_default();
    let cc = f64::from(leg.ballast_m3) * 1e6;
    format!(
        "behavior: yo\n\
         \x20   b_arg: start_when(enum) 2\n\
         \x20   b_arg: num_half_cycles_to_do(nodim) {half}\n\
         \x20   b_arg: d_target_depth(m) {deep}\n\
         \x20   b_arg: d_use_bpump(enum) 2\n\
         \x20   b_arg: d_bpump_value(X) -{cc:.1}\n\
         \x20   b_arg: d_use_pitch(enum) 3\n\
         \x20   b_arg: d_pitch_value(X) -{OWN_PITCH_RAD}\n\
         \x20   b_arg: c_target_depth(m) {shallow}\n\
         \x20   b_arg: c_use_bpump(enum) 2\n\
         \x20   b_arg: c_bpump_value(X) {cc:.1}\n\
         \x20   b_arg: c_use_pitch(enum) 3\n\
         \x20   b_arg: c_pitch_value(X) {OWN_PITCH_RAD}\n\
         behavior: set_heading\n\
         \x20   b_arg: use_heading(enum) 1\n\
         \x20   b_arg: heading_value(X) {heading}\n",
        half = 2 * u32::from(leg.dives),
        deep = leg.depth_max_m,
        shallow = leg.depth_min_m.max(2.0),
        heading = leg.heading_rad,
    )
}

/// A behaviour and its arguments.
#[derive(Clone, Debug, PartialEq)]
pub struct Behaviour {
    /// Its name.
    pub name: String,
    /// Arguments in order.
    arguments: Vec<(String, f64)>,
}

impl Behaviour {
    /// An argument, if it is given.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.arguments.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }
}

/// A mission as the glider reads it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Read {
    /// Start values of sensors.
    pub sensors: Vec<(String, f64)>,
    /// Behaviours, the first with the highest priority.
    pub behaviours: Vec<Behaviour>,
}

/// Reads a mission file.
///
/// # Errors
/// Line and what is wrong with it.
pub fn read(text: &str) -> anyhow::Result<Read> {
    let mut mission = Read::default();
    for (i, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        let at = || format!("line {}: `{content}`", i + 1);
        let (kind, rest) = content.split_once(':').with_context(at)?;
        let rest = rest.trim();
        if kind == "behavior" {
            mission.behaviours.push(Behaviour { name: rest.to_owned(), arguments: Vec::new() });
            continue;
        }
        // name(unit) value
        let (name, after) = rest.split_once('(').with_context(at)?;
        let (_, value) = after.split_once(')').with_context(at)?;
        let value: f64 = value.trim().parse().with_context(at)?;
        match (kind, mission.behaviours.last_mut()) {
            ("sensor", _) => mission.sensors.push((name.to_owned(), value)),
            ("b_arg", Some(behaviour)) => behaviour.arguments.push((name.to_owned(), value)),
            _ => bail!("{}: neither sensor, behavior nor argument of one", at()),
        }
    }
    Ok(mission)
}

#[cfg(test)]
mod tests {
    use super::{LINK, Pilot, read, text};
    use signals::Mission;

    #[test]
    fn the_mission_reads_back_and_only_the_dive_is_linked() {
        let mission = read(&text(&Mission::default(), Pilot::Backseat, 100.0, 7200)).expect("reads");
        let yo = mission.behaviours.iter().find(|b| b.name == "yo").expect("a yo");
        assert_eq!(yo.get("d_bpump_value"), Some(LINK));
        assert!(yo.get("c_bpump_value").is_some_and(|cc| cc > 300.0 && cc < LINK), "the climb is the glider's own");
        let names: Vec<&str> = mission.behaviours.iter().map(|b| b.name.as_str()).collect();
        assert_eq!(names[0], "abend", "safety has the highest priority: {names:?}");
        assert!(read("behavior: yo\nb_arg: d_target_depth 3\n").is_err());
        assert!(read("b_arg: d_target_depth(m) 3\n").is_err());
    }
}
