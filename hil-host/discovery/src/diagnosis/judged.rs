//! The dives whose error is printed: one selection for every command and page, so that they print the same figures of a flight.

use crate::likelihood::Problem;
use crate::likelihood::block_error::{Block, block_errors, blocks, modelled_m_s, rms};
use crate::model::branch::Branch;
use crate::model::parameters::State;
use crate::preprocess::dives::{MOST_FITTED, evenly};
use crate::preprocess::{Prepared, Run};
use logs::vehicle::Vehicle;

/// Blocks of the runs of some segments, each run by its place in [`Prepared::runs`].
pub type Blocks = Vec<(usize, Vec<Block>)>;

/// The blocks of a flight: fitted ones, and those kept out of the fit.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Of the segments that are fitted; of very many dives, of some spread evenly.
    pub fitted: Blocks,
    /// Of the segments kept out of the fit; empty where too few could be.
    pub kept_out: Blocks,
}

impl Judged {
    /// The blocks of a flight of which `check` are the segments kept out of the fit.
    #[must_use]
    pub fn of(prepared: &Prepared, vehicle: &Vehicle, check: &[u32]) -> Self {
        let all: Vec<&Run> = prepared.runs.iter().filter(|r| is_fitted(vehicle, check, r.segment)).collect();
        let fitted: Vec<u32> = evenly(all.len(), MOST_FITTED).into_iter().map(|i| all[i].segment).collect();
        let gather = |wanted: &[u32]| {
            prepared.runs.iter().enumerate().filter(|(_, r)| wanted.contains(&r.segment)).map(|(k, r)| (k, blocks(r))).collect()
        };
        Self { fitted: gather(&fitted), kept_out: gather(check) }
    }

    /// The blocks whose error is printed, and whether they were kept out of the fit: those, or where there are none the fitted ones.
    #[must_use]
    pub fn printed(&self) -> (&Blocks, bool) {
        let any = self.kept_out.iter().any(|(_, blocks)| !blocks.is_empty());
        if any { (&self.kept_out, true) } else { (&self.fitted, false) }
    }
}

/// Whether a segment is fitted: not kept out, and named by the vehicle file where that names any.
#[must_use]
pub fn is_fitted(vehicle: &Vehicle, check: &[u32], segment: u32) -> bool {
    !check.contains(&segment) && (vehicle.fit_segments.is_empty() || vehicle.fit_segments.contains(&segment))
}

/// Block error of the vehicle file as it stands, m/s: nothing fitted, no branch settled.
#[must_use]
pub fn as_given_m_s(prepared: &Prepared, vehicle: &Vehicle, of: &Blocks) -> f64 {
    let (branch, nominal) = (Branch::of_file(vehicle), State::nominal());
    error_m_s(prepared, of, |k| branch.track(&prepared.runs[k], vehicle, &nominal).depth_m)
}

/// Block error of a model that has the runs, by their places, at these depths, m/s.
#[must_use]
pub fn error_m_s(prepared: &Prepared, of: &Blocks, depth_m: impl Fn(usize) -> Vec<f64>) -> f64 {
    let missed = of.iter().flat_map(|(k, list)| {
        let (run, depth) = (&prepared.runs[*k], depth_m(*k));
        list.iter().map(move |b| b.observed_m_s - modelled_m_s(run, b, &depth)).collect::<Vec<_>>()
    });
    rms(missed)
}

/// Block errors of a flight on fitted and on held-out segments, m/s: as given, and at its state.
pub(crate) type ErrorsMs = [[f64; 2]; 2];

/// Whether the fitted dives of all flights have a larger error than as given, or none that is a number. Dives kept out choose nothing.
pub(crate) fn are_worse_than_the_file(all: &[ErrorsMs]) -> bool {
    let fitted = || all.iter().map(|e| e[0]).filter(|e| e[0].is_finite());
    let square = |which: usize| fitted().map(|e| e[which].powi(2)).sum::<f64>();
    !(square(1) <= square(0))
}

/// Errors of one flight.
pub(crate) fn errors_m_s(problem: &Problem, prepared: &Prepared, state: &State, blocks: &[Blocks; 2]) -> ErrorsMs {
    [0, 1].map(|i| {
        let of = &blocks[i];
        [as_given_m_s(prepared, problem.vehicle, of), block_errors(problem, prepared, &[state], of, false)[0]]
    })
}
