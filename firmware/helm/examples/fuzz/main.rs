//! Long fuzz run over the decoder, the session and the on-board parsers.
//!
//! `fuzz 1e9 [SEED]` runs that many bytes; `fuzz --corpus DIR` writes the
//! corpus again (after a change of the wire).

mod mutator;

fn main() {
    let mut args = std::env::args().skip(1);
    match args.next().as_deref() {
        Some("--corpus") => {
            let folder = std::path::PathBuf::from(args.next().expect("--corpus DIR"));
            for (name, bytes) in mutator::seeds() {
                std::fs::write(folder.join(name), bytes).expect("corpus folder");
            }
        }
        Some(count) => {
            let bytes = count.parse::<f64>().expect("a number of bytes") as u64;
            let seed = args.next().map_or(1, |s| s.parse().expect("a seed"));
            let found = mutator::run(bytes, seed, |done| eprint!("\r{:.0} MB", done as f64 / 1e6));
            eprintln!();
            println!("{found:?}: nothing found");
        }
        None => eprintln!("fuzz BYTES [SEED] | fuzz --corpus DIR"),
    }
}
