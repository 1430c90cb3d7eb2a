//! `glider monitor`.

use super::monitor_screen::{self, LINES};
use super::{Output, Verdict};
use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use rig::flight::board_log::Image;
use rig::flight::onboard_log::{self, Wanted};
use rig::flight::under_way::{Follower, Moment, Recent};
use rig::flight::utc;
use rig::seats::BAUD;
use rig::seats::port::Port;
use rig::seats::{Link, Seat, SeatError, Wire, qemu};
use serde_json::json;
use signals::{Counters, Manifest, ToBoard, ToHost};
use std::cell::Cell;
use std::collections::VecDeque;
use std::io::{IsTerminal, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

/// Lines of a log that wait to be shown: as many as are shown at once, however long the log is.
const LINES_AHEAD: usize = 1000;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider monitor /dev/ttyACM0
  glider monitor /dev/ttyACM0 --log /dev/ttyUSB0 --elf firmware.elf
  glider monitor /dev/ttyACM0 --seconds 5 --json
  glider monitor /dev/ttyACM0 --flight-log out/recovered
  glider monitor /dev/ttyACM0 --flight-log out/morning --from 2026-11-27T06:00 --to 2026-11-27T12:00
  glider monitor out/first

Ctrl-C ends. Into a pipe goes a line a second, with --json a document a line; with --seconds one summary.
The board's log (defmt) comes on its USART2: give that port, or the file QEMU writes.
The vehicle's state is read from the board's log flash; a port has one program at a time: to watch
a board while glider fly flies it, name the folder of fly's --log instead, which ends with the flight.
--flight-log reads what the board wrote to its log flash in flight and ends; glider compare takes
the result with --vehicle.")]
pub struct Args {
    /// Serial port of the board's link (USART1), or the folder of a flight that `glider fly --log` is writing.
    #[arg(value_name = "PORT|DIR")]
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
    /// Of the flight log read only what was written from then on, UTC: 2026-11-27T10:40:00Z, or a day for its beginning.
    #[arg(long, value_name = "UTC", requires = "flight_log", value_parser = parse_utc)]
    from: Option<u64>,
    /// And up to then.
    #[arg(long, value_name = "UTC", requires = "flight_log", value_parser = parse_utc)]
    to: Option<u64>,
    /// Stop after this many seconds; default: never.
    #[arg(long)]
    seconds: Option<f64>,
}

fn parse_utc(text: &str) -> Result<u64, String> {
    utc::parse(text).map_err(|e| format!("{e:#}"))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let screen = Screen {
        started: Instant::now(),
        drawn: std::io::stdout().is_terminal() && !output.json,
        json: output.json,
        printed: Cell::new(None),
        seconds: args.seconds.filter(|s| *s >= 0.0),
    };
    if Path::new(&args.port).is_dir() {
        ensure!(
            args.log.is_none() && args.elf.is_none() && args.flight_log.is_none(),
            "--log, --elf and --flight-log are of a board: name its serial port, not a folder"
        );
        return watch_flight(Path::new(&args.port), &screen, output);
    }
    ensure!(
        !Path::new(&args.port).is_file(),
        "{}: is a file; name the serial port of a board, or the folder that glider fly --log writes",
        args.port
    );
    let mut link = Link::new(Port::open(&args.port)?);
    let manifest = link.hello()?;
    if let Some(directory) = &args.flight_log {
        return read_flight_log(&mut link, directory, args, output);
    }
    watch_board(&mut link, &manifest, args, &screen, output)
}

/// Where it is drawn, and until when.
struct Screen {
    started: Instant,
    drawn: bool,
    json: bool,
    printed: Cell<Option<Instant>>,
    seconds: Option<f64>,
}

impl Screen {
    fn over(&self) -> bool {
        self.seconds.is_some_and(|s| self.started.elapsed().as_secs_f64() >= s)
    }

    fn show(&self, text: &str) -> std::io::Result<()> {
        if self.drawn {
            // Home, then every line cleared to its end: no flicker.
            print!("\x1b[H{}\x1b[J", text.replace('\n', "\x1b[K\n"));
            std::io::stdout().flush()?;
        }
        Ok(())
    }

    /// Whether what comes is printed as it comes: into a pipe without an end that is known.
    fn tells(&self) -> bool {
        !self.drawn && self.seconds.is_none()
    }

    /// What is known at the end: the last document of many in a line as those before it.
    fn finish(&self, document: &serde_json::Value, text: &str, output: &Output) {
        if self.json && self.tells() {
            println!("{document}");
            return;
        }
        output.emit(document, || {
            if !self.drawn {
                print!("{text}");
            }
        });
    }

    /// One line a second of what comes: a document with `--json`.
    fn tell(&self, line: &str, document: &serde_json::Value) {
        if self.tells() && self.printed.get().is_none_or(|t| t.elapsed() >= Duration::from_secs(1)) {
            self.printed.set(Some(Instant::now()));
            if self.json { println!("{document}") } else { println!("{line}") }
        }
    }

    fn wait(&self) {
        let left = self.seconds.map_or(f64::INFINITY, |s| s - self.started.elapsed().as_secs_f64());
        std::thread::sleep(Duration::from_secs_f64(left.clamp(0.0, 0.25)));
    }
}

/// A flight that another program flies, by its log.
fn watch_flight(directory: &Path, screen: &Screen, output: &Output) -> anyhow::Result<Verdict> {
    let mut follower = Follower::open(directory)?;
    loop {
        let end = follower.read()?;
        let mut rows = vec![format!("{}    watched {:.0} s", directory.display(), screen.started.elapsed().as_secs_f64()), String::new()];
        rows.extend(monitor_screen::flight(&follower.recent.moments));
        rows.extend([String::new(), end.as_ref().map_or("under way".to_owned(), |end| format!("end: {end}"))]);
        let text = monitor_screen::fitted(&rows);
        screen.show(&text)?;
        if end.is_some() || screen.over() {
            let now = follower.recent.moments.back().map(Moment::document);
            screen.finish(&json!({ "log": directory, "flight": now, "end": end }), &text, output);
            return Ok(Verdict::Ok);
        }
        if let Some(now) = follower.recent.moments.back() {
            screen.tell(&monitor_screen::line(now), &now.document());
        }
        screen.wait();
    }
}

/// Time between two looks into a board's log: at 115,200 baud its newest sectors take a second.
const LOG_EVERY: Duration = Duration::from_secs(2);

/// A board: its line, the vehicle by its log flash, its own log.
fn watch_board<W: Wire>(link: &mut Link<W>, manifest: &Manifest, args: &Args, screen: &Screen, output: &Output) -> anyhow::Result<Verdict> {
    let log = match &args.log {
        Some(path) => Some(follow(path, args.elf.clone())?),
        None => None,
    };
    let mut lines: VecDeque<String> = VecDeque::new();
    let mut before: Option<(Instant, Counters)> = None;
    // None: this board keeps no log.
    let mut recent = Some(Recent::default());
    let mut looked: Option<Instant> = None;
    loop {
        let counters = report(link)?;
        if let Some(known) = recent.as_mut().filter(|_| looked.is_none_or(|t| t.elapsed() >= LOG_EVERY)) {
            match onboard_log::read(link, &Wanted::newest(2), |_| {}) {
                Ok(found) => known.take(&found.cycles),
                Err(_) => recent = None,
            }
            looked = Some(Instant::now());
        }
        if let Some(log) = &log {
            for line in log.try_iter().take(LINES_AHEAD) {
                if screen.tells() && !screen.json {
                    println!("{line}");
                }
                lines.push_back(line);
            }
            while lines.len() > LINES {
                lines.pop_front();
            }
        }
        let now = Instant::now();
        let rate = before.map_or(0.0, |(then, c)| f64::from(counters.accepted.saturating_sub(c.accepted)) / (now - then).as_secs_f64());
        before = Some((now, counters));
        let mut rows = monitor_screen::board(&link.describe(), manifest, &counters, rate, screen.started.elapsed());
        rows.push(String::new());
        match &recent {
            Some(known) => rows.extend(monitor_screen::flight(&known.moments)),
            None => rows.push("flight  this board keeps no flight log; of one that glider fly flies: monitor DIR".to_owned()),
        }
        rows.push(if log.is_some() { "board log".to_owned() } else { "board log: give --log PORT|FILE to see it".to_owned() });
        let room = LINES.saturating_sub(rows.len() + 1);
        rows.extend(lines.iter().skip(lines.len().saturating_sub(room)).cloned());
        let text = monitor_screen::fitted(&rows);
        screen.show(&text)?;
        let vehicle = recent.as_ref().and_then(|r| r.moments.back());
        let line = format!(
            "accepted {}, damaged {}; {}",
            counters.accepted,
            counters.damaged,
            vehicle.map_or(String::new(), monitor_screen::line)
        );
        let vehicle = vehicle.map(Moment::document);
        screen.tell(
            &line,
            &json!({ "board": link.describe(), "accepted": counters.accepted, "damaged": counters.damaged, "flight": vehicle }),
        );
        if screen.over() {
            let document = json!({ "board": link.describe(), "firmware": manifest.firmware, "table_standard": format!("{:08x}", manifest.table_standard),
                "table_low_ar": format!("{:08x}", manifest.table_low_ar), "config": format!("{:08x}", manifest.config), "cycle_ms": manifest.cycle_ms,
                "boots": manifest.boots, "hil": manifest.hil, "accepted": counters.accepted, "damaged": counters.damaged, "other_version": counters.version,
                "unknown": counters.unknown, "overflow": counters.overflow, "repeated": counters.repeated, "stale": counters.stale, "flight": vehicle, "log": lines });
            screen.finish(&document, &text, output);
            return Ok(Verdict::Ok);
        }
        screen.wait();
    }
}

/// Least control cycles in a sector of the log: 4 KiB of entries of at most 256 bytes.
const CYCLES_PER_SECTOR: usize = 15;

fn read_flight_log<W: Wire>(link: &mut Link<W>, directory: &Path, args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let (Some(from), Some(to)) = (args.from, args.to) {
        ensure!(from <= to, "--from {} is after --to {}", utc::iso(from), utc::iso(to));
    }
    let bar = ProgressBar::new_spinner()
        .with_style(ProgressStyle::with_template("{spinner} {pos} sectors read, {elapsed}").unwrap_or(ProgressStyle::default_spinner()));
    let last = args.last.unwrap_or(usize::MAX);
    let sectors = args.last.map_or(usize::MAX, |n| n.div_ceil(CYCLES_PER_SECTOR) + 1);
    let wanted = Wanted { sectors, from_ms: args.from, to_ms: args.to };
    let found = onboard_log::read(link, &wanted, |n| bar.set_position(n as u64))?;
    bar.finish_and_clear();
    let cycles = found.cycles.get(found.cycles.len().saturating_sub(last)..).unwrap_or_default();
    let flights = onboard_log::write(cycles, directory, &link.describe())?;
    let ends = [cycles.iter().find_map(|c| c.0), cycles.iter().rev().find_map(|c| c.0)].map(|utc| utc.map(|utc| utc::iso(utc.ms)));
    let document = json!({ "board": link.describe(), "cycles": cycles.len(), "flights": flights, "undated": found.undated,
        "first_utc": ends[0], "last_utc": ends[1] });
    output.emit(&document, || {
        let none = if flights.is_empty() { ": the log is empty, or of other times" } else { "" };
        println!("{} control cycles in {} flights{none}", cycles.len(), flights.len());
        match &ends {
            [Some(first), Some(last)] => println!("from {first} to {last}"),
            _ if cycles.is_empty() => {}
            _ => println!("UTC unknown: nobody set this board's clock, and it had no fix"),
        }
        if found.undated > 0 {
            println!("{} cycles of unknown UTC left out; without --from and --to they are read", found.undated);
        }
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
    // A reader that is slower than the log holds it up, not in memory.
    let (sender, lines) = sync_channel(LINES_AHEAD);
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
