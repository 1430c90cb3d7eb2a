//! The board on its own parts: real drivers, models of the parts, the same water as on frames from the host.

use parts::ms5837::Model;
use plant::World;
use rig::campaign::lattice::{cases, spread};
use rig::campaign::own_parts as campaign;
use rig::flight::closed_loop::{End, Outcome, Setup, fly};
use rig::flight::{mission_file, own_parts, worlds};
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use rig::seats::parts::OwnParts;
use signals::{Mission, Wings};

fn setup(mission: &str, wings: Wings) -> (Setup, World) {
    let mission = Mission { wings, ..mission_file::built_in(mission).unwrap() };
    let world = World::new(worlds::for_mission(&mission)).unwrap();
    (Setup::new(mission), world)
}

fn on_frames(mission: &str, wings: Wings) -> Outcome {
    let (setup, mut world) = setup(mission, wings);
    fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |_| Ok(())).unwrap()
}

#[test]
fn accuracy_both_wings_glide_on_their_own_parts_as_on_frames() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for mission in ["shallow", "sea"] {
            let frames = on_frames(mission, wings);
            let (setup, world) = setup(mission, wings);
            let mut board = own_parts::board(world, &setup);
            let own = own_parts::fly(&mut board, &setup, &mut |_| Ok(()), &mut |_| {}).unwrap();
            let (said, whole, refused) = board.wire().sentences();
            println!(
                "{mission} {wings:?}: L/D {:.3} on its own parts, {:.3} on frames; {} cycles in {:.2} s; {whole} of {said} sentences",
                own.achieved_l_over_d(),
                frames.achieved_l_over_d(),
                own.cycles,
                own.wall_s
            );
            assert_eq!((own.end, own.dives), (End::Done, frames.dives), "{mission} {wings:?}");
            let ratio = own.achieved_l_over_d() / frames.achieved_l_over_d();
            assert!((ratio - 1.0).abs() < 0.02, "{mission} {wings:?}: {ratio}");
            assert!(said - u64::from(whole) <= 1 && refused == 0, "{whole} of {said}, {refused} refused");
            assert_eq!((board.wire().hangs, board.wire().resets), (0, 0));
        }
    }
}

#[test]
fn hil_fault_missions_end_on_own_parts_as_on_frames() {
    let can: Vec<_> = cases().into_iter().filter(|c| c.line.is_none() && c.faults.iter().all(campaign::can_have)).collect();
    let flown: Vec<_> = spread(can, 24).iter().map(|c| campaign::run(c).unwrap()).collect();
    let other: Vec<_> = flown.iter().filter(|b| !b.alike()).collect();
    assert!(other.is_empty(), "{other:#?}");
}

#[test]
#[ignore = "four minutes of one core"]
fn hil_five_hundred_fault_missions_end_on_own_parts_as_on_frames() {
    let can: Vec<_> = cases().into_iter().filter(|c| c.line.is_none() && c.faults.iter().all(campaign::can_have)).collect();
    let mut other = Vec::new();
    for case in spread(can, 500) {
        let both = campaign::run(&case).unwrap();
        if !both.alike() {
            println!(
                "{:?} {:?} {} {}: own {:?} ({:.0} m), frames {:?}",
                case.water,
                case.wings,
                case.seed,
                case.name(),
                both.own,
                both.max_depth_m,
                both.frames
            );
            other.push(both);
        }
    }
    assert!(other.is_empty(), "{} of 500", other.len());
}

#[test]
fn hil_no_bus_fault_hangs_the_board_or_is_read_as_a_measurement() {
    let tally = campaign::bus_faults(3_000, 1, &|_| {}).unwrap();
    println!(
        "{} faults, {} cycles, {} missions, {} of {} readings missing",
        tally.faults, tally.cycles, tally.missions, tally.missing, tally.readings
    );
    assert!(tally.passed(), "{tally:?}");
    assert!(tally.missing > 200 && tally.missing * 2 < tally.readings, "faults that are felt, and parts that come back: {tally:?}");
}

/// Bridges that switch themselves off are put to sleep and tried again; a fault line that is shorted stops no motor.
#[test]
fn hil_a_bridge_that_trips_or_its_shorted_line_ends_no_mission() {
    for shorted in [false, true] {
        let (setup, world) = setup("shallow", Wings::Standard);
        let mut board = own_parts::board(world, &setup);
        let mut cycles = 0;
        let out = own_parts::fly(&mut board, &setup, &mut |_| Ok(()), &mut |board| {
            let mut outputs = board.bench.outputs.borrow_mut();
            outputs.fault_shorted = shorted;
            // Twice in each hundred seconds, whatever moves then.
            cycles += 1;
            outputs.trips_left = if !shorted && cycles % 25 == 0 { 2 } else { outputs.trips_left };
        })
        .unwrap();
        assert_eq!(out.end, End::Done, "{shorted}: {out:?}");
    }
}

#[test]
fn a_2_bar_transducer_is_no_depth_and_a_mission_with_it_ends_afloat() {
    let (setup, world) = setup("shallow", Wings::Standard);
    let mut board = Link::new(OwnParts::with(world, setup.config.clone(), Model::Bar2));
    let mut depths = 0;
    let out = own_parts::fly(
        &mut board,
        &setup,
        &mut |c| {
            depths += u32::from(c.frame.depth_m != signals::Reading::Missing);
            Ok(())
        },
        &mut |_| {},
    )
    .unwrap();
    assert!(matches!(out.end, End::Safe(_)) && depths == 0 && out.max_depth_m < 3.0, "{out:?}");
}
