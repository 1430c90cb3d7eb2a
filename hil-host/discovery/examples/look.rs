//! Development probe: surface readings of one case.
use discovery::{prepare, read, vehicle};
fn main() {
    let case = std::path::PathBuf::from(std::env::args().nth(1).expect("case"));
    let v = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
    let f = read::flight(&case).expect("flight");
    for r in &prepare::prepare(&f, &v).runs {
        println!(
            "seg {} t {:.0} n {} surface {:?} disp {:?} {:.0}",
            r.segment,
            r.time_s[0],
            r.time_s.len(),
            r.surface,
            r.displacement_m,
            r.displacement_s
        );
    }
}
