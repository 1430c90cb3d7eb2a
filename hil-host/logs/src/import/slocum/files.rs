//! Which Slocum files are halves of one segment, which are copies, and which are of another glider.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{Collected, ENGINEERING_ENDINGS, Loaded, SCIENCE_ENDINGS, clocks, ending, is_slocum, name_of};
use crate::import::{ImportError, Report, dba, dbd, folder};
use crate::record::bounded;

/// A copy has more than this share of its time in that of the other file (guess): two segments may bear one name.
const COPIED: f64 = 0.5;

/// Of files of one computer whose headers state the same name and that lie in the same time, the one with the most cycles stays.
pub(super) fn one_of_copies(loaded: &mut Vec<Loaded>, report: &mut Report) {
    let mut of_name: BTreeMap<(&str, bool), Vec<usize>> = BTreeMap::new();
    for (k, one) in loaded.iter().enumerate() {
        if let Some(name) = one.file.header.get("full_filename") {
            of_name.entry((name, one.science)).or_default().push(k);
        }
    }
    let mut out: Vec<usize> = Vec::new();
    for mut alike in of_name.into_values().filter(|alike| alike.len() > 1) {
        // The fullest first; of two alike the later one.
        alike.sort_by_key(|k| std::cmp::Reverse((loaded[*k].file.cycles, *k)));
        for (k, b) in alike.iter().enumerate() {
            let other = &loaded[*b];
            for one in alike[..k].iter().map(|a| &loaded[*a]).filter(|one| one.segment != other.segment) {
                let (Some(span), Some(copy)) = (clocks::span(&one.file), clocks::span(&other.file)) else { continue };
                if copy.1.min(span.1) - copy.0.max(span.0) > COPIED * (copy.1 - copy.0) {
                    let what = format!(
                        "{} and {} are copies of one segment by their headers: the first, fuller one is read",
                        one.name, other.name
                    );
                    let held = copy.0 >= span.0 - OVERLAP_S && copy.1 <= span.1 + OVERLAP_S;
                    if held {
                        report.note(what)
                    } else {
                        report.leave_out(what)
                    }
                    out.push(*b);
                    break;
                }
            }
        }
    }
    let mut place = 0..;
    loaded.retain(|_| place.next().is_none_or(|k| !out.contains(&k)));
}

/// Halves of one segment whose files were renamed apart become one again, by the name that both headers state.
pub(super) fn pair_by_header(loaded: &mut [Loaded], report: &mut Report) {
    let stated = |one: &Loaded| one.file.header.get("full_filename").cloned();
    let has = |all: &[Loaded], segment: u32, science: bool| all.iter().any(|l| l.segment == segment && l.science == science);
    for k in (0..loaded.len()).filter(|k| loaded[*k].science).collect::<Vec<_>>() {
        let (own, name) = (loaded[k].segment, stated(&loaded[k]));
        let of_name = |l: &&Loaded| !l.science && stated(l) == name && !has(loaded, l.segment, true);
        let mut others = loaded.iter().filter(of_name).filter(|_| name.is_some() && !has(loaded, own, false));
        if let (Some(other), None) = (others.next(), others.next()) {
            let segment = other.segment;
            report.note(format!("{} and {} are of one segment by their headers", loaded[k].name, other.name));
            loaded[k].segment = segment;
        }
    }
}

/// Files of one glider follow one another; so much of an overlap is a clock that was set, s.
const OVERLAP_S: f64 = 60.0;

/// Files that overlap in time are of two gliders.
pub(super) fn one_glider(loaded: &[Loaded], all: &Collected, report: &Report) -> Result<(), ImportError> {
    let error = |what: String| Err(ImportError { file: "files do not belong together".into(), what });
    let names: std::collections::BTreeSet<String> = loaded.iter().filter_map(|l| glider_of(&l.file)).collect();
    if names.len() > 1 {
        let list: Vec<String> = names.into_iter().collect();
        return error(format!(
            "files of {} gliders by their headers ({}): import one glider's files at a time",
            list.len(),
            list.join(", ")
        ));
    }
    let spans: Vec<(u32, (f64, f64))> = all.spans.iter().map(|(k, s)| (*k, *s)).collect();
    let named = |segment: u32| report.segments.get(segment as usize).cloned().unwrap_or_default();
    for (k, (a, span_a)) in spans.iter().enumerate() {
        for (b, span_b) in &spans[k + 1..] {
            let overlap = span_a.1.min(span_b.1) - span_a.0.max(span_b.0);
            if overlap > OVERLAP_S {
                let (a, b) = (named(*a), named(*b));
                let why = if names.is_empty() {
                    "files of two gliders? import one glider's files at a time"
                } else {
                    "two copies of one segment, a clock that was set, or two gliders? name the files of one"
                };
                return error(format!("{a} and {b} overlap by {overlap:.0} s: {why}"));
            }
        }
    }
    Ok(())
}

/// Names segments without one of the two computers' files where others have both.
pub(super) fn one_sided(loaded: &[Loaded], report: &mut Report) {
    let has = |segment: u32, science: bool| loaded.iter().any(|l| l.segment == segment && l.science == science);
    let segments: std::collections::BTreeSet<u32> = loaded.iter().map(|l| l.segment).collect();
    if !segments.iter().any(|s| has(*s, true) && has(*s, false)) {
        return;
    }
    for segment in segments {
        let what = match (has(segment, false), has(segment, true)) {
            (true, false) => "no science file (.ebd, .tbd): without density",
            (false, true) => "no engineering file (.dbd, .sbd): without pitch and ballast",
            _ => continue,
        };
        let name = report.segments.get(segment as usize).cloned().unwrap_or_default();
        report.note(format!("{name} has {what}"));
    }
}

/// The files without those that hold the same bytes as one before them.
pub(super) fn without_copies(files: &[PathBuf], report: &mut Report) -> Vec<PathBuf> {
    let length = |p: &PathBuf| std::fs::metadata(p).map_or(0, |m| m.len());
    let mut kept: BTreeMap<u64, Vec<&PathBuf>> = BTreeMap::new();
    let mut out = Vec::new();
    // Of two alike the one stays whose other half has the same name.
    let mut stems: BTreeMap<Option<&std::ffi::OsStr>, usize> = BTreeMap::new();
    files.iter().for_each(|p| *stems.entry(p.file_stem()).or_default() += 1);
    let mut files: Vec<&PathBuf> = files.iter().collect();
    files.sort_by_key(|p| stems.get(&p.file_stem()).is_none_or(|n| *n < 2));
    for path in files {
        let alike = kept.entry(length(path)).or_default();
        let bytes = |p: &PathBuf| bounded::bytes(p, bounded::LOG).ok().filter(|b| !b.is_empty());
        let own = if alike.is_empty() { None } else { bytes(path) };
        match alike.iter().find(|other| own.is_some() && bytes(other) == own) {
            Some(other) => report.note(format!("{} holds the same bytes as {}: read once", name_of(path), name_of(other))),
            None => {
                alike.push(path);
                out.push(path.clone());
            }
        }
    }
    out
}

/// The glider's name in the header of a file: what stands before the date in "unit_777-2026-122-1-0".
fn glider_of(file: &dbd::DbdFile) -> Option<String> {
    let full = file.header.get("full_filename").or_else(|| file.header.get("segment_filename_0"))?;
    let parts: Vec<&str> = full.split('-').collect();
    let number = |p: &&str| p.bytes().all(|b| b.is_ascii_digit()) && !p.is_empty();
    let date = (1..parts.len().checked_sub(3)?).find(|k| parts[*k].len() == 4 && parts[*k..].iter().all(number))?;
    Some(parts[..date].join("-").to_ascii_lowercase())
}

/// What a file is by its ending, or by its header if it is text: stem, side (engineering, science) and rank.
fn source(path: &Path) -> Option<(String, usize, usize)> {
    let (stem, end) = match ending(path).filter(|_| is_slocum(path)) {
        Some(end) => (path.file_stem()?.to_string_lossy().into_owned(), end),
        None => {
            let mut head = Vec::new();
            std::io::Read::read_to_end(&mut std::io::Read::take(std::fs::File::open(path).ok()?, 4096), &mut head).ok()?;
            let (header, _) = dba::header(&String::from_utf8_lossy(&head));
            let stem = header.get("segment_filename_0").or_else(|| header.get("the8x3_filename")).or_else(|| header.get("filename"))?;
            (stem.clone(), header.get("filename_extension")?.to_ascii_lowercase())
        }
    };
    let rank = |list: &[&str]| list.iter().position(|e| *e == end);
    rank(&ENGINEERING_ENDINGS).map(|r| (stem.clone(), 0, r)).or_else(|| rank(&SCIENCE_ENDINGS).map(|r| (stem, 1, r)))
}

/// Files by stem: of engineering and of science, the fullest first. Texts whose headers name the same file and kind hold parts of it, or a
/// name was never set: each is a segment of its own, under its file's name too.
pub(super) fn pairs(files: &[PathBuf]) -> BTreeMap<String, [Vec<PathBuf>; 2]> {
    let known: Vec<(String, usize, usize, &PathBuf)> =
        files.iter().filter_map(|p| source(p).map(|(s, side, rank)| (s, side, rank, p))).collect();
    let mut of: BTreeMap<(&str, usize, usize), usize> = BTreeMap::new();
    known.iter().filter(|k| !is_slocum(k.3)).for_each(|k| *of.entry((&k.0, k.1, k.2)).or_default() += 1);
    let shared: std::collections::BTreeSet<&str> = of.into_iter().filter(|(_, n)| *n > 1).map(|((stem, ..), _)| stem).collect();
    let mut stems: BTreeMap<String, [Vec<(usize, PathBuf)>; 2]> = BTreeMap::new();
    for (stem, side, rank, path) in &known {
        let own = || name_of(path).split('.').next().unwrap_or_default().to_owned();
        let stem = if shared.contains(stem.as_str()) { format!("{stem} ({})", own()) } else { stem.clone() };
        stems.entry(stem).or_default()[*side].push((*rank, (*path).clone()));
    }
    let sorted = |mut side: Vec<(usize, PathBuf)>| {
        side.sort();
        side.into_iter().map(|(_, p)| p).collect()
    };
    stems.into_iter().map(|(stem, sides)| (stem, sides.map(sorted))).collect()
}

/// The files `named`, and where they are of one computer alone, next to each that of the other one: the fullest of the same stem.
#[must_use]
pub fn with_partners(named: &[PathBuf]) -> Vec<PathBuf> {
    let known: Vec<(String, usize, usize, &PathBuf)> = named.iter().filter_map(|p| source(p).map(|s| (s.0, s.1, s.2, p))).collect();
    let mut out = named.to_vec();
    let Some(side) = known.first().map(|k| k.1).filter(|side| known.iter().all(|k| k.1 == *side)) else { return out };
    let of = |path: &Path| path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_path_buf();
    let folders: std::collections::BTreeSet<PathBuf> = named.iter().map(|p| of(p)).collect();
    let mut partners: BTreeMap<(PathBuf, String), (usize, PathBuf)> = BTreeMap::new();
    for path in folders.iter().flat_map(|folder| folder::files_of(folder).unwrap_or_default()) {
        let is_other = |s: &(String, usize, usize)| s.1 != side && is_slocum(&path) == is_slocum(&named[0]) && !named.contains(&path);
        let Some((stem, _, rank)) = source(&path).filter(is_other) else { continue };
        let held = partners.entry((of(&path), stem)).or_insert((rank, path.clone()));
        if rank < held.0 {
            *held = (rank, path);
        }
    }
    out.extend(known.iter().filter_map(|(stem, .., path)| Some(partners.get(&(of(path), stem.clone()))?.1.clone())));
    out
}
