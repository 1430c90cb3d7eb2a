//! The same missions through a seat: equal verdicts and equal actuator streams, or the seat changes what flies.
//!
//! One controller flies mission after mission, as a board does: recovered from
//! SAFE, given the next configuration and mission. Where a mission ends below
//! the surface the next one gets a new controller, since none leaves SAFE there.

use super::lattice::{Case, Water};
use super::{Verdict, run_through};
use crate::seats::SeatError;
use crate::seats::{self, Choice, Seat};
use anyhow::bail;
use plant::faults::Kind;
use std::path::Path;
use std::sync::Mutex;

/// Whether a case can be flown through a seat as in this process. A bad line is made in this process. A brown-out loses the
/// configuration of a board without flash, as QEMU's is; in `edge` water that is the built-in one, and nothing changes.
#[must_use]
pub fn can_fly(case: &Case, choice: &Choice) -> bool {
    let brown_out = case.faults.iter().any(|f| f.kind == Kind::BrownOut);
    let can_reset = matches!(choice, Choice::InProcess | Choice::Qemu);
    // A drawn mission may be another vehicle's than the board has on its flash.
    case.water != Water::Drawn && case.line.is_none() && (!brown_out || (can_reset && case.water == Water::Edge))
}

/// The cases to fly through a seat, `wanted` of them spread over the lattice, and every brown-out that can be flown.
#[must_use]
pub fn sample(cases: Vec<Case>, choice: &Choice, wanted: usize) -> Vec<Case> {
    let flyable: Vec<Case> = cases.into_iter().filter(|c| can_fly(c, choice)).collect();
    let brown: Vec<Case> = flyable.iter().filter(|c| c.faults.iter().any(|f| f.kind == Kind::BrownOut)).cloned().collect();
    let mut chosen = super::lattice::spread(flyable, wanted);
    chosen.extend(brown.into_iter().take(wanted.div_ceil(16)).filter(|b| !chosen.contains(b)).collect::<Vec<_>>());
    chosen
}

/// Flies what was flown here through seats of one kind, `lanes` at a time; returns what differs, here and there, in order.
///
/// # Errors
/// No such seat, or it failed.
pub fn compare(
    here: &[Verdict],
    choice: &Choice,
    elf: Option<&Path>,
    lanes: usize,
    done: &(dyn Fn() + Sync),
) -> anyhow::Result<Vec<(Verdict, Verdict)>> {
    // There is one board at a port.
    let lanes = if matches!(choice, Choice::Port(_)) { 1 } else { lanes.max(1) };
    let next = Mutex::new(here.iter().enumerate());
    let fly = || -> anyhow::Result<Vec<(usize, Verdict, Verdict)>> {
        let mut seat = seats::open(choice, elf, None)?;
        let mut different = Vec::new();
        loop {
            let Some((i, verdict)) = next.lock().ok().and_then(|mut n| n.next()) else { return Ok(different) };
            if !ready(&mut *seat)? {
                if matches!(choice, Choice::Port(_)) {
                    bail!("the board is in SAFE below the surface and stays there; reset it, then fly the sample again with another seed");
                }
                drop(seat);
                seat = seats::open(choice, elf, None)?;
            }
            let there = run_through(&verdict.case, &mut *seat)?;
            if there.hash != verdict.hash || there.end != verdict.end || there.broken != verdict.broken || there.unmet != verdict.unmet {
                different.push((i, verdict.clone(), there));
            }
            done();
        }
    };
    let mut different = Vec::new();
    std::thread::scope(|scope| {
        let lanes: Vec<_> = (0..lanes).map(|_| scope.spawn(fly)).collect();
        for lane in lanes {
            different.extend(lane.join().map_err(|_| anyhow::anyhow!("a seat's thread ended early"))??);
        }
        anyhow::Ok(())
    })?;
    different.sort_by_key(|d| d.0);
    Ok(different.into_iter().map(|(_, here, there)| (here, there)).collect())
}

/// Takes the controller out of SAFE if it is there; false: it believes itself below the surface.
fn ready(seat: &mut dyn Seat) -> anyhow::Result<bool> {
    seat.hello()?;
    match seat.recover() {
        Ok(()) => Ok(true),
        Err(SeatError::Refused { .. }) => Ok(false),
        Err(e) => Err(e.into()),
    }
}
