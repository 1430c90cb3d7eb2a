//! Laws for what has no name: flights with one strong effect outside the catalogue that is a law of what is measured.

use crate::case;
use discovery::criticism::law::Law;
use discovery::diagnosis::{self, Verdict};
use discovery::hypotheses::search::Depth;
use plant::trials::catalogue::Strength;
use plant::trials::outside::Outside;
use plant::trials::{Kind, Site, Spec, Wing};
use rayon::prelude::*;

/// What is hidden, through which channel it acts, what it follows and with which power.
const HIDDEN: [(Outside, &str, &str, f64); 5] = [
    (Outside::RollBias, "drag", "side of the turn", 1.0),
    (Outside::PitchByHeading, "pitch", "heading", 1.0),
    (Outside::PitchByDepth, "pitch", "pressure", 1.0),
    (Outside::Leak, "weight", "time since the start of the segment", 1.0),
    (Outside::DragByHeading, "drag", "heading", 1.0),
];

/// Whether a law of the class follows what is hidden, and whether one does with its power.
fn right(class: &[Law], channel: &str, follows: &str, power: f64) -> [bool; 2] {
    let of = |l: &Law, powers: &dyn Fn(f64) -> bool| {
        l.channel() == channel && l.groups().iter().any(|(name, e)| name.starts_with(follows) && powers(*e))
    };
    [class.iter().any(|l| of(l, &|_| true)), class.iter().any(|l| of(l, &|e| e == power))]
}

/// Of those called unexplained, seven in ten follow the right variable through the right channel, and half with the right power.
#[test]
fn scorecard_a_law_follows_what_is_hidden() {
    let cases: Vec<(usize, Site)> = (0..HIDDEN.len()).flat_map(|k| [(k, Site::Lake), (k, Site::Sea)]).collect();
    let asked = |&(k, site): &(usize, Site)| {
        let (outside, channel, follows, power) = HIDDEN[k];
        let spec = Spec { kind: Kind::Off, outside: Some(outside), strength: Some(Strength::Strong), ..Spec::clean(site, Wing::Standard) };
        let (f, v) = case::read_back(&spec, 20_262_911, k);
        let d = diagnosis::diagnose(&f, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
        let found = (d.verdict == Verdict::Unexplained).then(|| right(&d.laws, channel, follows, power));
        eprintln!("{outside:?} {site:?}: {:?} {:?} {found:?} {}", d.verdict, d.answer, discovery::criticism::law::in_words(&d.laws));
        found
    };
    let found: Vec<[bool; 2]> = cases.par_iter().filter_map(asked).collect();
    let share = |i: usize| found.iter().filter(|f| f[i]).count() as f64 / found.len() as f64;
    eprintln!("{} of {} unexplained, variable right {:.2}, power right {:.2}", found.len(), cases.len(), share(0), share(1));
    assert!(found.len() >= 3 && share(0) >= 0.7 && share(1) >= 0.5);
}
