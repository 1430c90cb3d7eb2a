//! Fuzzing without a fuzzer: valid messages from the committed corpus are
//! mutated, re-framed with a right CRC as often as not, and pushed through the
//! very code that flies. Here a short run; a long one is
//!
//! ```text
//! cargo run --release --config profile.release.overflow-checks=true -p helm --example fuzz -- 1e9
//! ```

#[path = "../../examples/fuzz/mutator.rs"]
mod mutator;

#[test]
fn twenty_million_mutated_bytes_find_nothing() {
    let found = mutator::run(20_000_000, 7, |_| {});
    println!("{found:?}");
    assert!(found.frames > 10_000 && found.stepped > 1_000 && found.accepted > 1_000, "the fuzzer does not reach the law: {found:?}");
}

#[test]
fn the_corpus_is_whole() {
    for (name, bytes) in mutator::CORPUS {
        let mut wire = bytes.to_vec();
        assert_eq!(wire.pop(), Some(0), "{name} ends with its delimiter");
        signals::decode::<signals::Request>(&mut wire).unwrap_or_else(|e| panic!("{name}: {e:?}; make it again with --corpus"));
    }
}
