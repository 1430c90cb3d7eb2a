//! One mission through every seat: the commands must be the same to the bit.

use plant::World;
use rig::flight::closed_loop::{End, Outcome, Setup, fly};
use rig::flight::{mission_file, worlds};
use rig::seats::{self, Choice, qemu};
use signals::{Mission, Wings};

fn flown(choice: &Choice, wings: Wings, mission: &str) -> Outcome {
    let mission = Mission { wings, ..mission_file::built_in(mission).unwrap() };
    let mut seat = seats::open(choice, None, None).unwrap();
    let mut world = World::new(worlds::for_mission(&mission)).unwrap();
    fly(&mut world, &mut *seat, &Setup::new(mission), &mut |_| Ok(())).unwrap()
}

/// The image under test; says loudly why not.
fn image_in_qemu() -> bool {
    if !qemu::is_installed() {
        println!("skipped: no qemu-system-arm on this machine (scripts/setup-target installs it)");
        return false;
    }
    if let Err(e) = qemu::find_image() {
        println!("skipped: {e:#}");
        return false;
    }
    true
}

#[test]
fn hil_the_actuator_stream_is_the_same_in_process_pty_and_qemu() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let direct = flown(&Choice::InProcess, wings, "shallow");
        assert_eq!((direct.end, direct.dives), (End::Done, 4));
        let serial = flown(&Choice::Pty, wings, "shallow");
        assert_eq!(direct.actuator_hash, serial.actuator_hash, "{wings:?}: in-process and pty");
        if image_in_qemu() {
            let image = flown(&Choice::Qemu, wings, "shallow");
            assert_eq!(direct.actuator_hash, image.actuator_hash, "{wings:?}: in-process and the image in QEMU");
            assert_eq!((image.end, image.table_id), (direct.end, direct.table_id));
        }
    }
}

#[test]
fn equal_seeds_give_equal_flights_and_other_seeds_others() {
    let fly_seed = |seed| {
        let mission = mission_file::built_in("shallow").unwrap();
        let mut seat = seats::open(&Choice::InProcess, None, None).unwrap();
        let mut world = World::new(plant::Scenario { seed, ..worlds::for_mission(&mission) }).unwrap();
        fly(&mut world, &mut *seat, &Setup::new(mission), &mut |_| Ok(())).unwrap().actuator_hash
    };
    assert_eq!(fly_seed(1), fly_seed(1));
    assert_ne!(fly_seed(1), fly_seed(2));
}

#[test]
fn each_built_in_mission_is_flown_to_its_end() {
    for (mission, dives) in [("shallow", 4), ("sea", 2), ("deep", 1)] {
        let out = flown(&Choice::InProcess, Wings::Standard, mission);
        assert_eq!((out.end, out.dives), (End::Done, dives), "{mission}");
        assert!(out.achieved_l_over_d() > 1.0, "{mission}: {}", out.achieved_l_over_d());
    }
}
