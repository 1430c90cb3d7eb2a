//! How deep the stack can get: the call graph's heaviest path from reset, plus
//! the exceptions that can come on top.
//!
//! - A function's frame is the sum of everything it ever takes off SP.
//! - A call through a register may go to every function whose address appears
//!   anywhere in the image (vector table excepted): sound without types.
//! - All interrupts share one priority, so one of them can come on top of the
//!   main path, a fault on top of that, and the non-maskable interrupt on top of
//!   both; each costs its handler and the entry frame with the FPU's registers
//!   (26 words and a word of alignment, Armv7-M ARM B1.5.7).
//! - Recursion is refused: its depth cannot be read.

use crate::image::Image;
use crate::thumb::{self, Reading};
use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};

const ENTRY_FRAME: u64 = 4 * 27;

/// The worst case.
pub struct Worst {
    /// Bytes of all together.
    pub total: u64,
    /// Frames from reset down.
    pub path: Vec<(u64, String)>,
    /// Exceptions on top.
    pub exceptions: Vec<(u64, String)>,
}

struct Graph<'a> {
    image: &'a Image,
    readings: Vec<Reading>,
    /// Functions that may be called through a register.
    candidates: Vec<usize>,
    /// Heaviest path from each function on, once known.
    known: BTreeMap<usize, (u64, Vec<usize>)>,
}

impl Graph<'_> {
    fn at(&self, address: u32) -> Option<usize> {
        let i = self.image.functions.partition_point(|f| f.start <= address).checked_sub(1)?;
        (address < self.image.functions[i].end).then_some(i)
    }

    fn depth(&mut self, function: usize, above: &mut Vec<usize>) -> Result<(u64, Vec<usize>)> {
        if let Some(known) = self.known.get(&function) {
            return Ok(known.clone());
        }
        if above.contains(&function) {
            let names: Vec<_> = above.iter().map(|f| self.image.functions[*f].name.as_str()).collect();
            bail!("recursion: {} -> {}", names.join(" -> "), self.image.functions[function].name);
        }
        above.push(function);
        let mut next = BTreeSet::new();
        for target in &self.readings[function].calls {
            let Some(callee) = self.at(*target) else { bail!("{}: call to {target:#x}, no function", self.image.functions[function].name) };
            if callee != function || self.image.functions[function].start == *target {
                next.insert(callee);
            }
        }
        if self.readings[function].indirect > 0 {
            next.extend(&self.candidates);
        }
        let mut worst = (0, vec![]);
        for callee in next {
            let below = self.depth(callee, above)?;
            if below.0 > worst.0 {
                worst = below;
            }
        }
        above.pop();
        worst.0 += u64::from(self.readings[function].frame);
        worst.1.insert(0, function);
        self.known.insert(function, worst.clone());
        Ok(worst)
    }
}

/// The worst case of an image.
pub fn worst(image: &Image) -> Result<Worst> {
    let readings = image.functions.iter().map(thumb::read).collect::<Result<Vec<_>>>()?;
    let mut taken: BTreeSet<u32> = image.words.clone();
    taken.extend(readings.iter().flat_map(|r| &r.addresses));
    let candidates = (0..image.functions.len())
        .filter(|i| taken.contains(&(image.functions[*i].start | 1)) && !image.vectors.values().any(|v| *v == image.functions[*i].start))
        .collect();
    let mut graph = Graph { image, readings, candidates, known: BTreeMap::new() };
    let find = |name: &str| image.functions.iter().position(|f| f.name == name);
    let reset = find("Reset").context("no Reset function")?;
    let (main, path) = graph.depth(reset, &mut vec![])?;
    // Ranks that can lie on top of each other: interrupts, faults, and NMI (exception 2).
    let mut ranks: [Vec<(u64, String)>; 3] = Default::default();
    for (number, vector) in &image.vectors {
        let Some(handler) = graph.at(*vector).filter(|h| *h != reset) else { continue };
        let name = image.functions[handler].name.clone();
        let bytes = ENTRY_FRAME + graph.depth(handler, &mut vec![])?.0;
        match number {
            2 => ranks[2].push((bytes, format!("{name} as NMI"))),
            3..=6 => ranks[1].push((bytes, name)),
            _ => ranks[0].push((bytes, name)),
        }
    }
    let exceptions: Vec<_> = ranks.into_iter().filter_map(|rank| rank.into_iter().max()).collect();
    let frames = path.iter().map(|f| (u64::from(graph.readings[*f].frame), image.functions[*f].name.clone())).collect();
    Ok(Worst { total: main + exceptions.iter().map(|e| e.0).sum::<u64>(), path: frames, exceptions })
}
