//! A sample of the fault campaign through the flight image in QEMU: the same verdicts and the same commands as in process.
//! The whole proof is `glider faults --seat qemu --sample 200`. Four quarters of the sample are a test each.

use plant::faults::Kind;
use rig::campaign::lattice::cases;
use rig::campaign::{Verdict, run, through_seat};
use rig::seats::{Choice, qemu};

/// Every fourth case of the sample, from `first` on.
fn ends_alike(first: usize) {
    if !qemu::is_installed() {
        println!("skipped: no qemu-system-arm on this machine (scripts/setup-target installs it)");
        return;
    }
    if let Err(e) = qemu::find_image() {
        println!("skipped: {e:#}");
        return;
    }
    let sample = through_seat::sample(cases(), &Choice::Qemu, 16);
    assert!(sample.len() >= 16 && sample.iter().any(|c| c.faults.iter().any(|f| f.kind == Kind::BrownOut)), "a reset of the chip is in it");
    let here: Vec<_> = sample.iter().skip(first).step_by(4).map(|c| run(c).unwrap()).collect();
    let wrong: Vec<_> = here.iter().filter(|v| v.wrong()).map(Verdict::document).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
    let different = through_seat::compare(&here, &Choice::Qemu, None, 2, &|| {}).unwrap();
    let different: Vec<_> = different.iter().map(|(here, there)| (here.document(), there.document())).collect();
    assert!(different.is_empty(), "{different:#?}");
}

#[test]
fn hil_fault_campaign_ends_alike_in_the_image_first_quarter() {
    ends_alike(0);
}

#[test]
fn hil_fault_campaign_ends_alike_in_the_image_second_quarter() {
    ends_alike(1);
}

#[test]
fn hil_fault_campaign_ends_alike_in_the_image_third_quarter() {
    ends_alike(2);
}

#[test]
fn hil_fault_campaign_ends_alike_in_the_image_fourth_quarter() {
    ends_alike(3);
}
