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
use super::report::shown;

/// How such a file begins.
pub const START: &[u8] = b"dbd_label:";

/// Whether the first bytes, a kilobyte or two, are those of such a file: the binary kinds have no lines of labels.
#[must_use]
pub fn is_dba(head: &[u8]) -> bool {
    let head = without_mark(&head[..head.len().min(HEAD)]);
    head.starts_with(START) && head.windows(LABELS.len()).any(|w| w == LABELS)
}

/// The bytes without the mark of UTF-8 that an editor may put in front.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes)
}

const LABELS: &[u8] = b"num_label_lines:";
/// A header is shorter than this, bytes.
pub const HEAD: usize = 2048;

/// The header's lines, and where the rest begins: at the first line without a colon, whatever number of lines it states.
#[must_use]
pub fn header(text: &str) -> (BTreeMap<String, String>, usize) {
    let mut header = BTreeMap::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let Some((key, value)) = line.split_once(':') else { break };
        header.insert(key.trim().to_owned(), value.trim().to_owned());
        at += line.len();
    }
    (header, at)
}

/// Reads a file; `wanted` says which sensors to keep.
///
/// # Errors
/// What is wrong, in one line.
pub fn read(bytes: &[u8], wanted: impl Fn(&str) -> bool) -> Result<DbdFile, String> {
    let text = String::from_utf8_lossy(without_mark(bytes));
    let (header, at) = header(&text);
    let mut lines = text.get(at..).unwrap_or_default().split_inclusive('\n');
    let names = lines.next().ok_or("ends after its header")?;
    let (units, sizes) = (lines.next().ok_or("has no line of units")?, lines.next().ok_or("has no line of sizes")?);
    let names = names.to_ascii_lowercase();
    let (names, units): (Vec<&str>, Vec<&str>) = (names.split_whitespace().collect(), units.split_whitespace().collect());
    if names.len() != units.len() || sizes.split_whitespace().count() != names.len() {
        return Err(format!("has {} names and {} units of columns", names.len(), units.len()));
    }
    let kept: Vec<usize> = (0..names.len()).filter(|k| wanted(names[*k])).collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); kept.len()];
    let mut damaged: Vec<Option<(usize, String)>> = vec![None; kept.len()];
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
        for ((column, damaged), k) in columns.iter_mut().zip(&mut damaged).zip(&kept) {
            let value = fields[*k].parse::<f64>();
            if value.is_err() {
                let first = format!("first in row {}: \"{}\"", row + 1, shown(fields[*k]));
                damaged.get_or_insert((0, first)).0 += 1;
            }
            column.push(value.ok().filter(|v| v.is_finite()).unwrap_or(f64::NAN));
        }
        cycles += 1;
    }
    problems.truncate(MOST_PROBLEMS);
    let damaged = kept.iter().zip(damaged).filter_map(|(k, d)| Some((names[*k], d?)));
    problems.extend(damaged.map(|(name, (n, first))| format!("{n} values of {name} are no numbers ({first}): left out")));
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
    fn regress_the_number_of_header_lines_is_counted_not_believed() {
        let marked = format!("\u{feff}{FILE}");
        assert!(is_dba(marked.as_bytes()) && read(marked.as_bytes(), |_| true).is_ok());
        for tags in ["5", "7", "9", "x"] {
            let file =
                read(FILE.replace("tags: 6", &format!("tags: {tags}")).replace("m_pitch", "M_Pitch").as_bytes(), |_| true).expect("reads");
            assert_eq!((file.cycles, file.columns.len(), file.header["segment_filename_0"].as_str()), (2, 3, "a"), "{tags}");
            assert!(file.columns.contains_key("m_pitch"), "whatever its case");
        }
    }

    #[test]
    fn regress_values_that_are_no_numbers_are_named() {
        let file = read(FILE.replace("3.0 0.5 inf", "3.0 0.5.1 inf").as_bytes(), |_| true).expect("reads");
        assert_eq!(file.problems[1], "1 values of m_pitch are no numbers (first in row 3: \"0.5.1\"): left out");
        assert_eq!(file.problems.len(), 2, "NaN and infinite are none: {:?}", file.problems);
    }

    #[test]
    fn a_cut_file_is_refused_in_one_line() {
        for cut in [10, 60, 100, 160] {
            let e = read(&FILE.as_bytes()[..cut], |_| true).expect_err("refused");
            assert!(!e.contains('\n'), "{e}");
        }
    }
}
