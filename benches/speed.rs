//! Time of everything that somebody waits for. `cargo bench -p benches [-- NAME]`
//!
//! criterion, because it writes every median with its interval to disk, where
//! the table of the README is made from them; divan prints them only.
//!
//! What computes is measured in CPU time of its thread, what waits for another
//! thread or program (the seats) by the wall clock.
//!
//! Real flights and QEMU take part where they are there, and are said to be
//! skipped where not. Diagnoses of a day and of a month (`growth`) are run once
//! each, after the rest.

use benches::{cpu_time, flown, frames, hidden, log, results, scratch, shallow};
use control::{Config, State};
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, Throughput};
use discovery::diagnosis::{Diagnosis, diagnose};
use discovery::preprocess;
use discovery::workbench::{add, compare};
use hil_host::pages::Provenance;
use hydro::effects::{Active, CATALOGUE};
use hydro::{Flow, Polar as _};
use logs::{Flight, Vehicle, export, import};
use plant::{Effect, EffectKind, World};
use rig::flight::vehicles::Model;
use rig::flight::worlds;
use rig::seats::CYCLE_S;
use rig::seats::in_process::InProcess;
use rig::seats::pty::Pty;
use rig::seats::qemu::{self, Qemu};
use rig::seats::{Link, Seat};
use signals::link::MAX_WIRE;
use signals::{Micros, Reply, Request, ToBoard, ToHost, Wings, encode};
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

/// CPU time of the measuring thread.
struct Cpu;

impl Measurement for Cpu {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        cpu_time()
    }
    fn end(&self, begin: Duration) -> Duration {
        cpu_time() - begin
    }
    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }
    fn zero(&self) -> Duration {
        Duration::ZERO
    }
    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }
    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// Points of a polar.
const ANGLES: u32 = 4000;

/// The model, the table, the law, the world: one call each.
fn rooms(c: &mut Criterion<Cpu>) {
    let model = Model::sea(Wings::Standard).expect("a built-in vehicle");
    let all: Vec<Active> = CATALOGUE
        .iter()
        .map(|e| {
            let p = e.parameters[0];
            Active::sized(e, if p.off + p.typical <= p.high { p.off + p.typical } else { p.off - p.typical })
        })
        .collect();
    let busy = Model::sea(Wings::Standard).expect("a built-in vehicle").with_effects(&all);
    let sweep = |m: &Model| {
        for i in 0..ANGLES {
            let alpha = 0.7 * (f64::from(i) / f64::from(ANGLES) - 0.5);
            black_box(m.force(black_box(&Flow::steady(alpha, 0.3))));
        }
    };
    let mut group = c.benchmark_group("polar");
    group.throughput(Throughput::Elements(u64::from(ANGLES)));
    group.bench_function("bare", |b| b.iter(|| sweep(&model)));
    group.bench_function("all-effects", |b| b.iter(|| sweep(&busy)));
    let table = polar::builtin(Wings::Standard).expect("the built-in table");
    group.bench_function("table", |b| {
        b.iter(|| {
            for i in 0..ANGLES {
                black_box(table.at(black_box(0.7 * (i as f32 / ANGLES as f32 - 0.5))));
            }
        });
    });
    group.finish();

    let frames = frames().expect("a flight");
    let mut group = c.benchmark_group("step");
    group.throughput(Throughput::Elements(frames.len() as u64));
    group.bench_function("control", |b| {
        let config = Config::new(control::Settings::slocum_100()).expect("built-in settings");
        b.iter(|| {
            let mut state = State::new(&config, shallow(), Micros(0));
            for frame in &frames {
                black_box(control::step(&config, Some(&table), &mut state, frame.time, black_box(frame)));
            }
        });
    });
    group.throughput(Throughput::Elements(1));
    group.bench_function("plant", |b| {
        let mission = shallow();
        let mut world = World::new(worlds::for_mission(&mission)).expect("a built-in world");
        let mut down = true;
        b.iter(|| {
            let depth_m = world.truth().depth_m;
            down = if depth_m > 24.0 { false } else { depth_m < 5.0 || down };
            let sign = if down { -1.0 } else { 1.0 };
            black_box(world.sense());
            let command = signals::ActuatorCommand { ballast_m3: sign * 230e-6, battery_mass_m: sign * 0.008, ..Default::default() };
            world.advance(&command, CYCLE_S);
        });
    });
    group.finish();
}

/// Plant and controller in one process: the whole shallow mission.
fn closed_loop(c: &mut Criterion<Cpu>) {
    let mission = shallow();
    c.benchmark_group("mission")
        .bench_function("in-process", |b| b.iter(|| flown(&mission, &mut Link::new(InProcess::default())).expect("flown")));
}

fn image() -> Option<std::path::PathBuf> {
    if !qemu::is_installed() {
        eprintln!("skipped: no qemu-system-arm");
        return None;
    }
    qemu::find_image().map_err(|e| eprintln!("skipped: {e}")).ok()
}

/// One exchange, and the whole shallow mission in lockstep, through a line.
fn seats(c: &mut Criterion) {
    let mission = shallow();
    let frame = frames().expect("a flight")[0];
    let image = image();
    // The same frame again is answered without a second step: this is the line alone.
    let mut trip = |name: &str, seat: &mut dyn Seat| {
        seat.hello().expect("an answer");
        seat.begin(&mission).expect("a mission");
        c.benchmark_group("round-trip").bench_function(name, |b| b.iter(|| black_box(seat.exchange(&frame).expect("an answer"))));
    };
    trip("pty", &mut Link::new(Pty::new().expect("a pseudo-terminal")));
    if let Some(image) = &image {
        trip("qemu", &mut Link::new(Qemu::start(image, None).expect("QEMU starts")));
    }
    let mut group = c.benchmark_group("mission");
    // Opening a seat and booting an image is not flying: the flight's own clock counts.
    let own = |out: rig::flight::closed_loop::Outcome| Duration::from_secs_f64(out.wall_s);
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    group.bench_function("pty", |b| {
        b.iter_custom(|n| {
            (0..n).map(|_| own(flown(&mission, &mut Link::new(Pty::new().expect("a pseudo-terminal"))).expect("flown"))).sum()
        });
    });
    if let Some(image) = &image {
        group.bench_function("qemu", |b| {
            b.iter_custom(|n| {
                let fly = || {
                    let mut seat = Link::new(Qemu::start(image, None).expect("QEMU starts"));
                    // The first answer comes when it has booted.
                    seat.hello().expect("an answer");
                    own(flown(&mission, &mut seat).expect("flown"))
                };
                (0..n).map(|_| fly()).sum()
            });
        });
    }
    group.finish();
}

/// What a person at the workbench waits for, on a simulated log of 3 h.
fn learning(c: &mut Criterion<Cpu>) {
    let (flight, vehicle) = log(3.0, Some(hidden())).expect("a log");
    let prepared = preprocess::prepare(&flight, &vehicle);
    let problem = discovery::likelihood::Problem::new(&prepared, &vehicle, |_| true);
    let drag = hydro::effects::by_name("climb_drag").expect("in the catalogue");
    let mut group = c.benchmark_group("3h-log");
    group.sample_size(10);
    group.bench_function("model-once", |b| b.iter(|| black_box(problem.model(&discovery::model::parameters::State::nominal()))));
    group.bench_function("compare", |b| b.iter(|| black_box(compare::compare(&flight, &vehicle))));
    group.bench_function("dynamic-fit", |b| b.iter(|| black_box(add::add(&flight, &vehicle, &[], &[]).expect("a fit"))));
    group.bench_function("dynamic-fit-with-effect", |b| b.iter(|| black_box(add::add(&flight, &vehicle, &[drag], &[]).expect("a fit"))));
    group.bench_function("diagnose", |b| {
        b.iter(|| black_box(diagnose(&flight, &vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("a diagnosis")))
    });
    let nothing = log(3.0, None).expect("a log");
    group.bench_function("diagnose-nothing", |b| {
        b.iter(|| {
            black_box(diagnose(&nothing.0, &nothing.1, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("a diagnosis"))
        })
    });
    let found = diagnose(&flight, &vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    let page = scratch().join("report.html");
    group.bench_function("report", |b| {
        b.iter(|| {
            let made = hil_host::pages::flight_report::page(&found, &vehicle, "bench", Provenance::of_this_run());
            made.write(&page).expect("written");
        });
    });
    let file = scratch().join("log.nc");
    export::netcdf::write(&flight, &file, &export::netcdf::About::default()).expect("written");
    group.bench_function("import-netcdf", |b| b.iter(|| black_box(import::import(&file, &[]).expect("an import"))));
    let csv = scratch().join("flight.csv");
    export::csv::write(&flight, std::fs::File::create(&csv).expect("a file")).expect("written");
    group.bench_function("read-csv", |b| b.iter(|| black_box(logs::record::csv::flight(&csv).expect("our own log reads"))));
    group.finish();
}

/// The same with a flight of a real vehicle.
fn real(c: &mut Criterion<Cpu>) {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS") else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set): import of DBD files, NetCDF of a Seaglider");
        return;
    };
    let mut group = c.benchmark_group("real");
    group.sample_size(10);
    let sources = [("import-dbd", "slocum_comet2016/raw"), ("import-seaglider", "seaglider_sg171/p1710104.nc")];
    for (name, path) in sources {
        let path = Path::new(&root).join(path);
        if path.exists() {
            group.bench_function(name, |b| b.iter(|| black_box(import::import(&path, &[]).expect("an import"))));
        } else {
            eprintln!("skipped: {} is not there", path.display());
        }
    }
    group.finish();
}

/// One diagnosis and its CPU time, s.
fn diagnosed(flight: &Flight, vehicle: &Vehicle) -> (f64, Diagnosis) {
    let begin = cpu_time();
    let found = diagnose(flight, vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    ((cpu_time() - begin).as_secs_f64(), found)
}

/// Diagnoses of longer and longer logs, once each: hours, rows, seconds.
fn growth() -> Vec<(f64, usize, f64)> {
    let mut out: Vec<(f64, usize, f64)> = Vec::new();
    for hours in [3.0, 24.0, 720.0] {
        let (flight, vehicle) = log(hours, Some(hidden())).expect("a log");
        let (seconds, found) = diagnosed(&flight, &vehicle);
        let exponent =
            out.last().map_or(String::new(), |(h, _, s)| format!(", grows as length^{:.2}", (seconds / s).ln() / (hours / h).ln()));
        println!(
            "diagnose {hours:>4} h log: {:>7} rows, {seconds:8.2} s{exponent}; {} {:?}",
            flight.len(),
            found.verdict.name(),
            found.answer
        );
        out.push((hours, flight.len(), seconds));
    }
    out
}

/// Effects hidden one at a time in a log of 3 h.
const KINDS: [EffectKind; 12] = [
    EffectKind::ClimbDrag,
    EffectKind::DragLevelError,
    EffectKind::LiftSlopeError,
    EffectKind::SideEdgeLift,
    EffectKind::Stall,
    EffectKind::HullCompressibility,
    EffectKind::BallastOffset,
    EffectKind::BallastScale,
    EffectKind::PitchOffset,
    EffectKind::AddedMass,
    EffectKind::VerticalCurrent,
    EffectKind::InternalWave,
];

/// Diagnoses of 3 h logs with another effect of typical size hidden in each, once each: seconds, fastest first.
fn kinds() -> Vec<f64> {
    let one = |kind: EffectKind| {
        let (flight, vehicle) = log(3.0, Some(Effect::typical(kind))).expect("a log");
        let (seconds, found) = diagnosed(&flight, &vehicle);
        println!("diagnose 3 h, {kind:?} hidden: {seconds:8.2} s; {} {:?}", found.verdict.name(), found.answer);
        seconds
    };
    let mut out: Vec<f64> = KINDS.into_iter().map(one).collect();
    out.sort_by(f64::total_cmp);
    out
}

/// Streaming memory bandwidth of one core, B/s, and its multiply-add rate, flop/s: the best of five.
fn limits() -> (f64, f64) {
    let memory = vec![1.0f64; 16 << 20];
    let flops_of = 400_000_000u32;
    let best = |work: &dyn Fn() -> f64, amount: f64| {
        (0..5).fold(0.0f64, |best, _| {
            let begin = cpu_time();
            black_box(work());
            best.max(amount / (cpu_time() - begin).as_secs_f64())
        })
    };
    let read = || memory.chunks_exact(16).fold([0.0f64; 16], |s, c| std::array::from_fn(|i| s[i] + c[i])).iter().sum();
    // 32 chains side by side: enough to fill every multiplier however wide.
    let compute = || {
        let mut chains = [0.5f64; 32];
        let (a, b) = (black_box(0.999), black_box(1e-3));
        for _ in 0..flops_of / 64 {
            chains = chains.map(|x| x * a + b);
        }
        chains.iter().sum()
    };
    (best(&read, 8.0 * memory.len() as f64), best(&compute, f64::from(flops_of)))
}

/// Everything that is no time of criterion's, and criterion's own medians (ns), into one table.
fn write_table(grown: &[(f64, usize, f64)], told: &[f64]) -> anyhow::Result<()> {
    let mut text = String::new();
    let mission = shallow();
    let flight = flown(&mission, &mut Link::new(InProcess::default()))?;
    let frames = frames()?;
    let mut wire = [0; MAX_WIRE];
    let out = frames
        .get(frames.len() / 2)
        .and_then(|f| encode(&Request { session: u32::MAX, id: u16::MAX, message: ToBoard::Sensor(*f) }, &mut wire).ok())
        .unwrap_or(0);
    let mut board = Link::new(InProcess::default());
    board.hello()?;
    board.begin(&mission)?;
    let answers: Vec<_> = frames.iter().map(|f| board.exchange(f)).collect::<Result<_, _>>()?;
    let back = answers
        .get(answers.len() / 2)
        .and_then(|a| encode(&Reply { to: u16::MAX, message: ToHost::Answer(*a) }, &mut wire).ok())
        .unwrap_or(0);
    let (bandwidth, flops) = limits();
    let (short, _) = log(3.0, None)?;
    for (key, value, unit) in [
        ("mission.seconds", flight.duration_s, "s"),
        ("mission.cycles", flight.cycles as f64, "1"),
        ("wire.out", out as f64, "bytes"),
        ("wire.back", back as f64, "bytes"),
        ("limit.bandwidth", bandwidth, "B/s"),
        ("limit.flops", flops, "flop/s"),
        ("log.rows", short.len() as f64, "1"),
    ] {
        writeln!(text, "{key}\t{value}\t{unit}")?;
    }
    for (hours, rows, seconds) in grown {
        writeln!(text, "growth.{hours}h\t{seconds}\ts\ngrowth.{hours}h.rows\t{rows}\t1")?;
    }
    if let (Some(median), Some(slowest)) = (told.get(told.len() / 2), told.last()) {
        writeln!(text, "kinds.median\t{median}\ts\nkinds.slowest\t{slowest}\ts\nkinds.count\t{}\t1", told.len())?;
    }
    let folder = results();
    std::fs::create_dir_all(&folder)?;
    // Of a part of the measurements the rest is kept as it was.
    let criterion = folder.with_file_name("criterion");
    for group in std::fs::read_dir(&criterion)?.flatten() {
        for name in std::fs::read_dir(group.path()).into_iter().flatten().flatten() {
            let Ok(told) = std::fs::read_to_string(name.path().join("new/estimates.json")) else { continue };
            let told: serde_json::Value = serde_json::from_str(&told)?;
            let median = &told["median"];
            let (low, high) = (&median["confidence_interval"]["lower_bound"], &median["confidence_interval"]["upper_bound"]);
            let key = format!("{}.{}", group.file_name().to_string_lossy(), name.file_name().to_string_lossy());
            writeln!(text, "{key}\t{}\t{low}\t{high}\tns", median["point_estimate"])?;
        }
    }
    let path = folder.join("speed.tsv");
    if grown.is_empty()
        && let Ok(before) = std::fs::read_to_string(&path)
    {
        before.lines().filter(|l| l.starts_with("growth.") || l.starts_with("kinds.")).for_each(|l| text += &format!("{l}\n"));
    }
    std::fs::write(&path, text)?;
    println!("wrote {}", path.display());
    Ok(())
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` and `--all-targets` start this program too: a measurement is no test.
    if !arguments.iter().any(|a| a == "--bench") {
        println!("measured by `cargo bench -p benches`");
        return;
    }
    let usual = || Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let mut computing = usual().with_measurement(Cpu).configure_from_args();
    rooms(&mut computing);
    closed_loop(&mut computing);
    learning(&mut computing);
    real(&mut computing);
    computing.final_summary();
    let mut waiting = usual().configure_from_args();
    seats(&mut waiting);
    waiting.final_summary();
    let parts: Vec<&String> = arguments.iter().filter(|a| !a.starts_with("--")).collect();
    let wanted = parts.is_empty() || parts.iter().any(|a| *a == "growth");
    let (grown, told) = if wanted { (growth(), kinds()) } else { (Vec::new(), Vec::new()) };
    let _ = std::fs::remove_dir_all(scratch());
    if let Err(e) = write_table(&grown, &told) {
        eprintln!("no table of results: {e:#}");
    }
    let _ = std::fs::remove_dir_all(scratch());
}
