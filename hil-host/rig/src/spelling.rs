//! What was probably meant where a name or a path is wrong.

/// The one of these names that was probably meant.
#[must_use]
pub fn near<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    // One slip of a finger before all likeness by beginnings.
    let scored = names.into_iter().map(|n| {
        let name = n.to_lowercase();
        (strsim::osa_distance(&word, &name) <= 1, strsim::jaro_winkler(&word, &name), n)
    });
    scored.filter(|s| s.1 >= 0.8).max_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|s| s.2)
}

/// "; did you mean `NAME`?", or nothing.
#[must_use]
pub fn meant<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    near(word, names).map_or_else(String::new, remedy)
}

/// What lies beside a path that is not there and is called nearly so.
#[must_use]
pub fn meant_path(path: &std::path::Path) -> String {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(std::path::Path::new("."));
    let names: Vec<String> =
        std::fs::read_dir(parent).into_iter().flatten().flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    meant(&path.file_name().unwrap_or_default().to_string_lossy(), names.iter().map(String::as_str))
}

/// Which of these names was probably meant, else what lies beside a path that is not there: for an argument that may be either.
#[must_use]
pub fn meant_name_or_path<'a>(word: &str, names: impl IntoIterator<Item = &'a str>, path: &std::path::Path) -> String {
    near(word, names).map_or_else(|| meant_path(path), remedy)
}

fn remedy(name: &str) -> String {
    format!("; did you mean `{name}`?")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_answered_with_what_was_meant() {
        let names = ["climb_drag", "stall", "reynolds_drag"];
        assert_eq!(near("climb_darg", names), Some("climb_drag"));
        assert_eq!(near("Stal", names), Some("stall"));
        assert_eq!(near("zzz", names), None);
        assert_eq!(near("see", crate::flight::mission_file::BUILT_IN), Some("sea"));
    }
}
