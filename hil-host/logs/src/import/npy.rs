//! Reads a two-dimensional numpy array of 64-bit floats.
//!
//! Format: NEP 1 (numpy enhancement proposal 1, "A simple file format for NumPy
//! arrays"): magic `\x93NUMPY`, version, header length, a Python dictionary with
//! `descr`, `fortran_order`, `shape`, then the numbers. Only what a table needs:
//! `<f8`, rows first. A general reader (crate `npyz`) brings a parser generator
//! and big integers for that one line of header.

/// Rows of the array.
///
/// # Errors
/// What the array is instead, as the end of a sentence about it.
pub fn rows(bytes: &[u8]) -> Result<Vec<Vec<f64>>, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("is not a numpy file")?;
    let (header, data) = match rest {
        [1, _, a, b, rest @ ..] => rest.split_at_checked(usize::from(u16::from_le_bytes([*a, *b]))),
        [2 | 3, _, a, b, c, d, rest @ ..] => rest.split_at_checked(u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => None,
    }
    .ok_or("is not a numpy file")?;
    let header = String::from_utf8_lossy(header).trim().to_owned();
    let shown = header.chars().take(200).collect::<String>().escape_debug().to_string();
    let other = || format!("is not a rows-first table of 64-bit floats but {shown}");
    let plain: String = header.chars().filter(|c| !c.is_whitespace()).collect();
    if !(plain.contains("'descr':'<f8'") && plain.contains("'fortran_order':False")) {
        return Err(other());
    }
    let (_, shape) = plain.split_once("'shape':(").ok_or_else(other)?;
    let (shape, _) = shape.split_once(')').ok_or_else(other)?;
    let shape: Vec<usize> = shape.split(',').filter(|s| !s.is_empty()).map(str::parse).collect::<Result<_, _>>().map_err(|_| other())?;
    let &[count, length] = shape.as_slice() else { return Err(other()) };
    let numbers: Vec<f64> = data.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let promised = count.checked_mul(length).filter(|n| *n > 0).ok_or_else(other)?;
    if numbers.len() < promised {
        return Err(format!("is cut: {} of {promised} numbers are there", numbers.len()));
    }
    Ok(numbers[..promised].chunks(length).map(<[f64]>::to_vec).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(header: &str, numbers: &[f64]) -> Vec<u8> {
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.bytes());
        out.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
        out
    }

    const HEADER: &str = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }   \n";

    #[test]
    fn a_table_is_read_row_by_row_with_its_nan() {
        let read = rows(&array(HEADER, &[1.0, 2.0, 3.0, 4.0, f64::NAN, 6.0])).expect("a table");
        assert_eq!(read[0], [1.0, 2.0, 3.0]);
        assert!(read[1][1].is_nan() && read[1][2] == 6.0);
    }

    #[test]
    fn other_files_are_refused() {
        let refused = |bytes: &[u8], why: &str| assert!(rows(bytes).is_err_and(|e| e.contains(why)), "{why}");
        refused(b"PK\x03\x04", "not a numpy file");
        refused(b"\x93NUMPY\x01\x00\xff\xff{", "not a numpy file");
        refused(&array(HEADER, &[1.0, 2.0]), "2 of 6 numbers");
        refused(&array(&HEADER.replace("False", "True"), &[0.0; 6]), "rows-first table");
        // What it is called stays in one line.
        let e = rows(&array(&HEADER.replace("(2,", "(\n2,").replace("<f8", "<f4"), &[0.0; 6])).expect_err("another kind");
        assert!(!e.contains('\n') && e.contains("<f4"), "{e}");
        let vast = HEADER.replace("(2, 3)", "(4294967296, 4294967296)");
        refused(&array(&vast, &[0.0; 6]), "rows-first table");
    }
}
