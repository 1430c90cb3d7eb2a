//! The files of a folder that may be logs.

use std::path::{Path, PathBuf};

/// Whether a file in a folder is of no log: hidden (macOS puts "._NAME" next to NAME), half downloaded, or an editor's backup.
fn is_clutter(path: &Path) -> bool {
    const ENDS: [&str; 8] = ["~", ".part", ".partial", ".crdownload", ".download", ".tmp", ".swp", ".bak"];
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    name.starts_with('.') || ENDS.iter().any(|end| name.ends_with(end))
}

/// The files of a folder, in the order of their names, without hidden and unfinished ones.
///
/// # Errors
/// What the system says.
pub fn files_of(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.filter_map(|e| e.ok().map(|e| e.path())).filter(|p| p.is_file() && !is_clutter(p)).collect();
    files.sort();
    Ok(files)
}

/// What the folders of a glider's two computers are called where its card was copied whole: navigation, and science or payload; and the
/// folder of logs in them.
const OF_COMPUTERS: [&str; 11] = ["nav", "navigation", "gli", "flight", "fli", "glider", "sci", "science", "pld", "pld1", "payload"];
const OF_LOGS: &str = "logs";

/// The files in those folders of this one; none where there is one of them alone.
#[must_use]
pub fn of_two_computers(folder: &Path) -> Vec<PathBuf> {
    let named = |p: &PathBuf| p.file_name().is_some_and(|n| OF_COMPUTERS.iter().any(|c| n.eq_ignore_ascii_case(c)));
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut folders: Vec<PathBuf> = entries.filter(|p| p.is_dir() && named(p)).collect();
    folders.sort();
    let files = |f: &PathBuf| [f.clone(), f.join(OF_LOGS)].iter().flat_map(|f| files_of(f).unwrap_or_default()).collect::<Vec<_>>();
    if folders.len() < 2 { Vec::new() } else { folders.iter().flat_map(files).collect() }
}

/// Links of a folder to files that are not there, in words.
#[must_use]
pub fn dangling(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut links: Vec<PathBuf> = entries.filter(|p| p.is_symlink() && !p.exists()).collect();
    links.sort();
    links.iter().map(|p| format!("{} is a link to a file that is not there", p.display())).collect()
}
