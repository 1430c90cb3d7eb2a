//! Every command of docs/tour.md, docs/truth-file.md and (with real flights) docs/month.md, run as printed, in an empty folder; what the
//! pages show of their output and their pictures is what came out. `scripts/fill-docs` puts what came out into the pages.
//!
//! In a page, a block ```` ```sh ```` is run line by line, ```` ```bash ```` as one script, and ```` ```toml NAME ```` is saved under that
//! name. Each line of ```` ```text ```` must be a line of what the block of commands before it printed, in order (```` ```text glider
//! loop ````: of the last command of a `sh` block that starts so). Lines that differ in their numbers alone are the ones that get filled.

use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("hil-host/ lies in the workspace").to_path_buf()
}

fn filling() -> bool {
    std::env::var_os("GLIDER_FILL_DOCS").is_some()
}

/// A fenced block: what stands behind the fence, the number of its first line (from 0), its lines.
struct Block<'a> {
    kind: &'a str,
    first: usize,
    lines: Vec<&'a str>,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut out = Vec::new();
    let mut inside: Option<Block> = None;
    for (number, line) in page.lines().enumerate() {
        match (line.strip_prefix("```"), inside.take()) {
            (Some(kind), None) => inside = Some(Block { kind, first: number + 1, lines: Vec::new() }),
            (Some(_), Some(block)) => out.push(block),
            (None, Some(mut block)) => {
                block.lines.push(line);
                inside = Some(block);
            }
            (None, None) => {}
        }
    }
    out
}

/// A line without its numbers and spaces: what tells which line of an output it is.
fn skeleton(line: &str) -> String {
    line.chars().filter(|c| !c.is_ascii_digit() && !" .+-−–│─█|".contains(*c)).collect()
}

/// Runs one command as printed; what it wrote to standard output, and its exit code.
fn run(line: &str, work: &Path) -> String {
    let (line, remark) = line.split_once(" #").unwrap_or((line, ""));
    let owed = if remark.contains("exit code 1") { 1 } else { 0 };
    let mut words = line.split_whitespace();
    assert_eq!(words.next(), Some("glider"), "the page uses glider alone: {line}");
    // As printed: no word of a page is quoted or expanded.
    assert!(!line.contains(['\'', '"', '$', '*', '|', '>']), "{line}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
    command.args(words).current_dir(work).stdin(Stdio::null());
    if line.starts_with("glider serve") {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the workbench starts");
        let mut first = String::new();
        let read = BufReader::new(child.stdout.take().expect("its output")).read_line(&mut first);
        child.kill().expect("it was running until now");
        let _ = child.wait();
        assert!(read.is_ok() && first.contains("http://127.0.0.1:"), "{line}: {first}");
        return String::new();
    }
    let out = command.output().expect("the program starts");
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert_eq!(out.status.code(), Some(owed), "{line}\n{text}{}", String::from_utf8_lossy(&out.stderr));
    text
}

/// Runs a block in bash, where `glider` is the program; what it wrote to standard output.
fn shell(lines: &[&str], work: &Path) -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_glider")).parent().expect("the folder of the program");
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let mut bash = Command::new("bash");
    bash.args(["-euo", "pipefail", "-c", &lines.join("\n")]).env("PATH", path).env("LC_ALL", "C.UTF-8");
    let out = bash.current_dir(work).stdin(Stdio::null()).output().expect("bash starts");
    assert!(out.status.success(), "{}\n{}", lines.join("\n"), String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

/// Runs a page; returns it as it should read, and what is stale in it.
fn walk(page: &str, name: &str, work: &Path) -> (String, String) {
    let mut lines: Vec<String> = page.lines().map(str::to_owned).collect();
    let mut stale = String::new();
    let mut printed: Vec<(String, String)> = Vec::new();
    let mut last_block = String::new();
    for block in blocks(page) {
        if block.kind == "sh" {
            last_block.clear();
            for line in block.lines.iter().filter(|l| !l.trim().is_empty()) {
                let text = run(line, work);
                last_block += &text;
                printed.push(((*line).to_owned(), text));
            }
        } else if block.kind == "bash" {
            last_block = shell(&block.lines, work);
        } else if let Some(file) = block.kind.strip_prefix("toml ") {
            std::fs::write(work.join(file), block.lines.join("\n")).expect("the folder of the page");
        } else if let Some(of) = block.kind.strip_prefix("text") {
            let of = of.trim();
            let text = if of.is_empty() {
                last_block.as_str()
            } else {
                printed.iter().rev().find(|p| p.0.starts_with(of)).map_or_else(|| panic!("{name}: no command `{of}`"), |p| p.1.as_str())
            };
            let mut rest = text.lines();
            for (i, shown) in block.lines.iter().enumerate().filter(|(_, l)| !l.trim().is_empty() && **l != "…") {
                let at = block.first + i;
                match rest.by_ref().find(|l| skeleton(l) == skeleton(shown)) {
                    Some(now) if now.trim_end() == shown.trim_end() => {}
                    Some(now) => {
                        let _ = writeln!(stale, "{name}:{}: {shown}\n{:width$}now {now}", at + 1, "", width = name.len() + 2);
                        now.trim_end().clone_into(&mut lines[at]);
                    }
                    None => panic!("{name}:{}: nothing printed looks like this line:\n{shown}\nprinted:\n{text}", at + 1),
                }
            }
        }
    }
    (lines.join("\n") + "\n", stale)
}

/// Every picture of a page was made by a command of it; returns which differ from those in the repository.
fn pictures(page: &str, work: &Path) -> String {
    let mut stale = String::new();
    for name in page.split("](pictures/").skip(1).filter_map(|s| s.split(')').next()) {
        let made = std::fs::read(work.join(name)).unwrap_or_else(|e| panic!("{name}: no command of the page makes it ({e})"));
        // 60 kB: a page with five of them loads at once on a slow line.
        assert!(made.starts_with(b"<svg") && made.len() <= 60_000, "{name}: {} bytes", made.len());
        let kept = root().join("docs/pictures").join(name);
        if std::fs::read(&kept).ok().as_deref() != Some(&made) {
            let _ = writeln!(stale, "docs/pictures/{name} is another picture now");
            if filling() {
                std::fs::write(kept, made).expect("docs/pictures");
            }
        }
    }
    stale
}

fn page_is_true(name: &str, fewest_commands: usize) {
    let file = root().join("docs").join(name);
    let page = std::fs::read_to_string(&file).expect(name);
    let commands = blocks(&page).iter().filter(|b| ["sh", "bash"].contains(&b.kind)).map(|b| b.lines.len()).sum::<usize>();
    assert!(commands >= fewest_commands, "{name}: {commands} commands");
    let work = std::env::temp_dir().join(format!("glider-docs-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&work).expect("a temporary folder");
    let (now, mut stale) = walk(&page, name, &work);
    stale += &pictures(&page, &work);
    std::fs::remove_dir_all(&work).expect("the temporary folder");
    if filling() {
        std::fs::write(&file, now).expect(name);
    } else {
        assert!(stale.is_empty(), "stale (scripts/fill-docs mends it):\n{stale}");
    }
}

#[test]
fn the_tour_shows_what_its_commands_print() {
    page_is_true("tour.md", 12);
}

#[test]
fn the_page_on_truth_files_shows_what_its_commands_print() {
    page_is_true("truth-file.md", 6);
}

#[test]
fn the_page_on_a_month_shows_what_its_commands_print() {
    if std::env::var_os("GLIDER_FLIGHTS").is_none() {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    }
    page_is_true("month.md", 8);
}

#[test]
fn a_stale_number_is_found_and_another_line_is_none() {
    assert_eq!(skeleton("L/D            1.978 achieved"), skeleton("L/D      2.1 achieved"));
    assert_ne!(skeleton("L/D 1.978 achieved"), skeleton("L/D 1.978 best"));
    let page = "a\n```sh\nx\n```\n```text\nb 1\n```\n";
    let kinds: Vec<_> = blocks(page).iter().map(|b| (b.kind, b.first, b.lines.clone())).collect();
    assert_eq!(kinds, [("sh", 2, vec!["x"]), ("text", 5, vec!["b 1"])]);
}

/// README.md and the pages of docs/: path and text.
fn pages() -> Vec<(PathBuf, String)> {
    let docs = std::fs::read_dir(root().join("docs")).expect("docs").flatten().map(|e| e.path());
    let files = docs.chain([root().join("README.md")]).filter(|f| f.extension().is_some_and(|e| e == "md"));
    files.map(|f| (f.clone(), std::fs::read_to_string(f).expect("a page"))).collect()
}

#[test]
fn no_table_cell_is_longer_than_25_words() {
    let mut long = String::new();
    for (file, text) in pages() {
        for (number, line) in text.lines().enumerate().filter(|(_, l)| l.starts_with('|')) {
            for cell in line.trim_matches('|').split(" | ").filter(|c| c.split_whitespace().count() > 25) {
                let _ = writeln!(long, "{}:{}: {} words: {cell}", file.display(), number + 1, cell.split_whitespace().count());
            }
        }
    }
    assert!(long.is_empty(), "a paragraph below the table says it better:\n{long}");
}

/// Paragraphs and list items outside fenced blocks: number of the first line (from 1), words.
fn paragraphs(page: &str) -> Vec<(usize, usize)> {
    let (mut fenced, mut open) = (false, false);
    let mut out: Vec<(usize, usize)> = Vec::new();
    for (number, line) in page.lines().map(str::trim).enumerate() {
        let fence = line.starts_with("```");
        fenced ^= fence;
        if fence || fenced || line.is_empty() || line.starts_with(['#', '|']) {
            open = false;
            continue;
        }
        let numbered = line.trim_start_matches(|c: char| c.is_ascii_digit());
        let item =
            ["* ", "- ", "+ "].iter().any(|mark| line.starts_with(mark)) || numbered.len() < line.len() && numbered.starts_with(". ");
        if !open || item {
            out.push((number + 1, 0));
        }
        open = true;
        out.last_mut().expect("one is open").1 += line.split_whitespace().count();
    }
    out
}

#[test]
fn no_paragraph_is_longer_than_120_words() {
    assert_eq!(paragraphs("a b\nc\n\n```sh\nd e\n```\n* f\n  g h\n2. i\n| j |\n"), [(1, 3), (7, 4), (9, 2)]);
    let mut long = String::new();
    for (file, text) in pages() {
        for (line, words) in paragraphs(&text).into_iter().filter(|(_, words)| *words > 120) {
            let _ = writeln!(long, "{}:{line}: {words} words", file.display());
        }
    }
    assert!(long.is_empty(), "two paragraphs, or a list, say it better:\n{long}");
}
