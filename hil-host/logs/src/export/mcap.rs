//! Writes a flight as MCAP, protobuf messages with their descriptors: for Foxglove, Lichtblick, PlotJuggler, rerun.
//!
//! One topic for what was measured, one for each further series on the same clock (model, residual, truth, command), so that a
//! viewer lays them over one another; fixes as `foxglove.LocationFix`. Units stand in the names. Uncompressed.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use crate::import::Origin;
use crate::import::position;
use crate::record::flight::Flight;

/// Series on the clock of the flight.
#[derive(Clone, Debug, Default)]
pub struct Stream {
    /// Topic, e.g. `/glider/model`.
    pub topic: String,
    /// Name with its unit, and a value for every row of the flight, NaN for none.
    pub fields: Vec<(String, Vec<f64>)>,
}

/// The streams that a flight carries by itself: measured columns, and truth and commands of a simulated one.
#[must_use]
pub fn streams(flight: &Flight) -> Vec<Stream> {
    let mut out: BTreeMap<&str, Stream> = BTreeMap::new();
    for c in super::columns(flight) {
        let topic = match c.name {
            name if name.starts_with("truth_") => "/glider/truth",
            name if name.starts_with("c_") || name.starts_with("command") => "/glider/command",
            _ => "/glider/measured",
        };
        let values: Vec<f64> = c.converted().collect();
        if values.iter().any(|v| v.is_finite()) {
            let stream = out.entry(topic).or_insert_with(|| Stream { topic: topic.into(), fields: Vec::new() });
            stream.fields.push((c.name.to_owned(), values));
        }
    }
    out.into_values().collect()
}

/// Writes the streams, the fixes if `origins` say where they are, and `attachments` (name, media type, bytes).
///
/// # Errors
/// What the writer says.
pub fn write(
    flight: &Flight,
    streams: &[Stream],
    start_unix_s: Option<f64>,
    origins: &[Origin],
    attachments: &[(&str, &str, Vec<u8>)],
    out: impl Write + Seek,
) -> Result<(), mcap::McapError> {
    let options = mcap::WriteOptions::new().compression(None).library(concat!("glider ", env!("CARGO_PKG_VERSION")));
    let mut writer = options.create(out)?;
    let ns = |t: f64| ((t + start_unix_s.unwrap_or(0.0)).max(0.0) * 1e9).round() as u64;
    let mut channels = Vec::new();
    for stream in streams {
        let short: String = stream.topic.rsplit('/').next().unwrap_or("data").chars().filter(char::is_ascii_alphanumeric).collect();
        let message = format!("{}{}", short[..1].to_uppercase(), &short[1..]);
        let names: Vec<String> = stream.fields.iter().map(|f| safe(&f.0)).collect();
        let fields: Vec<Field<'_>> = names.iter().map(|n| Field { name: n, kind: Kind::Double }).collect();
        let schema = writer.add_schema(&format!("glider.{message}"), "protobuf", &descriptor_set(&[("glider", &message, &fields)]))?;
        channels.push(writer.add_channel(schema, &stream.topic, "protobuf", &BTreeMap::new())?);
    }
    let schema = writer.add_schema("foxglove.LocationFix", "protobuf", &location_fix())?;
    let fixes = writer.add_channel(schema, "/glider/fix", "protobuf", &BTreeMap::new())?;
    let mut sequence = 0;
    for row in 0..flight.len() {
        let log_time = ns(flight.time_s[row]);
        for (stream, channel_id) in streams.iter().zip(&channels) {
            let mut data = Vec::new();
            for (k, (_, values)) in stream.fields.iter().enumerate() {
                if values[row].is_finite() {
                    double(&mut data, k as u64 + 1, values[row]);
                }
            }
            if data.is_empty() {
                continue;
            }
            sequence += 1;
            let header = mcap::records::MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &data)?;
        }
        if let Some(fix) = position::on_the_globe(flight, origins, row) {
            let mut data = Vec::new();
            double(&mut data, 1, fix.lat_deg);
            double(&mut data, 2, fix.lon_deg);
            double(&mut data, 3, 0.0);
            let mut stamp = Vec::new();
            whole(&mut stamp, 1, log_time / 1_000_000_000);
            whole(&mut stamp, 2, log_time % 1_000_000_000);
            bytes(&mut data, 6, &stamp);
            bytes(&mut data, 7, b"earth");
            sequence += 1;
            let header = mcap::records::MessageHeader { channel_id: fixes, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, &data)?;
        }
    }
    for (name, media_type, data) in attachments {
        let attachment = mcap::Attachment {
            log_time: ns(0.0),
            create_time: ns(0.0),
            name: (*name).into(),
            media_type: (*media_type).into(),
            data: data.as_slice().into(),
        };
        writer.attach(&attachment)?;
    }
    let date = if start_unix_s.is_some() { "Unix time" } else { "seconds of the flight: its date is not known" };
    let metadata = [("flight".to_owned(), flight.name.clone()), ("clock".to_owned(), date.to_owned())].into();
    writer.write_metadata(&mcap::records::Metadata { name: "glider".into(), metadata })?;
    writer.finish()?;
    Ok(())
}

/// A field name of protobuf.
fn safe(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_digit()) { format!("x{name}") } else { name }
}

/// What a field holds.
#[derive(Clone, Copy)]
enum Kind<'a> {
    Double,
    Text,
    Whole,
    Message(&'a str),
}

struct Field<'a> {
    name: &'a str,
    kind: Kind<'a>,
}

/// Protobuf's wire format: a number of seven bits a byte, the least first.
fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push((value as u8) | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn whole(out: &mut Vec<u8>, number: u64, value: u64) {
    varint(out, number << 3);
    varint(out, value);
}

fn double(out: &mut Vec<u8>, number: u64, value: f64) {
    varint(out, number << 3 | 1);
    out.extend(value.to_le_bytes());
}

fn bytes(out: &mut Vec<u8>, number: u64, value: &[u8]) {
    varint(out, number << 3 | 2);
    varint(out, value.len() as u64);
    out.extend(value);
}

/// A `FileDescriptorProto`; fields are numbered from 1 unless `numbers` says otherwise.
fn descriptor(file: &str, package: &str, needs: &[&str], message: &str, fields: &[Field<'_>], numbers: &[u64]) -> Vec<u8> {
    let mut message_type = Vec::new();
    bytes(&mut message_type, 1, message.as_bytes());
    for (k, field) in fields.iter().enumerate() {
        let mut f = Vec::new();
        bytes(&mut f, 1, field.name.as_bytes());
        whole(&mut f, 3, numbers.get(k).copied().unwrap_or(k as u64 + 1));
        // LABEL_OPTIONAL; TYPE_DOUBLE 1, TYPE_INT64 3, TYPE_STRING 9, TYPE_MESSAGE 11.
        whole(&mut f, 4, 1);
        whole(
            &mut f,
            5,
            match field.kind {
                Kind::Double => 1,
                Kind::Whole => 3,
                Kind::Text => 9,
                Kind::Message(_) => 11,
            },
        );
        if let Kind::Message(name) = field.kind {
            bytes(&mut f, 6, name.as_bytes());
        }
        bytes(&mut message_type, 2, &f);
    }
    let mut out = Vec::new();
    bytes(&mut out, 1, file.as_bytes());
    bytes(&mut out, 2, package.as_bytes());
    for need in needs {
        bytes(&mut out, 3, need.as_bytes());
    }
    bytes(&mut out, 4, &message_type);
    bytes(&mut out, 12, b"proto3");
    out
}

fn descriptor_set(messages: &[(&str, &str, &[Field<'_>])]) -> Vec<u8> {
    let mut out = Vec::new();
    for (package, message, fields) in messages {
        bytes(&mut out, 1, &descriptor(&format!("{package}/{message}.proto"), package, &[], message, fields, &[]));
    }
    out
}

/// `foxglove.LocationFix` with the fields that a fix has, and the time stamp it needs.
fn location_fix() -> Vec<u8> {
    const STAMP: &str = "google/protobuf/timestamp.proto";
    let field = |name, kind| Field { name, kind };
    let stamp = descriptor(STAMP, "google.protobuf", &[], "Timestamp", &[field("seconds", Kind::Whole), field("nanos", Kind::Whole)], &[]);
    let fields = [
        field("latitude", Kind::Double),
        field("longitude", Kind::Double),
        field("altitude", Kind::Double),
        field("timestamp", Kind::Message(".google.protobuf.Timestamp")),
        field("frame_id", Kind::Text),
    ];
    let fix = descriptor("foxglove/LocationFix.proto", "foxglove", &[STAMP], "LocationFix", &fields, &[1, 2, 3, 6, 7]);
    let mut out = Vec::new();
    bytes(&mut out, 1, &stamp);
    bytes(&mut out, 1, &fix);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_by_the_formats_own_library() {
        let mut flight = Flight::blank(3);
        flight.time_s = vec![0.0, 4.0, 8.5];
        flight.pressure_pa = vec![1e4, 2e4, f64::NAN];
        flight.gps_east_m[1] = 100.0;
        flight.gps_north_m[1] = 0.0;
        flight.extra.insert("truth_w_m_s".into(), vec![0.1, f64::NAN, 0.3]);
        let origins = [Origin { segment: 0, unix_s: 1.7e9, lat_deg: 54.0, lon_deg: 7.0 }];
        let mut file = std::io::Cursor::new(Vec::new());
        let vehicle = vec![("vehicle.json", "application/json", b"{}".to_vec())];
        write(&flight, &streams(&flight), Some(1.7e9), &origins, &vehicle, &mut file).expect("written");
        let file = file.into_inner();
        let messages: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&file).expect("a file").map(|m| m.expect("a message")).collect();
        let of = |topic: &str| messages.iter().filter(|m| m.channel.topic == topic).collect::<Vec<_>>();
        let measured = of("/glider/measured");
        assert_eq!((measured.len(), of("/glider/truth").len(), of("/glider/fix").len()), (2, 2, 1));
        assert_eq!(measured[1].log_time, 1_700_000_004_000_000_000);
        // Field 1, eight bytes: 2 dbar.
        assert_eq!(measured[1].data[0], 0x09);
        assert_eq!(f64::from_le_bytes(measured[1].data[1..9].try_into().expect("eight")), 2.0);
        let schema = measured[0].channel.schema.as_ref().expect("a schema");
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("glider.Measured", "protobuf"));
        assert!(mcap::Summary::read(&file).expect("a summary").expect("a summary").stats.is_some());
    }
}
