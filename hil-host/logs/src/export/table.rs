//! A table by columns as Parquet, and back: whole numbers, texts, and numbers, null where they are not finite.
//!
//! Equal tables give equal bytes: uncompressed, one row group, no date in the file.

use std::fs::File;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;

/// Columns of one kind, with their names.
pub type Columns<T> = Vec<(String, Vec<T>)>;

/// A table; its columns stand in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What is said of the whole table, by key.
    pub about: Vec<(String, String)>,
    /// Whole numbers.
    pub whole: Columns<i32>,
    /// Texts.
    pub texts: Columns<String>,
    /// Numbers; NaN where there is none.
    pub numbers: Columns<f64>,
}

impl Table {
    /// Writes it.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, name: &str, out: impl Write + Send) -> Result<()> {
        let mut fields = Vec::new();
        for (name, _) in &self.whole {
            fields.push(field(name, Physical::INT32, Repetition::REQUIRED, None)?);
        }
        for (name, _) in &self.texts {
            fields.push(field(name, Physical::BYTE_ARRAY, Repetition::REQUIRED, Some(LogicalType::String))?);
        }
        for (name, _) in &self.numbers {
            fields.push(field(name, Physical::DOUBLE, Repetition::OPTIONAL, None)?);
        }
        let about = self.about.iter().map(|(k, v)| KeyValue::new(k.clone(), v.clone())).collect();
        let mut writer = writer(out, name, fields, about)?;
        let mut rows = writer.next_row_group()?;
        for (_, values) in &self.whole {
            column::<Int32Type, _>(&mut rows, values, None)?;
        }
        for (_, values) in &self.texts {
            let values: Vec<ByteArray> = values.iter().map(|v| ByteArray::from(v.as_str())).collect();
            column::<ByteArrayType, _>(&mut rows, &values, None)?;
        }
        for (_, values) in &self.numbers {
            nullable(&mut rows, values.iter().copied())?;
        }
        rows.close()?;
        writer.close()?;
        Ok(())
    }

    /// Reads one that was written so.
    ///
    /// # Errors
    /// Not Parquet, cut, or with a column of another kind.
    pub fn read(file: File) -> Result<Self> {
        Self::from_chunks(file)
    }

    fn from_chunks<R: ChunkReader + 'static>(file: R) -> Result<Self> {
        let mut room = file.len().saturating_mul(UNPACKED).saturating_add(SMALLEST_TABLE);
        let reader = SerializedFileReader::new(file)?;
        let metadata = reader.metadata().file_metadata();
        let about = metadata.key_value_metadata().into_iter().flatten();
        let mut out = Self { about: about.map(|k| (k.key.clone(), k.value.clone().unwrap_or_default())).collect(), ..Self::default() };
        let names: Vec<String> = metadata.schema_descr().columns().iter().map(|c| c.name().to_owned()).collect();
        for group in 0..reader.num_row_groups() {
            let rows = reader.get_row_group(group)?;
            let n = usize::try_from(rows.metadata().num_rows()).unwrap_or(usize::MAX);
            take(&mut room, (n as u64).saturating_mul(CELL * names.len() as u64))?;
            for (k, name) in names.iter().enumerate() {
                match rows.get_column_reader(k)? {
                    ColumnReader::Int32ColumnReader(mut column) => {
                        column.read_records(n, None, None, of(&mut out.whole, name))?;
                    }
                    ColumnReader::ByteArrayColumnReader(mut column) => {
                        let mut values = Vec::with_capacity(n);
                        column.read_records(n, None, None, &mut values)?;
                        for value in &values {
                            // A text of a dictionary may stand in every row.
                            take(&mut room, 2 * value.len() as u64)?;
                            of(&mut out.texts, name).push(value.as_utf8()?.to_owned());
                        }
                    }
                    ColumnReader::DoubleColumnReader(mut column) => {
                        let (mut there, mut values) = (Vec::with_capacity(n), Vec::with_capacity(n));
                        column.read_records(n, Some(&mut there), None, &mut values)?;
                        let mut values = values.into_iter();
                        let row = there.iter().map(|t| if *t > 0 { values.next().unwrap_or(f64::NAN) } else { f64::NAN });
                        of(&mut out.numbers, name).extend(row);
                    }
                    _ => return Err(ParquetError::General(format!("column {name} is neither a number nor a text"))),
                }
            }
        }
        Ok(out)
    }

    /// A column of texts; empty if there is none of this name.
    #[must_use]
    pub fn text(&self, name: &str) -> &[String] {
        self.texts.iter().find(|c| c.0 == name).map_or(&[], |c| &c.1)
    }

    /// A column of numbers; empty if there is none of this name.
    #[must_use]
    pub fn number(&self, name: &str) -> &[f64] {
        self.numbers.iter().find(|c| c.0 == name).map_or(&[], |c| &c.1)
    }
}

/// Values of a file take at most so many times its bytes, and this much more: what it declares is no size.
const UNPACKED: u64 = 20;
const SMALLEST_TABLE: u64 = 8 << 20;
/// What a value takes in memory with its copies, bytes; a text takes twice its length more.
const CELL: u64 = 64;

/// Takes so much of the room that is left.
fn take(room: &mut u64, bytes: u64) -> Result<()> {
    let too_much = || ParquetError::General("declares more values than a file of its size holds".into());
    *room = room.checked_sub(bytes).ok_or_else(too_much)?;
    Ok(())
}

/// A column of a schema.
pub(super) fn field(name: &str, kind: Physical, repetition: Repetition, logical: Option<LogicalType>) -> Result<Arc<Type>> {
    Type::primitive_type_builder(name, kind).with_repetition(repetition).with_logical_type(logical).build().map(Arc::new)
}

/// A writer of files with these columns.
pub(super) fn writer<W: Write + Send>(out: W, name: &str, fields: Vec<Arc<Type>>, about: Vec<KeyValue>) -> Result<SerializedFileWriter<W>> {
    let schema = Arc::new(Type::group_type_builder(name).with_fields(fields).build()?);
    let properties = WriterProperties::builder()
        .set_created_by(concat!("glider ", env!("CARGO_PKG_VERSION")).into())
        .set_key_value_metadata((!about.is_empty()).then_some(about))
        .build();
    SerializedFileWriter::new(out, schema, Arc::new(properties))
}

/// Writes the next column; `there` says of which rows, none: of all.
pub(super) fn column<D: DataType, W: Write + Send>(
    rows: &mut SerializedRowGroupWriter<'_, W>,
    values: &[D::T],
    there: Option<&[i16]>,
) -> Result<()> {
    let missing = || ParquetError::General("the schema has fewer columns than the table".into());
    let mut column = rows.next_column()?.ok_or_else(missing)?;
    column.typed::<D>().write_batch(values, there, None)?;
    column.close()
}

/// Writes the next column of numbers, null where they are not finite.
pub(super) fn nullable<W: Write + Send>(rows: &mut SerializedRowGroupWriter<'_, W>, all: impl Iterator<Item = f64>) -> Result<()> {
    let (mut values, mut there) = (Vec::new(), Vec::new());
    for v in all {
        there.push(i16::from(v.is_finite()));
        if v.is_finite() {
            values.push(v);
        }
    }
    column::<DoubleType, _>(rows, &values, Some(&there))
}

/// The column of this name, made if it is not there.
fn of<'a, T>(columns: &'a mut Columns<T>, name: &str) -> &'a mut Vec<T> {
    let k = columns.iter().position(|c| c.0 == name).unwrap_or_else(|| {
        columns.push((name.to_owned(), Vec::new()));
        columns.len() - 1
    });
    &mut columns[k].1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_comes_back_as_it_was_and_a_cut_one_is_refused() {
        let table = Table {
            about: vec![("shard".into(), "1/3".into())],
            whole: vec![("dive".into(), vec![1, 2])],
            texts: vec![("flight".into(), vec!["a".into(), String::new()])],
            numbers: vec![("drag".into(), vec![0.1 + 0.2, f64::NAN]), ("lift".into(), vec![f64::NAN, f64::NAN])],
        };
        let mut bytes = Vec::new();
        table.write("dives", &mut bytes).expect("written");
        let back = Table::from_chunks(bytes::Bytes::from(bytes.clone())).expect("read");
        // NaN is not equal to itself: by what is printed.
        assert_eq!(format!("{back:?}"), format!("{table:?}"));
        assert_eq!((back.number("drag")[0], back.text("flight").len(), back.number("mass").len()), (0.1 + 0.2, 2, 0));
        let mut again = Vec::new();
        back.write("dives", &mut again).expect("written");
        assert_eq!(again, bytes, "equal tables, equal bytes");
        bytes.truncate(bytes.len() - 20);
        assert!(Table::from_chunks(bytes::Bytes::from(bytes)).is_err());
    }

    /// A count of rows that no memory holds ended the program; one text in every row took its length for each.
    #[test]
    fn regress_declared_rows_take_no_more_than_the_file_allows() {
        let rows = 12_345;
        let table = Table { whole: vec![("dive".into(), vec![7; rows])], ..Table::default() };
        let mut bytes = Vec::new();
        table.write("dives", &mut bytes).expect("written");
        assert_eq!(Table::from_chunks(bytes::Bytes::from(bytes.clone())).expect("read").whole[0].1.len(), rows);
        // The count as Thrift writes it (zigzag, 7 bits a byte) becomes 2^60; the footer, its length below it, grows.
        let footer = u32::from_le_bytes(bytes[bytes.len() - 8..bytes.len() - 4].try_into().expect("4 bytes")) as usize;
        let mut end = bytes.split_off(bytes.len() - 8 - footer);
        end.truncate(footer);
        let large = [0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x20];
        while let Some(at) = end.windows(3).position(|w| w == [0xf2, 0xc0, 0x01]) {
            end.splice(at..at + 3, large);
        }
        bytes.extend(&end);
        bytes.extend((end.len() as u32).to_le_bytes());
        bytes.extend(b"PAR1");
        let said = Table::from_chunks(bytes::Bytes::from(bytes)).expect_err("refused").to_string();
        assert!(said.contains("more values than a file of its size holds"), "{said}");

        let table = Table { texts: vec![("flight".into(), vec!["x".repeat(4000); 4000])], ..Table::default() };
        let mut bytes = Vec::new();
        table.write("dives", &mut bytes).expect("written");
        assert!(bytes.len() < 20_000);
        let said = Table::from_chunks(bytes::Bytes::from(bytes)).expect_err("refused").to_string();
        assert!(said.contains("more values than a file of its size holds"), "{said}");
    }
}
