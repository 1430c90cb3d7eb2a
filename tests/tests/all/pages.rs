//! The page and the report as a person meets them: headless Chromium drives
//! the live workbench and the offline report. Skipped loudly where there is no
//! chromedriver (scripts/setup-browser brings it).

use base64::Engine as _;
use fantoccini::wd::{Capabilities, WebDriverCompatibleCommand};
use fantoccini::{Client, ClientBuilder, Locator};
use hil_host::pages::{Provenance, flight_report};
use hil_host::serve::{Workbench, run};
use plant::trials::{Site, Spec, Wing, catalogue, generate};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A chromedriver that ends with the test.
pub struct Driver {
    child: Child,
    port: u16,
    profile: PathBuf,
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.profile);
    }
}

fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).map_or(9515, |a| a.port())
}

pub fn driver(name: &str) -> Option<Driver> {
    let port = free_port();
    let child = Command::new("chromedriver").arg(format!("--port={port}")).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let Ok(child) = child else {
        eprintln!("skipped: no chromedriver (scripts/setup-browser brings it)");
        return None;
    };
    let profile = std::env::temp_dir().join(format!("glider-page-test-{name}-{}", std::process::id()));
    let until = Instant::now() + Duration::from_secs(20);
    while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(50));
    }
    Some(Driver { child, port, profile })
}

impl Driver {
    pub async fn browser(&self) -> Client {
        let mut wanted = Capabilities::new();
        let flags = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--window-size=1280,1000",
            "--disable-dev-shm-usage",
        ];
        let mut args: Vec<String> = flags.map(String::from).to_vec();
        args.push(format!("--user-data-dir={}", self.profile.display()));
        wanted.insert("goog:chromeOptions".into(), json!({"args": args}));
        wanted.insert("goog:loggingPrefs".into(), json!({"browser": "ALL"}));
        ClientBuilder::new(hyper_util::client::legacy::connect::HttpConnector::new())
            .capabilities(wanted)
            .connect(&format!("http://127.0.0.1:{}", self.port))
            .await
            .expect("chromedriver gives a session")
    }
}

/// Chromium's console, which WebDriver itself does not name.
#[derive(Debug)]
struct ConsoleLog;

impl WebDriverCompatibleCommand for ConsoleLog {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/se/log", session.unwrap_or_default()))
    }

    fn method_and_body(&self, _: &url::Url) -> (http::Method, Option<String>) {
        (http::Method::POST, Some(json!({"type": "browser"}).to_string()))
    }
}

pub async fn console_errors(c: &Client) -> Vec<String> {
    let log = c.issue_cmd(ConsoleLog).await.expect("the console can be read");
    let entries = log.as_array().cloned().unwrap_or_default();
    entries.iter().filter(|e| e["level"] == "SEVERE").map(ToString::to_string).collect()
}

/// Text of an element once it satisfies `done`.
pub async fn wait_text(c: &Client, selector: &str, done: impl Fn(&str) -> bool, seconds: u64) -> String {
    let until = Instant::now() + Duration::from_secs(seconds);
    let mut last = String::new();
    while Instant::now() < until {
        if let Ok(e) = c.find(Locator::Css(selector)).await {
            last = e.text().await.unwrap_or_default();
            if done(&last) {
                return last;
            }
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("{selector}: still {last:?} after {seconds} s");
}

pub async fn click(c: &Client, selector: &str) {
    c.find(Locator::Css(selector))
        .await
        .unwrap_or_else(|e| panic!("{selector}: {e}"))
        .click()
        .await
        .unwrap_or_else(|e| panic!("{selector}: {e}"));
}

pub async fn js(c: &Client, code: &str, args: Vec<Value>) -> Value {
    c.execute(code, args).await.unwrap_or_else(|e| panic!("{code}: {e}"))
}

/// Serious findings of axe-core; none where it is not on this machine.
pub async fn axe(c: &Client) -> Vec<String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/axe.min.js");
    let Ok(source) = std::fs::read_to_string(&file) else {
        eprintln!("skipped: no axe-core (scripts/setup-browser brings it)");
        return Vec::new();
    };
    js(c, &source, vec![]).await;
    let code = "const done = arguments[arguments.length - 1]; axe.run().then((r) => done(r.violations.filter((v) => ['serious', 'critical'].includes(v.impact)).map((v) => v.id + ': ' + v.nodes.map((n) => n.html).slice(0, 3).join(' | '))));";
    let found = c.execute_async(code, vec![]).await.expect("axe runs");
    found.as_array().cloned().unwrap_or_default().iter().map(|v| v.as_str().unwrap_or_default().to_owned()).collect()
}

/// The page on a dark screen: nothing that a person with weak eyes would miss there, and a picture to be looked at.
async fn in_the_dark(c: &Client, name: &str) {
    let theme = "document.documentElement.dataset.theme = arguments[0]; dispatchEvent(new Event('resize'));";
    js(c, theme, vec![json!("dark")]).await;
    let ground = js(c, "return getComputedStyle(document.body).backgroundColor;", vec![]).await;
    assert_eq!(ground, json!("rgb(16, 23, 29)"), "the page is dark");
    screenshot(c, &format!("{name}-dark"), 1280).await;
    assert_eq!(axe(c).await, Vec::<String>::new(), "{name} on a dark screen");
    js(c, theme, vec![json!("light")]).await;
}

pub async fn screenshot(c: &Client, name: &str, width: u32) {
    c.set_window_size(width, 1400).await.expect("the window can be sized");
    js(c, "scrollTo(0, 0);", vec![]).await;
    tokio::time::sleep(Duration::from_millis(400)).await;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/screenshots");
    std::fs::create_dir_all(&folder).expect("a folder below target");
    std::fs::write(folder.join(format!("{name}-{width}.png")), c.screenshot().await.expect("a screenshot")).expect("written");
}

/// The page as a printer gets it, to be looked at.
async fn print_pdf(c: &Client, name: &str) {
    js(c, "dispatchEvent(new Event('beforeprint'));", vec![]).await;
    let pdf = c.print(fantoccini::wd::PrintConfiguration::default()).await.expect("it prints");
    js(c, "dispatchEvent(new Event('afterprint'));", vec![]).await;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/screenshots");
    std::fs::create_dir_all(&folder).expect("a folder for pictures");
    std::fs::write(folder.join(format!("{name}.pdf")), pdf).expect("written");
}

pub async fn no_sideways_scroll(c: &Client, name: &str) {
    let over = js(c, "return document.documentElement.scrollWidth - document.documentElement.clientWidth;", vec![]).await;
    assert!(over.as_f64().is_some_and(|o| o <= 1.0), "{name}: the page is {over} px wider than the window");
}

/// A flight whose truth has a strong effect that its model lacks.
pub fn puzzle(folder: &Path) -> PathBuf {
    let spec = Spec::single(Site::Lake, Wing::Standard, catalogue::Effect::ClimbDrag, catalogue::Strength::Strong);
    hil_host::score::diagnosis::write_case(folder, &generate(&spec, 5, 0)).expect("a case can be written")
}

/// Runs the program; its JSON.
fn glider(args: &[&str]) -> Value {
    let exe = std::env::current_exe().expect("a test");
    let out =
        Command::new(exe.ancestors().nth(2).expect("its folder").join("glider")).args(args).arg("--json").output().expect("it is built");
    serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("glider {args:?}: {e}\n{}", String::from_utf8_lossy(&out.stderr)))
}

/// The flight with the table of a vehicle that an effect is added to, in the world that it describes, by the command line.
pub fn flown_with(effect: &str, case: &Path, folder: &Path) -> Value {
    let path = |p: &Path| p.to_string_lossy().into_owned();
    let (flight, given, learnt) = (path(case), path(&case.join("vehicle.json")), path(&folder.join("learnt.json")));
    glider(&["add", effect, "--flight", &flight, "--out", &learnt]);
    glider(&["fly", "--mission", "sea", "--seed", "0", "--world", &learnt, "--table", &learnt, "--beside", &given])
}

/// Undo takes a tick back, with the history of the error; ticking again is one more step of it.
async fn undo_and_tick_again(c: &Client, before: &str, after: &str) {
    let history = wait_text(c, "#history", |t| t.contains('→'), 10).await;
    assert!(history.ends_with(&format!("{before} → {after}")), "{history}");
    // Ladder as bars: as wide as the error is large.
    let bars = "return ['nominal', 'now', 'floor'].map((k) => { const s = document.getElementById('error-' + k).parentElement; const t = s.querySelector('.track'); return t.firstChild.getBoundingClientRect().width / t.clientWidth; });";
    let shares: Vec<f64> = js(c, bars, vec![]).await.as_array().expect("three").iter().filter_map(Value::as_f64).collect();
    let share = after.parse::<f64>().expect("a number") / before.parse::<f64>().expect("a number");
    assert!((shares[0] - 1.0).abs() < 0.02 && (shares[1] - share).abs() < 0.02 && shares[2] > 0.0, "{shares:?}, {share}");
    click(c, "#undo").await;
    assert_eq!(wait_text(c, "#error-now", |t| t == before, 20).await, before);
    // A redraw of the values from before the fit is asked for with it, and held back until the fit is drawn: it changes nothing.
    let both = "document.getElementById('take').click(); document.getElementById('second').dispatchEvent(new Event('change'));";
    js(c, both, vec![]).await;
    assert_eq!(wait_text(c, "#error-now", |t| t == after, 30).await, after);
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(wait_text(c, "#error-now", |_| true, 10).await, after);
}

/// Pointing at a moment in a chart over time rings it in the others; pointing at a point moves the cursors over time.
async fn one_moment_in_all_charts(c: &Client) {
    let of = |mark: &str| format!("[...document.querySelectorAll('#work .plot')].map((b) => b.handle).filter((h) => {mark})");
    let code = format!(
        "const time = {}, scatter = {}, done = arguments[arguments.length - 1];
         const u = time[0].plot, i = Math.floor(u.data[0].length / 2);
         u.setCursor({{ left: u.valToPos(u.data[0][i], 'x'), top: 20 }}, true, true);
         const t = u.data[0][u.cursor.idx];
         const rings = scatter.map((h) => {{ const r = h.plot.over.querySelector('.ring'); return r && !r.hidden ? [parseFloat(r.style.left), parseFloat(r.style.top)] : null; }});
         const owed = scatter.map((h) => {{ const s = h.chart.series[0]; let b = -1; h.chart.at.forEach((v, k) => {{ if (v != null && s.x[k] != null && s.y[k] != null && (b < 0 || Math.abs(v - t) < Math.abs(h.chart.at[b] - t))) b = k; }}); return [h.plot.valToPos(s.x[b], 'x'), h.plot.valToPos(s.y[b], 'y')]; }});
         const cells = [...document.querySelectorAll('#work svg .ring')].filter((r) => r.getAttribute('visibility') === 'visible').length;
         const h = scatter[0], s = h.chart.series[0], k = s.x.findIndex((x, n) => n > 20 && x != null && s.y[n] != null);
         h.plot.setCursor({{ left: h.plot.valToPos(s.x[k], 'x'), top: h.plot.valToPos(s.y[k], 'y') }}, true, true);
         setTimeout(() => done({{ rings, owed, cells, moved: time.map((v) => v.plot.data[0][v.plot.cursor.idx]), at: h.chart.at[k] }}), 300);",
        of("h.chart.group"),
        of("h.chart.at && h.plot")
    );
    let seen = c.execute_async(&code, vec![]).await.expect("the charts answer");
    let (rings, owed) = (seen["rings"].as_array().expect("rings"), seen["owed"].as_array().expect("places"));
    assert!(rings.len() >= 2, "{seen}");
    for (ring, place) in rings.iter().zip(owed) {
        for axis in 0..2 {
            assert!(ring[axis].as_f64().zip(place[axis].as_f64()).is_some_and(|(a, b)| (a - b).abs() < 1.5), "{seen}");
        }
    }
    assert!(seen["cells"].as_f64().is_some_and(|n| n >= 1.0), "the map shows its cell: {seen}");
    let at = seen["at"].as_f64().expect("a moment");
    for moved in seen["moved"].as_array().expect("charts over time") {
        assert!(moved.as_f64().is_some_and(|t| (t - at).abs() < 60.0), "{seen}");
    }
}

pub fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime")
}

/// The plus key zooms into a chart.
async fn zoom_by_keyboard(c: &Client) {
    // Of the charts with axes, the second; bars and maps have none to zoom.
    let mark = "[...document.querySelectorAll('#page .plot')].filter(b => b.handle.plot)[1].setAttribute('data-zoomed', '');";
    js(c, mark, vec![]).await;
    let span = "const s = document.querySelector('[data-zoomed]').handle.plot.scales.x; return s.max - s.min;";
    let before = js(c, span, vec![]).await.as_f64().expect("a span");
    js(c, "document.querySelector('[data-zoomed]').focus();", vec![]).await;
    c.find(Locator::Css("[data-zoomed]")).await.expect("a chart").send_keys("+").await.expect("plus zooms");
    let after = js(c, span, vec![]).await.as_f64().expect("a span");
    assert!(after < 0.6 * before, "{before} -> {after}");
}

/// The flight from the archive, opened first, laid over this one; then this one over itself: their difference is nothing.
async fn two_flights_in_one_chart(c: &Client) {
    for (second, name) in [("1", "archive"), ("2", "flight")] {
        let choose = "const s = document.getElementById('second'); s.value = arguments[0]; s.dispatchEvent(new Event('change'));";
        js(c, choose, vec![json!(second)]).await;
        let drawn = "const all = document.querySelector('#work .plot').handle.chart.series, f = all.find((s) => s.name.startsWith('difference')); return f && all.some((s) => s.name === arguments[0]) ? f.y.filter((v) => v != null) : null;";
        let until = Instant::now() + Duration::from_secs(20);
        let difference = loop {
            match js(c, drawn, vec![json!(format!("measured ({name})"))]).await.as_array() {
                Some(list) => break list.iter().filter_map(Value::as_f64).collect::<Vec<_>>(),
                None if Instant::now() > until => panic!("no difference to {name} is drawn"),
                None => tokio::time::sleep(Duration::from_millis(100)).await,
            }
        };
        let most = difference.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        assert!(difference.len() > 50 && (name != "flight" || most < 1e-9), "{name}: {} values, at most {most} cm/s", difference.len());
    }
    js(c, "const s = document.getElementById('second'); s.value = ''; s.dispatchEvent(new Event('change'));", vec![]).await;
}

/// Stops of the tabulator from where the focus is to an element.
async fn stops(c: &Client, id: &str) -> usize {
    for stop in 1..=20 {
        c.active_element().await.expect("a focus").send_keys("\u{e004}").await.expect("a key");
        if js(c, "return document.activeElement.id;", vec![]).await == json!(id) {
            return stop;
        }
    }
    panic!("{id} is not reached in 20 stops");
}

/// The answer has its four parts in words and as charts, and what can be done with it is a few keys away.
async fn four_parts(c: &Client, told: &Value) {
    assert_eq!(js(c, "return document.activeElement.id;", vec![]).await, json!("answer"), "the focus is at the answer");
    for id in ["take", "save", "fly-it"] {
        js(c, "document.getElementById('answer').focus();", vec![]).await;
        assert!(stops(c, id).await <= 6, "{id}");
    }
    let shown = wait_text(c, "#verdict", |t| t.contains("What next"), 10).await;
    for part in ["What moved", "What is missing", "What could hide", "What next"] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let rows = "return [...document.querySelectorAll('#verdict .plot')].map((b) => b.handle.chart).map((h) => [h.title, (h.categories || []).length]);";
    let charts = js(c, rows, vec![]).await;
    let with_interval = told["moved"].as_array().expect("numbers").iter().filter(|n| n["low"].is_number()).count();
    assert!(with_interval >= 8 && charts[0][1].as_u64() == Some(with_interval as u64), "{charts}, {with_interval}");
    assert!(charts.as_array().is_some_and(|c| c.len() == 4), "{charts}");
}

/// What hides is drag that differs between dives and climbs: written as an expression it is fitted.
async fn an_effect_of_ones_own(c: &Client, recalibrated: f64) {
    c.find(Locator::Css("#own")).await.expect("a field").send_keys("cd += k*(1+phase)\u{e007}").await.expect("typed, and Enter");
    wait_text(c, "#error-now", |t| t.parse::<f64>().is_ok_and(|now| now < 0.9 * recalibrated), 60).await;
    c.find(Locator::Css("#fx-cd-k-1-phase-")).await.expect("its box").send_keys(" ").await.expect("unticked");
}

/// Flies in the pty seat and breaks the hull: the vehicle comes home.
async fn break_the_hull(c: &Client) {
    js(c, "document.getElementById('seat').value = 'pty'; document.getElementById('pace').value = '200';", vec![]).await;
    click(c, "#fly").await;
    wait_text(c, "#live-status", |t| t.starts_with("Flying"), 30).await;
    wait_text(c, "#live-phase", |t| t == "Dive", 60).await;
    click(c, "[data-fault='hull:leak']").await;
    let end = wait_text(c, "#live-status", |t| t.starts_with("End"), 120).await;
    assert!(end.contains("safe: Leak"), "{end}");
}

#[test]
fn a_person_finds_the_missing_effect_on_the_page_and_flies_it() {
    let Some(driver) = driver("workbench") else { return };
    let folder = std::env::temp_dir().join(format!("glider-page-flight-{}", std::process::id()));
    let case = puzzle(&folder);
    let flight = logs::record::csv::flight(&case).expect("our own case reads");
    let told = glider(&["diagnose", "--flight", &case.to_string_lossy()]);
    let flown = flown_with(told["answer"][0].as_str().expect("an answer"), &case, &folder);
    let (gain, _) = flown["range_gain_in_words"].as_str().and_then(|words| words.split_once(", over")).expect("a gain with its interval");
    let nc = folder.join("archive.nc");
    let about = logs::export::netcdf::About { start_unix_s: Some(1.7e9), written_unix_s: 1.78e9, ..Default::default() };
    logs::export::netcdf::write(&flight, &nc, &about).expect("an archive's file is written");
    let archive = base64::engine::general_purpose::STANDARD.encode(std::fs::read(&nc).expect("just written"));
    let cm = |key: &str| format!("{:.3}", 100.0 * told["block_error_m_s"][key].as_f64().expect("an error"));

    let (address, at) = std::sync::mpsc::channel();
    let bench = Workbench { logs: folder.join("logs"), ..Workbench::default() };
    std::thread::spawn(move || run(0, bench, |a| drop(address.send(a.to_owned()))));
    let address = at.recv_timeout(Duration::from_secs(20)).expect("the server starts");

    runtime().block_on(async {
        let c = driver.browser().await;
        c.goto(&address).await.expect("the page opens");
        wait_text(&c, "#status", |t| t.starts_with("Ready"), 20).await;

        // The example, for a person without a flight.
        click(&c, "#example").await;
        wait_text(&c, "#status", |t| t.contains("Flight open"), 60).await;
        wait_text(&c, "#summary", |t| t.starts_with("example: "), 10).await;
        assert_eq!(js(&c, "return document.activeElement.id;", vec![]).await, json!("find"), "the focus is where to go on");

        // Nonsense next: a clear message, and the page stays.
        let drop_files = "const t = new DataTransfer(); for (const [n, s] of arguments[0]) t.items.add(new File([s], n)); document.getElementById('drop').dispatchEvent(new DragEvent('drop', {dataTransfer: t, bubbles: true, cancelable: true}));";
        js(&c, drop_files, vec![json!([["flight.csv", "time_s,depth\n1,abc\n"], ["vehicle.json", "{"]])]).await;
        let message = wait_text(&c, "#status", |t| t.contains("flight.csv") || t.contains("vehicle.json"), 20).await;
        assert!(!message.contains("panicked"), "{message}");

        // A log file as a glider's archive has it, no vehicle beside it: bytes, read as the import reads them.
        let drop_bytes = "const b = Uint8Array.from(atob(arguments[1]), (c) => c.charCodeAt(0)); const t = new DataTransfer(); t.items.add(new File([b], arguments[0])); document.getElementById('drop').dispatchEvent(new DragEvent('drop', {dataTransfer: t, bubbles: true, cancelable: true}));";
        js(&c, drop_bytes, vec![json!("archive.nc"), json!(archive)]).await;
        wait_text(&c, "#status", |t| t.contains("Flight open"), 60).await;
        wait_text(&c, "#notes", |t| t.contains("How it was read"), 10).await;
        let summary = wait_text(&c, "#summary", |t| t.contains("rows"), 10).await;
        assert!(summary.starts_with("archive: "), "{summary}");

        // Drag the flight in: the number is the command line's.
        let text = |name: &str| std::fs::read_to_string(case.join(name)).expect("written above");
        js(&c, drop_files, vec![json!([["flight.csv", text("flight.csv")], ["vehicle.json", text("vehicle.json")]])]).await;
        wait_text(&c, "#error-nominal", |t| t == cm("nominal"), 30).await;

        two_flights_in_one_chart(&c).await;

        // Find what is missing, tick it, see the error fall to the command line's value; on a machine that draws the charts late.
        let late = "const f = fetch; fetch = async (to, o) => { if (String(to).includes('/api/evaluate')) await new Promise((r) => setTimeout(r, 700)); return f(to, o); };";
        js(&c, late, vec![]).await;
        click(&c, "#find").await;
        wait_text(&c, "#find-status", |t| t.starts_with("Verdict"), 120).await;
        assert_eq!(told["answer"], json!(["climb_drag"]), "this strong case is told by the command line");
        four_parts(&c, &told).await;
        click(&c, "#take").await;
        assert_eq!(wait_text(&c, "#error-now", |t| t != "–" && t != cm("nominal"), 30).await, cm("after"));
        assert_eq!(wait_text(&c, "#error-recalibrated", |t| t != "–", 10).await, cm("recalibrated"));
        let floor = format!("{:.3}", told["error"]["noise_floor"].as_f64().expect("a floor"));
        assert_eq!(wait_text(&c, "#error-floor", |t| t != "–", 10).await, floor);
        wait_text(&c, "#worth", |t| t.contains("beyond recalibration"), 10).await;
        undo_and_tick_again(&c, &cm("nominal"), &cm("after")).await;
        one_moment_in_all_charts(&c).await;
        wait_text(&c, "#gain-climb_drag", |t| t.starts_with('−'), 10).await;
        // An effect that was not refitted has no figure: it does not gain all of the error.
        let gains = js(&c, "return [...document.querySelectorAll('.gain')].map((g) => g.textContent);", vec![]).await;
        let all = format!("−{} cm/s", cm("recalibrated"));
        assert!(gains.as_array().is_some_and(|g| g.iter().all(|t| *t != json!(all))), "{gains}");
        wait_text(&c, "#verdict", |t| t.contains("What next"), 10).await;
        screenshot(&c, "workbench-answer", 1280).await;
        print_pdf(&c, "workbench").await;
        // What next: a mission, or why there is none; and the report to keep.
        click(&c, "#next").await;
        wait_text(&c, "#save-status", |t| t.starts_with("Saved next.toml") || t.starts_with("no dives"), 60).await;
        click(&c, "#report").await;
        wait_text(&c, "#save-status", |t| t.starts_with("Saved flight.html"), 60).await;

        click(&c, "#timeline").await;
        wait_text(&c, "#save-status", |t| t.contains("14 steady rows"), 60).await; // dives of a quarter of an hour
        // Loaded again, all is as it was.
        c.refresh().await.expect("the page loads again");
        wait_text(&c, "#status", |t| t.contains("as it was"), 30).await;
        assert_eq!(wait_text(&c, "#error-now", |t| t != "–" && t != cm("nominal"), 30).await, cm("after"));
        wait_text(&c, "#verdict", |t| t.contains("What next"), 10).await;

        // Fly in the learnt world with the old table and the new: the gain is the command line's.
        js(&c, "document.getElementById('mission').value = 'sea'; document.getElementById('learnt').checked = true;", vec![]).await;
        click(&c, "#fly").await;
        let both = wait_text(&c, "#both", |t| t.contains("% range"), 120).await;
        assert!(both.contains(gain), "{both}: the command line says {gain}");
        js(&c, "document.getElementById('mission').value = 'shallow'; document.getElementById('learnt').checked = false;", vec![]).await;

        // Unticking by keyboard brings the model as given back.
        c.find(Locator::Css("#fx-climb_drag")).await.expect("its box").send_keys(" ").await.expect("space unticks");
        assert_eq!(wait_text(&c, "#error-now", |t| t == cm("nominal"), 20).await, cm("nominal"));

        an_effect_of_ones_own(&c, cm("recalibrated").parse().expect("cm/s")).await;
        zoom_by_keyboard(&c).await;
        break_the_hull(&c).await;

        assert_eq!(axe(&c).await, Vec::<String>::new());
        in_the_dark(&c, "workbench").await;
        screenshot(&c, "workbench", 1280).await;
        screenshot(&c, "workbench", 390).await;
        no_sideways_scroll(&c, "workbench at 390 px").await;
        let loaded = js(&c, "return performance.getEntriesByType('resource').map((e) => e.name);", vec![]).await;
        let origin = address.split("/?").next().unwrap_or_default();
        for name in loaded.as_array().expect("a list") {
            assert!(name.as_str().is_some_and(|n| n.starts_with(origin) || n.starts_with("data:")), "a request left this server: {name}");
        }
        // Chromium logs the refused nonsense (400) as an error of the network, not of the page.
        let errors: Vec<String> = console_errors(&c).await.into_iter().filter(|e| !e.contains("status of 400")).collect();
        assert_eq!(errors, Vec::<String>::new());
        c.close().await.expect("the browser closes");
    });
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn the_offline_report_opens_zooms_and_asks_nothing_of_the_network() {
    let Some(driver) = driver("report") else { return };
    let folder = std::env::temp_dir().join(format!("glider-page-report-{}", std::process::id()));
    let case = puzzle(&folder);
    let flight = logs::record::csv::flight(&case).expect("our own case reads");
    let vehicle = logs::vehicle::read(&case.join("vehicle.json")).expect("our own vehicle reads");
    let found = discovery::diagnosis::diagnose(&flight, &vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {})
        .expect("our own case can be diagnosed");
    let file = folder.join("report.html");
    flight_report::page(&found, &vehicle, "case", Provenance::of_this_run()).write(&file).expect("the page is written");
    let bytes = std::fs::metadata(&file).expect("the page is there").len();
    assert!(bytes < 1_000_000, "{bytes} bytes");

    runtime().block_on(async {
        let c = driver.browser().await;
        c.goto(&format!("file://{}", file.display())).await.expect("the page opens");
        let first = wait_text(&c, ".answer", |t| t.contains("What next"), 10).await;
        let number = format!("{:.3} cm/s as given", 100.0 * found.block_error_m_s[0]);
        assert!(first.contains(&number), "{first}");
        let charts = c.find_all(Locator::Css(".uplot")).await.expect("charts").len();
        assert!(charts >= 5, "{charts} charts");
        // Hover: the legend follows the cursor.
        let hover = "const b = [...document.querySelectorAll('.plot')].find((b) => b.handle.plot), p = b.handle.plot; p.setCursor({left: p.over.clientWidth / 2, top: 20}); return b.querySelector('.u-legend .u-value').textContent;";
        let value = js(&c, hover, vec![]).await;
        assert!(value.as_str().is_some_and(|v| v.trim().parse::<f64>().is_ok()), "{value}");
        // And the moment is ringed where angle of attack is an axis, and in the maps over speed and over time.
        let rings = "return [document.querySelectorAll('i.ring:not([hidden])').length, document.querySelectorAll('svg .ring[visibility=visible]').length];";
        assert_eq!(js(&c, rings, vec![]).await, json!([1, 2]));
        assert_eq!(axe(&c).await, Vec::<String>::new());
        in_the_dark(&c, "report").await;
        // Printed from a dark screen: white paper, dark ink.
        js(&c, "document.documentElement.dataset.theme = 'dark'; dispatchEvent(new Event('beforeprint'));", vec![]).await;
        assert_eq!(js(&c, "return document.documentElement.dataset.theme;", vec![]).await, json!("light"));
        js(&c, "dispatchEvent(new Event('afterprint'));", vec![]).await;
        assert_eq!(js(&c, "return document.documentElement.dataset.theme;", vec![]).await, json!("dark"));
        print_pdf(&c, "report").await;
        js(&c, "document.documentElement.dataset.theme = 'light'; dispatchEvent(new Event('resize'));", vec![]).await;
        screenshot(&c, "report", 1280).await;
        screenshot(&c, "report", 390).await;
        no_sideways_scroll(&c, "report at 390 px").await;
        let loaded = js(&c, "return performance.getEntriesByType('resource').length;", vec![]).await;
        assert_eq!(loaded, json!(0));
        assert_eq!(console_errors(&c).await, Vec::<String>::new());
        c.close().await.expect("the browser closes");
    });
    let _ = std::fs::remove_dir_all(&folder);
}
