//! Which branch the model is on where its law of lift ends: how lift goes on beyond the valid angle of attack, whether launches end in
//! a glide.

use crate::model::dynamics::{Job, Track, see_from_port};
use crate::model::integrator::tracks;
use crate::model::parameters::{State, law, sensor_errors};
use crate::preprocess::{FLOAT_M, Run};
use hydro::effects::Continuation;
use logs::vehicle::Vehicle;
use serde_json::{Value, json};
use std::borrow::Cow;

/// How long a launch may take to attach, s: 60 to 120 serve simulated flights alike.
pub(crate) const HELD_S: f64 = 90.0;
/// A stall sinks faster or slower than a glide by more than this, m/s: a tenth of a glide's 0.1 to 0.2.
const STALL_M_S: f64 = 0.01;
pub(crate) const BOTH: [Continuation; 2] = [Continuation::Rising, Continuation::Fading];

/// From when to when, s.
pub(crate) type Stretch = (f64, f64);

/// Which branch a model takes where its law of lift ends or knows nothing: what the fitted runs have shown of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Branch {
    /// How lift goes on beyond the valid angle of attack.
    pub continuation: Continuation,
    /// Whether launches end in a glide: of those after which the calibrated model may stall, at least half are seen to.
    pub glides: bool,
}

impl Branch {
    /// What a refit has settled and written into the vehicle file ([`Branch::document`]); the default where none has.
    #[must_use]
    pub(crate) fn of_file(vehicle: &Vehicle) -> Self {
        let said = &vehicle.document["provenance"]["branch"];
        let continuation = if said["continuation"] == "fading" { Continuation::Fading } else { Continuation::Rising };
        Self { continuation, glides: said["launches_glide"] == true }
    }

    /// The same for a vehicle file.
    #[must_use]
    pub(crate) fn document(self) -> Value {
        let continuation = if self.continuation == Continuation::Fading { "fading" } else { "rising" };
        json!({"continuation": continuation, "launches_glide": self.glides})
    }

    /// Of what both continuations give, in the order of [`BOTH`]: that of the one in force, and the other's.
    pub(crate) fn in_force<T>(self, [rising, fading]: [T; 2]) -> [T; 2] {
        if self.continuation == Continuation::Fading { [fading, rising] } else { [rising, fading] }
    }

    /// Runs the model over a run of which nothing but its inputs is known. Where it depends on the continuation whether a launch ends
    /// in a stall, it ends as the launches of the fitted runs did; the vehicle as its file gives it knows of none.
    #[must_use]
    pub fn track(self, run: &Run, vehicle: &Vehicle, state: &State) -> Track {
        self.tracks(run, vehicle, &[state]).pop().unwrap_or_default()
    }

    /// The same at several states: they are simulated side by side.
    #[must_use]
    pub fn tracks(self, run: &Run, vehicle: &Vehicle, states: &[&State]) -> Vec<Track> {
        let laws: Vec<_> = states.iter().map(|s| law(vehicle, s)).collect();
        let sensors: Vec<_> = states.iter().map(|s| sensor_errors(vehicle, s)).collect();
        let with = |which: &[usize], c: Continuation, attached: &[Stretch]| {
            let job =
                |&k: &usize| Job { run, constants: laws[k].0, effects: Cow::Borrowed(&laws[k].1), attached, clock_s: sensors[k].clock_s };
            let mut out = tracks(&which.iter().map(job).collect::<Vec<_>>(), vehicle.water_depth_m, c);
            out.iter_mut().zip(which).for_each(|(t, k)| see_from_port(run, t, sensors[*k].port_m));
            out
        };
        let [mine, other] = self.in_force(BOTH);
        let mut out = with(&(0..states.len()).collect::<Vec<_>>(), mine, &[]);
        let Some(launch) = launch(run).filter(|_| self.glides) else { return out };
        let refitted = Self::of_file(vehicle).glides;
        let calibrated: Vec<usize> = (0..states.len()).filter(|&k| refitted || !states[k].is_nominal()).collect();
        let others = with(&calibrated, other, &[]);
        let late: Vec<usize> = (0..run.time_s.len()).filter(|&row| run.time_s[row] > launch.1).collect();
        let differ = |a: &Track, b: &Track| late.iter().any(|&row| (a.sink_m_s[row] - b.sink_m_s[row]).abs() > STALL_M_S);
        let undecided: Vec<usize> =
            calibrated.into_iter().zip(&others).filter(|(k, other)| differ(&out[*k], other)).map(|(k, _)| k).collect();
        let held = with(&undecided, mine, &[launch]);
        undecided.into_iter().zip(held).for_each(|(k, track)| out[k] = track);
        out
    }
}

/// From when to when the launch of a run takes, if it has one.
pub(crate) fn launch(run: &Run) -> Option<Stretch> {
    let under = run.inputs.iter().position(|i| i.depth_m > FLOAT_M).filter(|_| run.starts_afloat)?;
    let from = run.time_s.first()? + 0.5 * run.step_s * under as f64;
    Some((from, from + HELD_S))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// What a refit has settled comes back from the file that it wrote, so that whoever flies the file flies as the fit did.
    #[test]
    fn regress_a_branch_comes_back_from_the_vehicle_file() {
        let text = include_str!("../../../../vehicles/modena.toml");
        let mut document: Value = toml::from_str(text).expect("reads");
        let file = |d: &Value| logs::vehicle::parse(d.clone(), Path::new("v.json")).expect("a vehicle");
        assert_eq!(Branch::of_file(&file(&document)), Branch::default());
        for continuation in BOTH {
            let settled = Branch { continuation, glides: true };
            document["provenance"] = json!({"branch": settled.document()});
            assert_eq!(Branch::of_file(&file(&document)), settled);
        }
    }
}
