//! Every command of docs/tour.md, run as printed, in an empty folder.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("hil-host/ lies in the workspace").to_path_buf()
}

/// The lines of the `sh` blocks, in order, without comments.
fn commands(page: &str) -> Vec<String> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in page.lines() {
        if line.starts_with("```") {
            inside = line == "```sh";
        } else if inside {
            let command = line.split(" #").next().unwrap_or_default().trim();
            if !command.is_empty() {
                found.push(command.to_owned());
            }
        }
    }
    found
}

#[test]
fn every_command_of_the_tour_works_as_printed() {
    let page = std::fs::read_to_string(root().join("docs/tour.md")).expect("docs/tour.md");
    let lines = commands(&page);
    assert!(lines.len() >= 8, "{lines:?}");
    let program = env!("CARGO_BIN_EXE_glider");
    let work = std::env::temp_dir().join(format!("glider-tour-{}", std::process::id()));
    std::fs::create_dir_all(&work).expect("a temporary folder");
    for line in &lines {
        let mut words = line.split_whitespace();
        assert_eq!(words.next(), Some("glider"), "the tour uses glider alone: {line}");
        let mut command = Command::new(program);
        // As printed: no word of the tour is quoted or expanded.
        assert!(!line.contains(['\'', '"', '$', '*', '|', '>']), "{line}");
        command.args(words).current_dir(&work).stdin(Stdio::null());
        if line.starts_with("glider serve") {
            let mut child = command.stdout(Stdio::piped()).spawn().expect("the workbench starts");
            let mut first = String::new();
            let read = BufReader::new(child.stdout.take().expect("its output")).read_line(&mut first);
            child.kill().expect("it was running until now");
            let _ = child.wait();
            assert!(read.is_ok() && first.contains("http://127.0.0.1:"), "{line}: {first}");
            continue;
        }
        let out = command.output().expect("the program starts");
        assert_eq!(out.status.code(), Some(0), "{line}\n{}", String::from_utf8_lossy(&out.stderr));
    }
    std::fs::remove_dir_all(&work).expect("the temporary folder");
}

#[test]
fn the_pictures_of_the_tour_are_there_and_small() {
    let page = std::fs::read_to_string(root().join("docs/tour.md")).expect("docs/tour.md");
    let pictures: Vec<&str> = page.split("](pictures/").skip(1).filter_map(|s| s.split(')').next()).collect();
    assert!(pictures.len() >= 3, "{pictures:?}");
    for name in pictures {
        let text = std::fs::read_to_string(root().join("docs/pictures").join(name)).expect(name);
        // 60 kB: a page with five of them loads at once on a slow line.
        assert!(text.starts_with("<svg") && text.len() <= 60_000, "{name}: {} bytes", text.len());
        assert!(page.contains(&format!("--out {name}")), "{name} is not made by a command of the tour");
    }
}
