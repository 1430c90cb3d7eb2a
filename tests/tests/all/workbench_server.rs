//! The workbench's server as a program on the other side of the socket meets
//! it: strangers, tricks with paths, uploads without end, a page that goes
//! away in mid-flight.

use crate::pages::{flown_with, puzzle};
use hil_host::serve::{MAX_REQUEST, Workbench, run};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A running workbench with its logs in a folder of its own.
struct Server {
    port: u16,
    token: String,
    folder: PathBuf,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Server {
    fn start(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("glider-server-{name}-{}", std::process::id()));
        let (address, at) = std::sync::mpsc::channel();
        let bench = Workbench { logs: folder.join("logs"), ..Workbench::default() };
        std::thread::spawn(move || run(0, bench, |a| drop(address.send(a.to_owned()))));
        let address = at.recv_timeout(Duration::from_secs(20)).expect("the server starts");
        let (host, token) = address.split_once("/?token=").expect("an address with a token");
        let port = host.rsplit(':').next().and_then(|p| p.parse().ok()).expect("a port");
        Self { port, token: token.to_owned(), folder }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time limit");
        stream
    }

    /// Sends a head and a body as they are; status and body of the answer.
    fn raw(&self, head: &str, body: &[u8]) -> (u16, String) {
        let mut stream = self.connect();
        stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)).expect("sent");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        split(&text)
    }

    fn head(&self, line: &str, more: &str) -> String {
        format!("{line} HTTP/1.1\r\nhost: 127.0.0.1:{}\r\nx-glider-token: {}\r\nconnection: close\r\n{more}\r\n", self.port, self.token)
    }

    fn get(&self, path: &str) -> (u16, String) {
        self.raw(&self.head(&format!("GET {path}"), ""), b"")
    }

    fn post(&self, path: &str, body: &str) -> (u16, String) {
        let more = format!("content-type: application/json\r\ncontent-length: {}\r\n", body.len());
        self.raw(&self.head(&format!("POST {path}"), &more), body.as_bytes())
    }

    fn is_up(&self) {
        assert_eq!(self.get("/api/catalogue").0, 200, "the server still answers");
    }

    /// Every file below the server's folder, relative, sorted.
    fn files(&self) -> Vec<PathBuf> {
        fn below(folder: &Path, out: &mut Vec<PathBuf>) {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                if entry.path().is_dir() { below(&entry.path(), out) } else { out.push(entry.path()) }
            }
        }
        let mut out = Vec::new();
        below(&self.folder, &mut out);
        out.sort();
        out
    }
}

fn split(text: &str) -> (u16, String) {
    let status = text.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("no status in {text:?}"));
    (status, text.split_once("\r\n\r\n").map(|(_, b)| b.to_owned()).unwrap_or_default())
}

#[test]
fn strangers_are_refused_and_told_why() {
    let s = Server::start("strangers");
    let (port, token) = (s.port, &s.token);
    let ask =
        |host: &str, more: &str| s.raw(&format!("GET /api/catalogue HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n{more}\r\n"), b"");
    let ours = format!("127.0.0.1:{port}");
    let with = format!("x-glider-token: {token}\r\n");
    assert_eq!(ask(&ours, &with).0, 200);
    // DNS rebinding: the name of another site that resolves to this machine.
    let (status, text) = ask(&format!("evil.example:{port}"), &with);
    assert!(status == 403 && text.contains("127.0.0.1"), "{status} {text}");
    for origin in ["https://evil.example", "null", &format!("https://127.0.0.1:{port}")] {
        let (status, text) = ask(&ours, &format!("{with}origin: {origin}\r\n"));
        assert!(status == 403 && text.contains("other sites"), "{origin}: {status} {text}");
    }
    let (status, text) = ask(&ours, "");
    assert!(status == 403 && text.contains("token"), "{status} {text}");
    // A form of another page can post without asking first, but only as text: refused as well.
    let body = r#"{"wings":"standard","mission":"shallow","seat":"in-process","controller":"ours"}"#;
    let form = format!("content-type: text/plain\r\ncontent-length: {}\r\n", body.len());
    assert_eq!(s.raw(&s.head("POST /api/fly", &form), body.as_bytes()).0, 415);
    assert_eq!(s.get("/api/fly").0, 405);
}

#[test]
fn tricks_with_paths_reach_no_file() {
    let s = Server::start("paths");
    for path in ["/../Cargo.toml", "/..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/logs/", "/api/../../etc/passwd"]
    {
        let (status, text) = s.get(path);
        assert_eq!((status, text.as_str()), (404, ""), "{path}");
    }
    let asks = [
        ("/api/open", r#"{"listed":0}"#, "no such flight"),
        ("/api/open", r#"{"listed":"../../etc/passwd"}"#, "listed"),
        ("/api/open", r#"{"files":[{"name":"../../etc/passwd","text":""}]}"#, "passwd: is of no known kind"),
        (
            "/api/open",
            r#"{"files":[{"name":"../../x.csv","text":"a,b\n1,2\n"},{"name":"/etc/y.toml","text":"mass_kg = 1"}]}"#,
            "../../x.csv",
        ),
        ("/api/evaluate", r#"{"flight":0}"#, "not open"),
        ("/api/save", r#"{"flight":0,"effects":{"../../x":[1.0]}}"#, "not open"),
        ("/api/fault", r#"{"spec":"/etc/passwd"}"#, "/etc/passwd"),
    ];
    for (path, body, says) in asks {
        let (status, text) = s.post(path, body);
        assert!((400..500).contains(&status) && text.contains(says), "{path} {body}: {status} {text}");
    }
    let fly = |key: &str, value: &str| {
        let mut ask = serde_json::json!({"wings": "standard", "mission": "shallow", "seat": "in-process", "controller": "ours"});
        ask[key] = value.into();
        s.post("/api/fly", &ask.to_string()).1
    };
    for (key, value) in
        [("mission", "../../etc/passwd"), ("wings", "../../../tmp/x"), ("seat", "/dev/ttyS0"), ("seat", "../x"), ("controller", "/bin/sh")]
    {
        let text = fly(key, value);
        assert!(text.contains("error") && text.contains(value), "{key} {value}: {text}");
    }
    assert!(fly("controller", "stock").contains("\"end\""), "the ordinary controller flies");
    let outside: Vec<_> = s.files().into_iter().filter(|f| !f.starts_with(s.folder.join("logs").join("standard-shallow-1"))).collect();
    assert_eq!(outside, Vec::<PathBuf>::new());
    s.is_up();
}

#[test]
fn an_upload_without_end_is_refused_in_a_sentence() {
    let s = Server::start("upload");
    // Told beforehand: refused before a byte of it is read.
    let more = format!("content-type: application/json\r\ncontent-length: {}\r\n", 10 * MAX_REQUEST);
    let (status, text) = s.raw(&s.head("POST /api/open", &more), b"{");
    assert!(status == 413 && text.contains("80 MB") && text.contains("glider diagnose"), "{status} {text}");
    // Not told: refused when it has become too much.
    let mut stream = s.connect();
    stream
        .write_all(s.head("POST /api/open", "content-type: application/json\r\ntransfer-encoding: chunked\r\n").as_bytes())
        .expect("sent");
    let chunk = [b"100000\r\n".as_slice(), &[b' '; 0x10_0000], b"\r\n"].concat();
    let sent = (0..(2 * MAX_REQUEST) >> 20).take_while(|_| stream.write_all(&chunk).is_ok()).count();
    assert!(sent < (2 * MAX_REQUEST) >> 20, "the server stopped listening after {sent} MB");
    s.is_up();
    // Nonsense of every kind gets an answer.
    for body in ["", "{", "[]", "\u{0}", r#"{"files": 3}"#, &"[".repeat(100_000)] {
        let (status, text) = s.post("/api/open", body);
        assert!((400..500).contains(&status) && !text.is_empty() && !text.contains("panicked"), "{body:.20}: {status} {text}");
    }
    s.is_up();
}

#[test]
fn a_flight_goes_on_when_its_page_is_closed() {
    let s = Server::start("closed");
    let fly = r#"{"wings":"standard","mission":"shallow","seat":"pty","controller":"ours","pace":2000}"#;
    let more = format!("content-type: application/json\r\ncontent-length: {}\r\n", fly.len());
    let mut stream = s.connect();
    stream.write_all(s.head("POST /api/fly", &more).as_bytes()).and_then(|()| stream.write_all(fly.as_bytes())).expect("sent");
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    while !line.contains("\"rows\"") {
        line.clear();
        assert!(reader.read_line(&mut line).expect("rows come as it flies") > 0, "the flight ended before it was seen");
    }
    drop(reader);
    // In the air, without a page: another is refused, the log is on disk.
    let (status, text) = s.post("/api/fly", fly);
    assert!(status == 400 && text.contains("under way"), "{status} {text}");
    s.is_up();
    let log = s.folder.join("logs").join("standard-shallow-1");
    assert!(log.join("flight.csv.unfinished").exists() && !log.join("flight.csv").exists());
    // Called home from a second page; the vehicle ends at the surface and its log says so.
    let (status, text) = s.post("/api/stop", "");
    assert!(status == 200, "{text}");
    let until = Instant::now() + Duration::from_secs(60);
    let summary = loop {
        let done = s.files().into_iter().filter(|f| f.extension().is_some_and(|e| e == "json"));
        let said = done.filter_map(|f| std::fs::read_to_string(f).ok()).find(|t| t.contains("actuator_hash"));
        match said {
            Some(text) => break text,
            None if Instant::now() > until => panic!("no summary in {:?}", s.files()),
            None => std::thread::sleep(Duration::from_millis(50)),
        }
    };
    assert!(summary.contains("safe: Operator"), "{summary}");
    // The summary stands in the vehicle file a moment before the rows get their name.
    while !log.join("flight.csv").exists() && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(20));
    }
    let rows = std::fs::read_to_string(log.join("flight.csv")).expect("the log is kept").lines().count();
    assert!(rows > 10, "{rows} rows");
    // The sky is free again.
    let again = fly.replace("pty", "in-process").replace("2000", "0");
    let free = |(status, text): &(u16, String)| *status == 200 && text.contains("\"end\"");
    // The summary is on disk a moment before the flight has let go.
    let next = std::iter::repeat_with(|| s.post("/api/fly", &again)).take_while(|_| Instant::now() < until).find(free);
    assert!(next.is_some(), "no second flight");
}

#[test]
fn regress_page_and_command_line_give_one_gain_with_its_interval() {
    let s = Server::start("gain");
    let case = puzzle(&s.folder);
    let by_command = flown_with("climb_drag", &case, &s.folder);
    let file = |name: &str| json!({"name": name, "text": std::fs::read_to_string(case.join(name)).expect("written above")});
    let (status, text) = s.post("/api/open", &json!({"files": [file("flight.csv"), file("vehicle.json")]}).to_string());
    assert_eq!(status, 200, "{text}");
    let mut fly = json!({"wings": "standard", "mission": "sea", "seat": "in-process", "controller": "ours",
                         "learnt": {"flight": 0, "effects": ["climb_drag"]}});
    let began = Instant::now();
    let (_, text) = s.post("/api/fly", &fly.to_string());
    println!("both tables in 21 worlds took {:?}", began.elapsed());
    // Between the documents stand lengths of chunks, which are JSON too.
    let lines: Vec<Value> = text.lines().filter_map(|l| serde_json::from_str(l).ok()).filter(Value::is_object).collect();
    let by_page = lines.last().expect("a summary");
    for key in ["range_gain", "range_gain_90"] {
        assert_eq!(by_page[key], by_command[key], "{key}: {by_page}");
    }
    assert_eq!(by_page["beside"]["worlds"], by_command["beside"]["worlds"]);
    assert_eq!(lines.iter().filter(|l| l["worlds"].is_number()).count(), 20, "progress");
    fly["controller"] = "stock".into();
    let (_, text) = s.post("/api/fly", &fly.to_string());
    assert!(text.contains("flies no table"), "{text}");
}
