//! Ways between GPS fixes over several dives without a surfacing between them.

use crate::preprocess::Run;
use crate::preprocess::fixes::Displacement;

/// Finds the ways over several runs: one with fixes before it only, others that follow at once without any, one with fixes after it
/// only. Each run is told its part of the time.
pub(crate) fn displacements(runs: &mut [Run], gps_noise_m: f64) -> Vec<Displacement> {
    let mut displacements = Vec::new();
    let mut first = None;
    for k in 0..runs.len() {
        let follows = k > 0 && runs[k].first_row == runs[k - 1].first_row + runs[k - 1].time_s.len();
        match runs[k].fixes {
            [Some(start), None] => first = Some((k, start)),
            [None, None] if follows => {}
            [None, Some(end)] if follows => {
                let Some((begin, start)) = first.take() else { continue };
                let between = &mut runs[begin..=k];
                if between.iter().any(|r| r.blind) {
                    continue;
                }
                for run in between {
                    let (from, to) = (run.time_s[0], run.time_s[run.time_s.len() - 1]);
                    run.displacement_s = to.min(end.time_s) - from.max(start.time_s);
                }
                displacements.push(Displacement { runs: begin..k + 1, displacement_m: start.to(&end, gps_noise_m) });
            }
            _ => first = None,
        }
    }
    displacements
}
