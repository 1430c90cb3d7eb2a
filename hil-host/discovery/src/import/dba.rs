//! Slocum data as text: what `dbd2asc`, `dba_merge` and `dba_sensor_filter` write.
//!
//! ```text
//! dbd_label: DBD_ASC(dinkum_binary_data_ascii)file      header lines, num_ascii_tags of them
//! …
//! m_present_time m_depth m_pitch                        names, units, bytes: three lines
//! timestamp m rad
//! 8 4 4
//! 1777713330.35 0 0.0872                                rows; NaN for no value
//! ```
//! The first row holds the last values from before the file, whenever they were taken: no samples.

use std::collections::BTreeMap;

use super::dbd::DbdFile;

/// How such a file begins.
pub const START: &[u8] = b"dbd_label:";

/// Whether the first bytes, a kilobyte or two, are those of such a file: the binary kinds have no lines of labels.
#[must_use]
pub fn is_dba(head: &[u8]) -> bool {
    let head = &head[..head.len().min(HEAD)];
    head.starts_with(START) && head.windows(LABELS.len()).any(|w| w == LABELS)
}

const LABELS: &[u8] = b"num_label_lines:";
/// A header is shorter than this, bytes.
pub const HEAD: usize = 2048;

/// The header's lines, and where the rest begins.
///
/// # Errors
/// What is wrong, in one line.
pub fn header(text: &str) -> Result<(BTreeMap<String, String>, usize), String> {
    let mut header = BTreeMap::new();
    let (mut lines, mut at) = (14, 0);
    while header.len() < lines {
        let line = text.get(at..).and_then(|t| t.split_inclusive('\n').next()).ok_or("has a header that is cut")?;
        let (key, value) = line.split_once(':').ok_or_else(|| format!("has a damaged header line \"{}\"", line.trim_end()))?;
        header.insert(key.trim().to_owned(), value.trim().to_owned());
        at += line.len();
        if let Some(n) = header.get("num_ascii_tags") {
            // More lines than any tool writes are damage.
            lines = n.parse::<usize>().ok().filter(|n| (3..100).contains(n)).ok_or_else(|| format!("has num_ascii_tags: {n}"))?;
        }
    }
    Ok((header, at))
}

/// Reads a file; `wanted` says which sensors to keep.
///
/// # Errors
/// What is wrong, in one line.
pub fn read(bytes: &[u8], wanted: impl Fn(&str) -> bool) -> Result<DbdFile, String> {
    let text = String::from_utf8_lossy(bytes);
    let (header, at) = header(&text)?;
    // Segments of merged files name themselves in further lines.
    let more = header.get("num_segments").and_then(|n| n.parse::<usize>().ok()).unwrap_or(1);
    let mut lines = text.get(at..).unwrap_or_default().split_inclusive('\n');
    let mut names = lines.next().ok_or("ends after its header")?;
    for _ in 0..more {
        if !names.starts_with("segment_filename_") {
            break;
        }
        names = lines.next().ok_or("ends after its header")?;
    }
    let (units, sizes) = (lines.next().ok_or("has no line of units")?, lines.next().ok_or("has no line of sizes")?);
    let (names, units): (Vec<&str>, Vec<&str>) = (names.split_whitespace().collect(), units.split_whitespace().collect());
    if names.len() != units.len() || sizes.split_whitespace().count() != names.len() {
        return Err(format!("has {} names and {} units of columns", names.len(), units.len()));
    }
    let kept: Vec<usize> = (0..names.len()).filter(|k| wanted(names[*k])).collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); kept.len()];
    let (mut cycles, mut problems) = (0, Vec::new());
    for (row, line) in lines.enumerate().filter(|(_, l)| !l.trim().is_empty()) {
        let fields: Vec<&str> = line.split_whitespace().collect();
        if fields.len() != names.len() {
            problems.push(format!("row {} has {} values for {} columns: left out", row + 1, fields.len(), names.len()));
            continue;
        }
        if row == 0 {
            continue;
        }
        for (column, k) in columns.iter_mut().zip(&kept) {
            column.push(fields[*k].parse::<f64>().ok().filter(|v| v.is_finite()).unwrap_or(f64::NAN));
        }
        cycles += 1;
    }
    problems.truncate(MOST_PROBLEMS);
    let columns = kept.iter().zip(columns).map(|(k, c)| (names[*k].to_owned(), (units[*k].to_owned(), c))).collect();
    Ok(DbdFile { header, columns, cycles, problems })
}

/// More problems of one file say nothing more.
const MOST_PROBLEMS: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "dbd_label: DBD_ASC(dinkum_binary_data_ascii)file\nencoding_ver: 2\nnum_ascii_tags: 6\nnum_label_lines: 3\nfilename_extension: sbd\n\
        segment_filename_0: a\nm_present_time m_pitch x \ntimestamp rad nodim \n8 4 4 \n1.0 9 9 \n2.0 NaN 1 \n3.0 0.5 inf \n4.0 1\n";

    #[test]
    fn rows_are_read_and_the_first_is_none() {
        assert!(is_dba(FILE.as_bytes()) && !is_dba(b"dbd_label:    DBD(dinkum_binary_data)file\n"));
        let file = read(FILE.as_bytes(), |n| n != "x").expect("reads");
        assert_eq!(file.cycles, 2);
        assert_eq!(file.columns["m_present_time"], ("timestamp".into(), vec![2.0, 3.0]));
        assert!(file.columns["m_pitch"].1[0].is_nan() && file.columns["m_pitch"].1[1] == 0.5);
        assert_eq!(file.problems.len(), 1, "{:?}", file.problems);
    }

    #[test]
    fn a_cut_file_is_refused_in_one_line() {
        for cut in [10, 60, 100, 160] {
            let e = read(&FILE.as_bytes()[..cut], |_| true).expect_err("refused");
            assert!(!e.contains('\n'), "{e}");
        }
    }
}
