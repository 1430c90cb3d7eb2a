//! `glider upload`.

use super::{Output, Verdict};
use crate::packets::{for_board, vehicle_of_history};
use anyhow::{Context, bail};
use clap::ValueEnum;
use control::Config;
use discovery::history::flight::read as read_history;
use indicatif::{ProgressBar, ProgressStyle};
use logs::record::bounded;
use rig::flight::file_kinds::{Kind as ContentKind, expect};
use rig::flight::image_file::ImageFile;
use rig::flight::{config_file, mission_file, tables};
use rig::seats::link::upload::{Stored, read_back, rollback, upload};
use rig::seats::port::Port;
use rig::seats::{Link, Seat};
use rig::seats::{clock, image};
use serde_json::json;
use signals::link::CRC32;
use signals::{Object, Older, Wings};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider upload /dev/ttyACM0 table-low-ar new_table.bin\n  glider upload /dev/ttyACM0 config vehicle.toml\n  \
glider upload /dev/ttyACM0 mission mission.toml\n  glider upload /dev/ttyACM0 history known.history\n  glider upload /dev/ttyACM0 config --read\n  glider upload /dev/ttyACM0 table-standard --rollback\n  glider upload /dev/ttyACM0 image firmware.elf\n\n\
The board checks CRC and content, keeps the version before, and is read back and compared; its UTC is set by this computer's. A configuration file names a built-in vehicle and\n\
what differs (vehicle = \"slocum-200\", crush_depth_m = 240.0, ...); --read shows every setting.\n\
An image of the firmware is staged, the board restarted, and the image is on trial: its first finished cycle on the bench confirms it;\n\
3 boots without one, or a watchdog, and the one before is back. An older version needs --force."
)]
pub struct Args {
    /// Serial port of the board.
    port: String,
    /// What it is.
    #[arg(value_enum)]
    object: Kind,
    /// Table (.bin, as `glider table` writes it), configuration or mission (.toml), history (.history, its vehicle file beside it), image (ELF).
    #[arg(required_unless_present_any = ["read", "rollback"])]
    file: Option<PathBuf>,
    /// Read what is in use instead: to FILE, or configuration and mission to the screen.
    #[arg(long, conflicts_with = "rollback")]
    read: bool,
    /// Go back to the version before.
    #[arg(long, conflicts_with = "file")]
    rollback: bool,
}

/// What can be uploaded.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// L/D table of the standard wings.
    TableStandard,
    /// L/D table of the low aspect ratio wings.
    TableLowAr,
    /// Controller configuration.
    Config,
    /// Mission.
    Mission,
    /// History of the vehicle, as calibrate writes it beside the vehicle file.
    History,
    /// Image of the firmware.
    Image,
}

impl Kind {
    const fn object(self) -> Object {
        match self {
            Self::TableStandard => Object::Table(Wings::Standard),
            Self::TableLowAr => Object::Table(Wings::LowAspectRatio),
            Self::Config => Object::Config,
            Self::Mission => Object::Mission,
            Self::History => Object::History,
            Self::Image => Object::Image(Older::Refused),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::TableStandard => "table-standard",
            Self::TableLowAr => "table-low-ar",
            Self::Config => "config",
            Self::Mission => "mission",
            Self::History => "history",
            Self::Image => "image",
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    match &args.file {
        _ if args.object == Kind::Image => run_image(args, output),
        _ if args.read => read(args, output),
        _ if args.rollback => go_back(args, output),
        Some(file) => send(args, file, output),
        None => bail!("name a FILE, or --read, or --rollback"),
    }
}

/// An image is staged or taken back, the board restarted; or the one that runs is named.
fn run_image(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let file = match &args.file {
        Some(_) if args.read => bail!("an image cannot be read back to a file; without FILE --read says which one runs"),
        Some(path) if !args.rollback => Some((path, ImageFile::read(path)?)),
        _ => None,
    };
    if let Some((path, new)) = file.as_ref().filter(|_| !output.force) {
        new.speaks_this_wire().with_context(|| path.display().to_string())?;
    }
    let mut link = Link::new(Port::open(&args.port)?);
    let before = image::running(&mut link)?;
    let after = if let Some((_, new)) = &file {
        let bar = ProgressBar::new(new.bytes.len() as u64)
            .with_style(ProgressStyle::with_template("{msg} {bar:40} {bytes}/{total_bytes}").unwrap_or(ProgressStyle::default_bar()))
            .with_message(format!("image → {}", args.port));
        let older = if output.force { Older::Taken } else { Older::Refused };
        image::stage(&mut link, &new.bytes, older, |sent| bar.set_position(sent as u64))?;
        bar.finish_with_message("staged; the board installs it");
        image::restart(&mut link)?
    } else if args.rollback {
        image::go_back(&mut link)?;
        image::restart(&mut link)?
    } else {
        before
    };
    let wanted = file.as_ref().map(|(_, new)| new.facts.id);
    let taken = wanted.is_none_or(|id| id == after.id);
    let clock = if args.read { None } else { Some(clock::set(&mut link, &clock::system_ms).context("the board's clock was not set")?) };
    let document = json!({ "object": "image", "file": args.file, "bytes": file.as_ref().map(|(_, new)| new.bytes.len()), "board": link.describe(),
        "uploaded": wanted.map(|id| format!("{id:08x}")), "before": format!("{:08x}", before.id), "runs": format!("{:08x}", after.id),
        "standing": image::name(&after), "clock": clock.map(|clock| clock.document()) });
    output.emit(&document, || {
        println!("image: {} runs", image::words(&after));
        if !taken {
            println!("the uploaded one was not started: upload it again, and look at the board's log (glider monitor) if it happens again");
        }
    });
    Ok(if taken { Verdict::Ok } else { Verdict::Negative })
}

fn send(args: &Args, file: &Path, output: &Output) -> anyhow::Result<Verdict> {
    let name = args.object.name();
    // A mission is checked, a history counted, by the configuration of the board it is for, so the board is asked first.
    let config = || -> anyhow::Result<Config> {
        let mut link = Link::new(Port::open(&args.port)?);
        link.hello()?;
        decode_config(&read_back(&mut link, Object::Config, |_| {})?)
    };
    let bytes = prepare(args.object, file, config)?;
    let mut link = Link::new(Port::open(&args.port)?);
    link.hello()?;
    let bar = ProgressBar::new(2 * bytes.len() as u64)
        .with_style(ProgressStyle::with_template("{msg} {bar:40} {bytes}/{total_bytes}").unwrap_or(ProgressStyle::default_bar()))
        .with_message(format!("{name} → {}", args.port));
    let stored = upload(&mut link, args.object.object(), &bytes, |done, _| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let clock = clock::set(&mut link, &clock::system_ms).context("stored; the board's clock was not set")?;
    let document = json!({ "object": name, "file": file, "bytes": bytes.len(), "crc": format!("{:08x}", CRC32.checksum(&bytes)),
        "board": link.describe(), "in_use_crc": format!("{:08x}", stored.crc), "kept_on_flash": stored.for_good,
        "clock": clock.document() });
    output.emit(&document, || {
        println!("{name}: {} bytes, CRC {:08x}, stored, read back and equal; {}", bytes.len(), CRC32.checksum(&bytes), kept(stored));
        println!("UTC: {}", clock.words());
    });
    Ok(Verdict::Ok)
}

const fn kept(stored: Stored) -> &'static str {
    if stored.for_good { "kept on flash" } else { "in use until the next reset (this board's flash does not keep it)" }
}

fn go_back(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut link = Link::new(Port::open(&args.port)?);
    link.hello()?;
    let stored = rollback(&mut link, args.object.object())?;
    let name = args.object.name();
    let document = json!({ "object": name, "board": link.describe(), "rolled_back": true, "in_use_crc": format!("{:08x}", stored.crc),
        "kept_on_flash": stored.for_good });
    output.emit(&document, || match stored.crc {
        0 => println!("{name}: rolled back; there is none in use now"),
        crc => println!("{name}: rolled back to the version before, identity {crc:08x}; {}", kept(stored)),
    });
    Ok(Verdict::Ok)
}

fn read(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut link = Link::new(Port::open(&args.port)?);
    link.hello()?;
    let name = args.object.name();
    let bytes = read_back(&mut link, args.object.object(), |_| {})?;
    let text = match args.object {
        _ if bytes.is_empty() => None,
        Kind::Config => Some(config_file::write(&decode_config(&bytes)?)?),
        Kind::Mission => Some(mission_file::write(
            &helm::objects::mission(&bytes)
                .with_context(|| format!("{}: holds a mission that this program cannot read", link.describe()))?,
        )),
        Kind::TableStandard | Kind::TableLowAr | Kind::History | Kind::Image => None,
    };
    if let Some(file) = &args.file {
        rig::whole_file::may_write(file, &[], &[], output.force)?;
        rig::whole_file::write(file, text.as_ref().map_or(bytes.as_slice(), |t| t.as_bytes()))
            .with_context(|| format!("{}: cannot write", file.display()))?;
    }
    let crc = CRC32.checksum(&bytes);
    let document = json!({ "object": name, "board": link.describe(), "bytes": bytes.len(), "crc": format!("{crc:08x}"), "file": args.file,
        "content": text });
    output.emit(&document, || match (&args.file, &text) {
        _ if bytes.is_empty() => println!("{name}: nothing stored on the board"),
        (Some(file), _) => println!("{name}: {} bytes, CRC {crc:08x}, written to {}", bytes.len(), file.display()),
        (None, Some(text)) => print!("{text}"),
        (None, None) => println!("{name}: {} bytes, CRC {crc:08x}; name a FILE to keep it", bytes.len()),
    });
    Ok(Verdict::Ok)
}

pub(super) fn decode_config(bytes: &[u8]) -> anyhow::Result<Config> {
    helm::objects::config_of(bytes).context("the board's configuration is of another release; flash the firmware of this one (cargo flash)")
}

/// Reads and checks a file before the board sees it.
fn prepare(kind: Kind, file: &Path, board: impl Fn() -> anyhow::Result<Config>) -> anyhow::Result<Vec<u8>> {
    let name = file.display();
    match kind.object() {
        Object::Table(wings) => {
            expect(file, ContentKind::Table)?;
            let bytes = bounded::bytes(file, bounded::DOCUMENT).with_context(|| format!("{name}: cannot read this file"))?;
            tables::for_wings(&bytes, wings).with_context(|| name.to_string())?;
            Ok(bytes)
        }
        Object::Config => {
            let mut bytes = helm::Content::new();
            helm::objects::config_bytes(&config_file::load(file)?, &mut bytes);
            Ok(bytes.to_vec())
        }
        Object::Mission => {
            let config = board()?;
            let limits = mission_file::Limits { working_depth_m: config.working_depth_m, pump_m3: config.pump_m3 };
            let mission = mission_file::load(&file.to_string_lossy(), |_| limits)?;
            let mut buffer = [0u8; helm::MAX_OBJECT];
            let used = postcard::to_slice(&mission, &mut buffer).map_err(|e| anyhow::anyhow!("{name}: mission does not fit: {e}"))?;
            Ok(used.to_vec())
        }
        Object::History => {
            let history = read_history(file).map_err(|e| anyhow::anyhow!(e))?;
            let vehicle = logs::vehicle::read(&vehicle_of_history(file)?)?;
            // Counted from the constants that the board judges by.
            let on_board = for_board(&history.learnt(), &history.glider(&vehicle), &helm::glides::vehicle(&*board()?));
            let bytes = on_board.with_context(|| name.to_string())?.encode();
            Ok(bytes.with_context(|| name.to_string())?.to_vec())
        }
        Object::Log => bail!("the flight log is read with glider monitor PORT --flight-log DIR"),
        Object::Image(_) => bail!("an image is no object in RAM"),
        Object::Autopsy => bail!("what is kept of a fault is read with glider autopsy PORT"),
    }
}
