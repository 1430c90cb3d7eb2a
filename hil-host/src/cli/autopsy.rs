//! `glider autopsy`.

use super::{Output, Verdict};
use crate::terminal::{row, say};
use anyhow::{Context, ensure};
use logs::record::bounded;
use rig::flight::autopsy::{self, Autopsy, Ended};
use rig::flight::image_lines::{ImageLines, Place};
use rig::seats::link::upload::read_back;
use rig::seats::port::Port;
use rig::seats::{Link, Seat, qemu};
use rig::whole_file;
use serde_json::{Value, json};
use signals::Object;
use signals::autopsy::{Cause, Note};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider autopsy /dev/ttyACM0
  glider autopsy /dev/ttyACM0 --out board7.autopsy
  glider autopsy board7.autopsy --elf firmware.elf --cycles 64
  glider autopsy /dev/ttyACM0 --json

What a board keeps in RAM over a reset: why it was reset, where the program was, its last control
cycles. It stays until the next fault or power cut; reading changes nothing, and a mission under way
goes on. Lines of source come from the image that ran: the ELF of scripts/build-firmware, known by
its identity; another one names none.

Exit code: 0 a fault is kept, 1 none: a clean board, 2 bad input.")]
pub struct Args {
    /// Serial port of the board, or a file that --out has written.
    #[arg(value_name = "PORT|FILE")]
    from: String,
    /// The image the board ran; default: the one built here, where it is that one.
    #[arg(long, value_name = "IMAGE")]
    elf: Option<PathBuf>,
    /// So many of the last control cycles, at most 64.
    #[arg(long, value_name = "N", default_value_t = 12)]
    cycles: usize,
    /// Keep what the board says, for another machine or a later look (.autopsy).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let file = Path::new(&args.from);
    if let Some(out) = &args.out {
        whole_file::may_write(out, &[file], &["autopsy"], output.force)?;
    }
    ensure!(!file.is_dir(), "{}: is a folder; name the serial port of a board, or a file of --out", args.from);
    let (from, bytes) = if file.is_file() {
        (args.from.clone(), bounded::bytes(file, bounded::DOCUMENT).with_context(|| format!("{}: cannot read", args.from))?)
    } else {
        let mut link = Link::new(Port::open(&args.from)?);
        let bytes = read_back(&mut link, Object::Autopsy, |_| {})?;
        (link.describe(), bytes)
    };
    let found = Autopsy::read(&bytes).with_context(|| from.clone())?;
    if let Some(out) = &args.out {
        whole_file::write(out, &bytes).with_context(|| format!("{}: cannot write", out.display()))?;
    }
    let Some(found) = found else {
        let why = "this controller keeps nothing over a reset: a simulated one, or an image of before";
        output.emit(&json!({ "from": from, "fault": null, "why": why }), || say(&format!("nothing kept: {why}")));
        return Ok(Verdict::Negative);
    };
    let Some(ended) = &found.fault else {
        clean(&from, &found, output);
        return Ok(Verdict::Negative);
    };
    let lines = lines(args, &ended.note)?;
    tell(&from, &found, ended, &lines, args.cycles, output);
    Ok(Verdict::Ok)
}

/// The image that ran, or why its lines cannot be named.
type Lines = Result<ImageLines, String>;

fn lines(args: &Args, note: &Note) -> anyhow::Result<Lines> {
    let needed = format!("the board ran image {:08x} (firmware {})", note.image, autopsy::version(note.firmware));
    if let Some(elf) = &args.elf {
        let image = ImageLines::read(elf)?;
        ensure!(
            image.id == note.image,
            "{}: is image {:08x}, and {needed}: its lines would be wrong; give the ELF of that build, or leave --elf out",
            elf.display(),
            image.id
        );
        return Ok(Ok(image));
    }
    Ok(match qemu::find_image() {
        Err(_) => Err(format!("{needed}: give its ELF with --elf")),
        Ok(elf) => match ImageLines::read(&elf) {
            Ok(image) if image.id == note.image => Ok(image),
            Ok(image) => Err(format!("{needed}, {} is {:08x}: give its ELF with --elf", elf.display(), image.id)),
            Err(e) => Err(format!("{e:#}")),
        },
    })
}

/// Who answers.
fn board(from: &str, present: Option<&Note>) {
    row("from", from);
    match present {
        Some(note) => {
            row("", &format!("firmware {}, image {:08x}, run {}", autopsy::version(note.firmware), note.image, note.run + 1));
            row("last reset by", &autopsy::reset(note.began));
        }
        None => row("", "the note of its present run is damaged"),
    }
}

fn present(note: Option<&Note>) -> Value {
    note.map_or(Value::Null, |note| {
        json!({ "run": note.run + 1, "firmware": autopsy::version(note.firmware), "image": format!("{:08x}", note.image),
            "reset": autopsy::reset(note.began), "reset_flags": note.began })
    })
}

fn clean(from: &str, found: &Autopsy, output: &Output) {
    let why = if found.is_damaged { "the record of a fault is damaged (CRC)" } else { "a clean board: no fault since it was powered up" };
    output.emit(&json!({ "from": from, "present": present(found.present.as_ref()), "fault": null, "why": why }), || {
        board(from, found.present.as_ref());
        row("nothing kept", why);
    });
}

/// Where the fault was, and what had called it.
struct Where {
    at: Vec<Place>,
    link: Vec<Place>,
    callers: Vec<(u32, Vec<Place>)>,
}

impl Where {
    fn of(note: &Note, lines: &Lines) -> Self {
        let r = &note.registers;
        let known = |address: u32, find: &dyn Fn(&ImageLines) -> Vec<Place>| match lines {
            Ok(image) if address != 0 => find(image),
            _ => Vec::new(),
        };
        let callers = note.callers.iter().copied().filter(|c| *c != 0 && *c != r.lr);
        Self {
            at: known(r.pc, &|image| image.at(r.pc)),
            link: known(r.lr, &|image| image.before(r.lr)),
            callers: callers.map(|c| (c, known(c, &|image| image.before(c)))).collect(),
        }
    }
}

fn place(places: &[Place]) -> String {
    places.first().map_or_else(|| "not code of this image".to_owned(), Place::text)
}

fn tell(from: &str, found: &Autopsy, ended: &Ended, lines: &Lines, cycles: usize, output: &Output) {
    let (note, r) = (&ended.note, &ended.note.registers);
    let what = autopsy::what(note);
    let at = Where::of(note, lines);
    let shown = ended.cycles.get(ended.cycles.len().saturating_sub(cycles)..).unwrap_or_default();
    let documents = |places: &[Place]| places.iter().map(Place::document).collect::<Vec<_>>();
    let hex = |word: u32| format!("{word:#010x}");
    let time_s = (note.time_cs > 0).then(|| f64::from(note.time_cs) / 100.0);
    let document = json!({ "from": from, "present": present(found.present.as_ref()), "fault": { "cause": note.cause.name(), "what": what,
        "run": note.run + 1, "time_s": time_s, "firmware": autopsy::version(note.firmware), "image": format!("{:08x}", note.image),
        "reset": autopsy::reset(note.ended), "reset_flags": note.ended, "at": documents(&at.at), "link": documents(&at.link),
        "callers": at.callers.iter().map(|(_, places)| documents(places)).collect::<Vec<_>>(), "no_lines": lines.as_ref().err(),
        "registers": { "pc": hex(r.pc), "lr": hex(r.lr), "sp": hex(r.sp), "xpsr": hex(r.xpsr), "cfsr": hex(r.cfsr), "hfsr": hex(r.hfsr),
            "mmfar": hex(r.mmfar), "bfar": hex(r.bfar) }, "cycles": autopsy::documents(&ended.cycles) } });
    output.emit(&document, || {
        board(from, found.present.as_ref());
        let when = match (time_s, ended.cycles.last()) {
            (Some(s), _) => format!("{s:.2} s after its start"),
            (None, Some(last)) => format!("after its last finished cycle, {:.2} s after its start", f64::from(last.time_cs) / 100.0),
            (None, None) => "before a cycle was finished".to_owned(),
        };
        row("the fault", &format!("ended run {}, {when}", note.run + 1));
        row("reset by", &autopsy::reset(note.ended));
        if note.cause == Cause::Fault {
            at_fault(note, &at, lines);
        }
        if shown.is_empty() {
            row("last cycles", "none was finished");
        } else {
            println!();
            autopsy::rows(shown).iter().for_each(|row| println!("{row}"));
        }
        println!();
        let last = if at.at.is_empty() { String::new() } else { format!(", in {}", place(&at.at)) };
        row("what happened", &format!("{what}{last}"));
    });
}

fn at_fault(note: &Note, at: &Where, lines: &Lines) {
    let r = &note.registers;
    if let Err(why) = lines {
        row("no lines", why);
    }
    if r.pc == 0 {
        row("where", "unknown: no frame could be stacked");
    } else if lines.is_ok() {
        row("where", &place(&at.at));
        at.at.iter().skip(1).for_each(|outer| row("", &format!("inlined into {}", outer.text())));
        row("last call", &place(&at.link));
    }
    for (i, (address, places)) in at.callers.iter().enumerate() {
        let text = if lines.is_ok() { place(places) } else { format!("{address:#010x}") };
        row(if i == 0 { "on the stack" } else { "" }, &text);
    }
    row("registers", &format!("PC {:#010x}, LR {:#010x}, SP {:#010x}, xPSR {:#010x}", r.pc, r.lr, r.sp, r.xpsr));
    row("", &format!("CFSR {:#010x}, HFSR {:#010x}", r.cfsr, r.hfsr));
    row("", &format!("MMFAR {:#010x}, BFAR {:#010x}", r.mmfar, r.bfar));
}
