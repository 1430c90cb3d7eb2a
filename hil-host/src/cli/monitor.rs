//! `glider monitor`.

use super::{Output, Verdict};
use crate::flight::board_log::Image;
use crate::flight::onboard_log;
use crate::seats::port::{BAUD, Port};
use crate::seats::{Link, Seat, SeatError, Wire, qemu};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use signals::{Counters, Manifest, ToBoard, ToHost};
use std::collections::VecDeque;
use std::io::{IsTerminal, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Screen that is always enough.
const LINES: usize = 24;
const COLUMNS: usize = 80;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider monitor /dev/ttyACM0\n  glider monitor /dev/ttyACM0 --log /dev/ttyUSB0 --elf firmware.elf\n  \
glider monitor /dev/ttyACM0 --seconds 5 --json\n  glider monitor /dev/ttyACM0 --flight-log out/recovered\n\nCtrl-C ends. The board's log (defmt) comes on its USART2: give that port, or the file QEMU writes.\n\
--flight-log reads what the board wrote to its log flash in flight and ends; glider compare takes the result with --vehicle.")]
pub struct Args {
    /// Serial port of the board's link (USART1).
    port: String,
    /// Where the board's log comes from: a serial port (USART2) or a growing file.
    #[arg(long)]
    log: Option<PathBuf>,
    /// The image the board runs, to decode the log; default: the one built here.
    #[arg(long)]
    elf: Option<PathBuf>,
    /// Read the flight log off the board's flash into this directory, one flight each below it, and end.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["log", "seconds"])]
    flight_log: Option<PathBuf>,
    /// Of the flight log read only so many control cycles, the newest.
    #[arg(long, value_name = "N", requires = "flight_log")]
    last: Option<usize>,
    /// Stop after this many seconds; default: never.
    #[arg(long)]
    seconds: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut link = Link::new(Port::open(&args.port)?);
    let manifest = link.hello()?;
    if let Some(directory) = &args.flight_log {
        return read_flight_log(&mut link, directory, args.last, output);
    }
    let log = match &args.log {
        Some(path) => Some(follow(path, args.elf.clone())?),
        None => None,
    };
    let started = Instant::now();
    let until = args.seconds.filter(|s| s.is_finite() && *s >= 0.0).map(Duration::from_secs_f64);
    let mut lines: VecDeque<String> = VecDeque::new();
    let mut before: Option<(Instant, Counters)> = None;
    let screen = std::io::stdout().is_terminal() && !output.json;
    loop {
        let counters = report(&mut link)?;
        if let Some(log) = &log {
            lines.extend(log.try_iter());
            while lines.len() > LINES {
                lines.pop_front();
            }
        }
        let now = Instant::now();
        let rate = before.map_or(0.0, |(then, c)| f64::from(counters.accepted.saturating_sub(c.accepted)) / (now - then).as_secs_f64());
        before = Some((now, counters));
        if screen {
            let text = picture(&link.describe(), &manifest, &counters, rate, started.elapsed(), &lines, args.log.is_some());
            // Home, then every line cleared to its end: no flicker.
            print!("\x1b[H{}\x1b[J", text.replace('\n', "\x1b[K\n"));
            std::io::stdout().flush()?;
        }
        if until.is_some_and(|u| started.elapsed() >= u) {
            let document = json!({ "board": link.describe(), "firmware": manifest.firmware, "table_standard": format!("{:08x}", manifest.table_standard),
                "table_low_ar": format!("{:08x}", manifest.table_low_ar), "config": format!("{:08x}", manifest.config), "cycle_ms": manifest.cycle_ms,
                "boots": manifest.boots, "hil": manifest.hil, "accepted": counters.accepted, "damaged": counters.damaged, "other_version": counters.version,
                "unknown": counters.unknown, "overflow": counters.overflow, "repeated": counters.repeated, "stale": counters.stale, "log": lines });
            output.emit(&document, || {
                if !screen {
                    print!("{}", picture(&link.describe(), &manifest, &counters, rate, started.elapsed(), &lines, args.log.is_some()));
                }
            });
            return Ok(Verdict::Ok);
        }
        std::thread::sleep(Duration::from_millis(250).min(until.map_or(Duration::MAX, |u| u.saturating_sub(started.elapsed()))));
    }
}

/// Least control cycles in a sector of the log: 4 KiB of entries of at most 256 bytes.
const CYCLES_PER_SECTOR: usize = 15;

fn read_flight_log<W: Wire>(link: &mut Link<W>, directory: &Path, last: Option<usize>, output: &Output) -> anyhow::Result<Verdict> {
    let bar = ProgressBar::new_spinner()
        .with_style(ProgressStyle::with_template("{spinner} {pos} sectors read, {elapsed}").unwrap_or(ProgressStyle::default_spinner()));
    let sectors = last.map_or(usize::MAX, |n| n.div_ceil(CYCLES_PER_SECTOR) + 1);
    let cycles = onboard_log::read(link, sectors, |n| bar.set_position(n as u64))?;
    bar.finish_and_clear();
    let cycles = cycles.get(cycles.len().saturating_sub(last.unwrap_or(usize::MAX))..).unwrap_or_default();
    let flights = onboard_log::write(cycles, directory, &link.describe())?;
    let document = json!({ "board": link.describe(), "cycles": cycles.len(), "flights": flights });
    output.emit(&document, || {
        println!(
            "{} control cycles in {} flights{}",
            cycles.len(),
            flights.len(),
            if flights.is_empty() { ": the log is empty" } else { "" }
        );
        for f in &flights {
            println!("  {}", f.display());
        }
    });
    Ok(Verdict::Ok)
}

fn report<W: Wire>(link: &mut Link<W>) -> Result<Counters, SeatError> {
    link.request("a report", &ToBoard::Report, |answer| match answer {
        ToHost::Counters(c) => Some(c),
        _ => None,
    })
}

/// The screen: at most 24 lines of 80 characters.
fn picture(board: &str, m: &Manifest, c: &Counters, rate: f64, up: Duration, log: &VecDeque<String>, has_log: bool) -> String {
    let [major, minor, patch] = m.firmware;
    let seat = match (m.under_way, m.hil) {
        (false, _) => "on deck".to_owned(),
        (true, true) => format!("{:?}, frames of a host", m.phase),
        (true, false) => format!("{:?}, own sensors", m.phase),
    };
    let boots = if m.boots == 0 { "not counted".to_owned() } else { m.boots.to_string() };
    let mut rows = vec![
        format!("{board}    watched {:.0} s", up.as_secs_f64()),
        format!("firmware {major}.{minor}.{patch}   cycle {} ms   boots {boots}   {seat}", m.cycle_ms),
        format!("tables  standard {:08x}   low-ar {:08x}   config {:08x}", m.table_standard, m.table_low_ar, m.config),
        String::new(),
        format!("link    accepted {:>9}   {rate:>7.1}/s     damaged  {:>9}", c.accepted, c.damaged),
        format!("        repeated {:>9}   stale {:>9}   overflow {:>9}", c.repeated, c.stale, c.overflow),
        format!("        other version {:>4}   unknown {:>7}", c.version, c.unknown),
        String::new(),
    ];
    rows.push(if has_log { "board log".to_owned() } else { "board log: give --log PORT|FILE to see it".to_owned() });
    let room = LINES - rows.len() - 1;
    rows.extend(log.iter().skip(log.len().saturating_sub(room)).cloned());
    rows.iter().map(|r| r.chars().take(COLUMNS).chain(['\n']).collect::<String>()).collect()
}

/// Decodes a log in a thread of its own.
fn follow(path: &std::path::Path, elf: Option<PathBuf>) -> anyhow::Result<Receiver<String>> {
    let elf = match elf {
        Some(e) => e,
        None => qemu::find_image()?,
    };
    let image = Image::read(&elf)?;
    let is_file = std::fs::metadata(path).with_context(|| format!("{}: no such log port or file", path.display()))?.is_file();
    let mut source: Box<dyn Read + Send> = if is_file {
        let mut file = std::fs::File::open(path).with_context(|| format!("{}: cannot read", path.display()))?;
        file.seek(SeekFrom::Start(0))?;
        Box::new(file)
    } else {
        let name = path.to_string_lossy();
        let port = serialport::new(&*name, BAUD).timeout(Duration::from_millis(200)).open();
        Box::new(port.with_context(|| format!("{name}: cannot open this log port"))?)
    };
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        let mut stream = image.stream();
        let mut bytes = [0u8; 1024];
        loop {
            match source.read(&mut bytes) {
                Ok(0) => std::thread::sleep(Duration::from_millis(100)),
                Ok(n) => stream.take(bytes.get(..n).unwrap_or_default(), |line| drop(sender.send(line))),
                Err(e) if matches!(e.kind(), std::io::ErrorKind::TimedOut | std::io::ErrorKind::Interrupted) => {}
                Err(_) => return,
            }
        }
    });
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_screen_fits_80_by_24_whatever_comes() {
        let worst = Counters {
            accepted: u32::MAX,
            damaged: u32::MAX,
            version: u32::MAX,
            unknown: u32::MAX,
            overflow: u32::MAX,
            repeated: u32::MAX,
            stale: u32::MAX,
        };
        let m = Manifest {
            boots: u32::MAX,
            cycle_ms: u32::MAX,
            firmware: [255; 3],
            table_standard: u32::MAX,
            table_low_ar: u32::MAX,
            config: u32::MAX,
            hil: true,
            under_way: true,
            phase: signals::Phase::InflectHigh,
            last_seq: Some(u32::MAX),
        };
        let log: VecDeque<String> = (0..100).map(|i| format!("{i} {}", "x".repeat(200))).collect();
        let text = picture(&"b".repeat(200), &m, &worst, 1e9, Duration::from_secs(1_000_000), &log, true);
        assert!(text.lines().count() <= LINES, "{text}");
        assert!(text.lines().all(|l| l.chars().count() <= COLUMNS));
        assert!(text.contains("99 xxx"), "the newest log line is shown");
        for word in ["repeated", "overflow", "unknown"] {
            assert!(text.contains(word));
        }
    }
}
