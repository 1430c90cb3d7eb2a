//! Logs of three makes as a person has them, dropped on the page: a csv, a Slocum's binary files, a SeaExplorer's sparse log of 46 h. Each
//! ends in an answer with its four parts and what a new table is worth, or why that is not known.

use crate::pages::{axe, click, console_errors, driver, js, no_sideways_scroll, runtime, screenshot, wait_text};
use base64::Engine as _;
use fantoccini::Client;
use hil_host::serve::{Workbench, run};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Files and what is said of them once they are open.
const LOGS: [(&str, &str); 3] = [
    ("slocum_modena2015/modena-2015-187-0-12_tidy.csv", "9923 rows"),
    ("slocum_comet2019/raw", "comet-2019-218-00-034: "),
    ("seaexplorer_sea035", "45.90 h under way"),
];

/// Name and base64 of a file, or of all files of a folder.
fn contents(path: &Path) -> Vec<Value> {
    let entries = || std::fs::read_dir(path).expect("a folder").map(|e| e.expect("an entry").path());
    let mut files: Vec<PathBuf> = if path.is_dir() { entries().collect() } else { vec![path.to_path_buf()] };
    files.sort();
    let name = |f: &Path| f.file_name().expect("a file").to_string_lossy().into_owned();
    let bytes = |f: &Path| base64::engine::general_purpose::STANDARD.encode(std::fs::read(f).expect("reads"));
    files.iter().map(|f| json!([name(f), bytes(f)])).collect()
}

/// Drops files, asks what is missing, and looks at the answer.
async fn walk(c: &Client, path: &Path, said: &str) {
    let drop = "const t = new DataTransfer(); for (const [n, s] of arguments[0]) t.items.add(new File([Uint8Array.from(atob(s), (c) => c.charCodeAt(0))], n)); document.getElementById('drop').dispatchEvent(new DragEvent('drop', {dataTransfer: t, bubbles: true, cancelable: true}));";
    js(c, drop, vec![json!(contents(path))]).await;
    wait_text(c, "#summary", |t| t.contains(said), 120).await;
    click(c, "#find").await;
    wait_text(c, "#find-status", |t| t.starts_with("Verdict"), 300).await;
    let answer = wait_text(c, "#verdict", |t| t.contains("What next"), 10).await;
    for part in ["What moved", "What is missing", "What could hide", "Worth: "] {
        assert!(answer.contains(part), "{part}: {answer}");
    }
    // Nothing that is not there is printed.
    assert!(!answer.lines().any(|l| matches!(l.trim(), "null" | "undefined" | "NaN")), "{answer}");
    click(c, "#report").await;
    wait_text(c, "#save-status", |t| t.contains(".html"), 60).await;
    assert_eq!(axe(c).await, Vec::<String>::new());
    let name = format!("dropped-{}", path.file_stem().expect("a name").to_string_lossy());
    screenshot(c, &name, 1280).await;
    screenshot(c, &name, 390).await;
    no_sideways_scroll(c, &name).await;
}

#[test]
fn validate_logs_of_three_makes_dropped_on_the_page_are_answered() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let Some(driver) = driver("logs") else { return };
    let folder = std::env::temp_dir().join(format!("glider-page-logs-{}", std::process::id()));
    let (address, at) = std::sync::mpsc::channel();
    let bench = Workbench { logs: folder.clone(), ..Workbench::default() };
    std::thread::spawn(move || run(0, bench, |a| drop(address.send(a.to_owned()))));
    let address = at.recv_timeout(Duration::from_secs(20)).expect("the server starts");
    runtime().block_on(async {
        let c = driver.browser().await;
        for (log, said) in LOGS {
            c.goto(&address).await.expect("the page opens");
            wait_text(&c, "#status", |t| t.starts_with("Ready") || t.contains("as it was"), 60).await;
            walk(&c, &root.join(log), said).await;
        }
        assert_eq!(console_errors(&c).await, Vec::<String>::new());
        c.close().await.expect("the browser closes");
    });
    let _ = std::fs::remove_dir_all(&folder);
}
