//! `glider launch`.

use super::upload::decode_config;
use super::{Output, Verdict};
use crate::terminal::say;
use anyhow::{Context, ensure};
use control::Config;
use helm::objects::mission_id;
use rig::flight::config_file;
use rig::flight::mission_file::{self, Limits};
use rig::flight::preflight::{Item, judge};
use rig::seats::link::upload::{read_back, upload};
use rig::seats::options;
use rig::seats::port::Port;
use rig::seats::{Link, Seat, SeatError, Wire};
use rig::seats::{clock, image};
use serde_json::{Value, json};
use signals::{Mission, Object, Preflight, Stroke, ToBoard, ToHost};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time between two looks at a check, s of wall time.
const CHECK_POLL: Duration = Duration::from_millis(500);
/// Most looks: strokes of the deep pump take four minutes, and a board in virtual time none.
const MOST_POLLS: u32 = 1_200;
/// Least time over which clocks are compared, s.
const CLOCK_S: f64 = 5.0;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider launch /dev/ttyACM0 --mission sea\n  glider launch /dev/ttyACM0 --mission mission.toml --config vehicle.toml\n  \
glider launch /dev/ttyACM0 --mission sea --check\n\nOn deck or afloat, upright, strap taken out. Pump and battery mass are moved (the vehicle stays buoyant), every sensor is read,\n\
the board's UTC is set by this computer's, and the zero of depth is taken at the launch. Nothing is launched while a line of the check is bad: exit code 1."
)]
pub struct Args {
    /// Serial port of the board.
    port: String,
    /// Built-in mission or a TOML file.
    #[arg(long)]
    mission: String,
    /// Controller configuration (.toml) to upload first; default: the one the board has.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Check only; launch nothing.
    #[arg(long)]
    check: bool,
    /// Set the chip's option bytes first (brown-out level 3, watchdog by hardware); the protection stays as it is.
    #[arg(long)]
    set_option_bytes: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut link = Link::new(Port::open(&args.port)?);
    let config = args.config.as_deref().map(config_file::load).transpose()?;
    let wait = || std::thread::sleep(CHECK_POLL);
    let started = Instant::now();
    let asked = Asked { config, mission: &args.mission, check: args.check, set_options: args.set_option_bytes };
    let here = Here { utc_ms: &clock::system_ms, seconds: Some(&|| started.elapsed().as_secs_f64()) };
    let found = launch(&mut link, &asked, &wait, &here)?;
    let document = found.document();
    output.emit(&document, || found.print());
    Ok(if found.good() { Verdict::Ok } else { Verdict::Negative })
}

/// What is to be launched.
pub struct Asked<'a> {
    /// Configuration to upload first.
    pub config: Option<Config>,
    /// Name or file of the mission.
    pub mission: &'a str,
    /// Check only.
    pub check: bool,
    /// Set the option bytes first.
    pub set_options: bool,
}

/// What came of it.
pub struct Found {
    /// Lines of the check.
    pub items: Vec<Item>,
    /// Identities: table, configuration, mission; none: not launched.
    pub launched: Option<[u32; 3]>,
    check: bool,
}

impl Found {
    /// Every line good, and launched if that was asked for.
    #[must_use]
    pub fn good(&self) -> bool {
        self.items.iter().all(|i| i.good) && (self.check || self.launched.is_some())
    }

    fn document(&self) -> Value {
        let ids = self.launched.map(|ids| ids.map(|id| format!("{id:08x}")));
        json!({ "ready": self.items.iter().all(|i| i.good), "launched": ids.is_some(),
            "check": self.items.iter().map(|i| json!({ "what": i.what, "good": i.good, "found": i.found })).collect::<Vec<_>>(),
            "table": ids.as_ref().map(|i| &i[0]), "config": ids.as_ref().map(|i| &i[1]), "mission": ids.as_ref().map(|i| &i[2]) })
    }

    fn print(&self) {
        for i in &self.items {
            say(&format!("{} {:14} {}", if i.good { "ok  " } else { "BAD " }, i.what, i.found));
        }
        match (self.launched, self.check) {
            (Some([table, config, mission]), _) => {
                say(&format!("LAUNCHED: table {table:08x}, configuration {config:08x}, mission {mission:08x}; zero of depth taken"));
            }
            (None, true) => say("checked only"),
            (None, false) => say("NOT launched: mend what is bad, then launch again"),
        }
    }
}

/// One look at the check of a board on deck.
fn check<W: Wire>(link: &mut Link<W>, stroke: bool) -> Result<Preflight, SeatError> {
    const WHAT: &str = "a check on deck";
    link.request(WHAT, &ToBoard::Check { stroke }, |answer| match answer {
        ToHost::Checked(found) => Some(Ok(found)),
        ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: WHAT, why })),
        _ => None,
    })?
}

/// This computer's time.
pub struct Here<'a> {
    /// UTC, ms since 1970.
    pub utc_ms: &'a dyn Fn() -> f64,
    /// A clock to compare the pace of the board's with, s; none: not compared.
    pub seconds: Option<&'a dyn Fn() -> f64>,
}

/// Checks a board on deck, sets its UTC, and launches its mission if nothing is bad.
///
/// # Errors
/// Bad input, or the board does not answer or refuses.
pub fn launch<W: Wire>(link: &mut Link<W>, asked: &Asked<'_>, wait: &dyn Fn(), here: &Here<'_>) -> anyhow::Result<Found> {
    let manifest = link.hello()?;
    ensure!(!manifest.under_way, "a mission is under way on this board: recall it and recover the vehicle first");
    match &asked.config {
        Some(config) => link.configure(&manifest, config)?,
        None => link.keep(&manifest),
    }
    let config = decode_config(&read_back(link, Object::Config, |_| {})?)?;
    let limits = Limits { working_depth_m: config.working_depth_m, pump_m3: config.pump_m3 };
    let mission: Mission = mission_file::load(asked.mission, |_| limits)?;
    mission.validate(config.working_depth_m, config.pump_m3).map_err(|e| {
        anyhow::anyhow!("--mission {}: not for this vehicle ({e:?}): it dives to {} m", asked.mission, config.working_depth_m)
    })?;
    let mut buffer = [0u8; helm::MAX_OBJECT];
    let bytes = postcard::to_slice(&mission, &mut buffer).map_err(|e| anyhow::anyhow!("--mission {}: does not fit: {e}", asked.mission))?;
    upload(link, Object::Mission, bytes, |_, _| {})?;
    if asked.set_options {
        options::set(link, wait)?;
    }
    let utc = clock::set(link, here.utc_ms).context("the board's UTC cannot be set")?;
    let first = check(link, true)?;
    let mut pair = (None, None);
    let mut found = first;
    for _ in 0..MOST_POLLS {
        wait();
        found = check(link, false)?;
        let now = (found.frame.time.0 as f64 * 1e-6, here.seconds.map(|clock| clock()));
        if found.number > first.number && pair.0.is_none() {
            pair.0 = Some(now);
        }
        pair.1 = Some(now);
        let moving = [found.pump, found.mass].iter().any(|s| matches!(s, Stroke::UnderWay | Stroke::Never));
        let compared = here.seconds.is_none() || elapsed(&pair).is_some_and(|(_, here)| here >= CLOCK_S);
        if !moving && compared {
            break;
        }
    }
    let mut items = judge(&found, &config, elapsed(&pair));
    items.push(Item { what: "UTC", good: utc != clock::Setting::NoClock, found: utc.words() });
    let (Ok(crystal) | Err(crystal)) = utc.crystal();
    items.push(Item { what: "crystal", good: utc.crystal().is_ok(), found: crystal.to_owned() });
    if let Some(image) = &manifest.image {
        items.push(Item { what: "image", good: !image.on_trial(), found: image::words(image) });
    }
    let option_bytes = options::words(options::read(link)?);
    let good = option_bytes.is_ok();
    let (Ok(found) | Err(found)) = option_bytes;
    items.push(Item { what: "option bytes", good, found });
    let ready = items.iter().all(|i| i.good);
    let launched = if ready && !asked.check {
        let table = link.launch(&mission).context("the board refuses the launch")?;
        Some([table, helm::objects::config_id(&config), mission_id(&mission)])
    } else {
        None
    };
    Ok(Found { items, launched, check: asked.check })
}

type Moment = (f64, Option<f64>);

/// Seconds by the board and here between the first and the last look.
fn elapsed((first, last): &(Option<Moment>, Option<Moment>)) -> Option<(f64, f64)> {
    let ((b0, h0), (b1, h1)) = ((*first)?, (*last)?);
    Some((b1 - b0, h1? - h0?))
}
