//! One flight on the vehicle's own parts: the board measures and moves by itself, nobody sends it frames.

use crate::flight::closed_loop::{FlightError, Setup, is_finite};
use crate::flight::cycle::Cycle;
use crate::flight::outcome::{Course, Outcome};
use crate::seats::parts::OwnParts;
use crate::seats::{Link, Seat, SeatError};
use plant::World;

/// Longest time between two cycles of a board that works, s: three and a reset.
const SILENT_S: f64 = 30.0;

/// A board for this mission, switched on in this world.
#[must_use]
pub fn board(world: World, setup: &Setup) -> Link<OwnParts> {
    Link::new(OwnParts::new(world, crate::flight::worlds::config(&setup.mission)))
}

/// Launches a mission and flies it to its end. `watch` sees every cycle; `between` may disturb the bench after it.
///
/// # Errors
/// The board refuses, falls silent, or `watch` fails.
pub fn fly(
    link: &mut Link<OwnParts>,
    setup: &Setup,
    watch: &mut dyn FnMut(&Cycle<'_>) -> anyhow::Result<()>,
    between: &mut dyn FnMut(&OwnParts),
) -> Result<Outcome, FlightError> {
    let manifest = link.hello()?;
    link.configure(&manifest, &setup.config)?;
    if let Some(table) = &setup.table {
        link.tabulate(setup.mission.wings, table)?;
    }
    let table_id = link.launch(&setup.mission)?;
    let board = link.wire();
    let mut course = Course::new(&board.around.borrow().world, table_id, setup.limit_s);
    let start_s = board.around.borrow().world.time_s();
    let end = loop {
        let made = board.cycle(SILENT_S).ok_or_else(|| SeatError::NoAnswer {
            asked: "its next cycle",
            seat: "the board on its own parts".to_owned(),
            waited_s: SILENT_S as u64,
            heard: Default::default(),
        })?;
        let time_s = board.around.borrow().world.time_s() - start_s;
        is_finite(time_s, &made.truth, board.around.borrow().world.scenario())?;
        let cycle = Cycle { time_s, frame: &made.frame, answer: &made.answer, truth: &made.truth, resets: board.resets };
        let end = course.take(&cycle);
        watch(&cycle).map_err(FlightError::Watcher)?;
        if let Some(end) = end {
            break end;
        }
        board.around.borrow_mut().world.observe_phase(made.answer.trace.phase);
        between(board);
    };
    Ok(course.ended(end))
}
