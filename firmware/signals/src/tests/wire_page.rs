//! docs/wire.md says what the code does: its examples byte for byte, its numbers of messages.

use crate::autopsy::{NOTE, RUN};
use crate::link::MAX_WIRE;
use crate::{Object, Reading, Refusal, Reply, Request, SensorFrame, ToBoard, ToHost, WIRE_VERSION, encode};

const PAGE: &str = include_str!("../../../../docs/wire.md");

/// The bytes of an example on the page.
fn example(name: &str) -> String {
    let (_, rest) = PAGE.split_once(&format!("```hex {name}\n")).unwrap_or_else(|| panic!("no example {name} on the page"));
    rest.split_once("```").expect("an end").0.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ")
}

fn wire(message: &impl serde::Serialize) -> String {
    let mut out = [0; MAX_WIRE];
    let n = encode(message, &mut out).expect("fits");
    hex(&out[..n])
}

#[test]
fn the_examples_are_the_bytes_on_the_line() {
    let frame =
        SensorFrame { depth_m: Reading::Sampled { value: 12.5, age_ms: 40 }, pitch_rad: Reading::now(-0.25), ..SensorFrame::default() };
    assert_eq!(example("hello"), wire(&Request { session: 0, id: 1, message: ToBoard::Hello { nonce: 7 } }));
    assert_eq!(example("sensor"), wire(&Request { session: 0x1234_5678, id: 2, message: ToBoard::Sensor(frame) }));
    assert_eq!(example("refused"), wire(&Reply { to: 2, message: ToHost::Refused(Refusal::Session) }));
    let autopsy = ToBoard::ReadBack { object: Object::Autopsy, offset: 0 };
    assert_eq!(example("autopsy"), wire(&Request { session: 0, id: 3, message: autopsy }));
    let clock = ToBoard::Clock { set: Some((1_795_776_005_000, 20)) };
    assert_eq!(example("clock"), wire(&Request { session: 0x1234_5678, id: 4, message: clock }));
    let image = Object::Image(crate::Older::Refused);
    let begin = ToBoard::UploadBegin { object: image, length: 131_072, crc: 0x1234_5678 };
    assert_eq!(example("image"), wire(&Request { session: 0x1234_5678, id: 5, message: begin }));
    let (clean, whole) = (4 * NOTE, 4 * (NOTE + RUN));
    assert!(PAGE.contains(&format!("{clean}: no fault; {},{:03}: a fault", whole / 1000, whole % 1000)));
    let reply = postcard::to_slice(&ToHost::Hello { nonce: 7, session: 9, manifest: Default::default() }, &mut [0; 99]).expect("fits")[..2]
        .to_vec();
    assert!(PAGE.contains(&format!("`{}`", hex(&[WIRE_VERSION, 1, reply[0], reply[1]]))));
}

#[test]
fn the_table_numbers_messages_as_the_code_does() {
    let number = |message: &ToBoard| postcard::to_slice(message, &mut [0; 256]).expect("fits")[0];
    let object = Object::Config;
    for (name, object) in [
        ("0 Table", Object::Table(crate::Wings::Standard)),
        ("1 Config", Object::Config),
        ("2 Mission", Object::Mission),
        ("3 Log", Object::Log),
        ("4 Autopsy", Object::Autopsy),
        ("5 Image", Object::Image(crate::Older::Refused)),
        ("6 History", Object::History),
    ] {
        let number = postcard::to_slice(&object, &mut [0; 8]).expect("fits")[0];
        assert!(PAGE.contains(name) && name.starts_with(&number.to_string()), "{name}: {number}");
    }
    for (name, message) in [
        ("Hello", ToBoard::Hello { nonce: 0 }),
        ("Begin", ToBoard::Begin(Default::default())),
        ("Launch", ToBoard::Launch(Default::default())),
        ("Sensor", ToBoard::Sensor(Default::default())),
        ("Recall", ToBoard::Recall),
        ("UploadBegin", ToBoard::UploadBegin { object, length: 0, crc: 0 }),
        ("UploadChunk", ToBoard::UploadChunk { offset: 0, data: Default::default() }),
        ("UploadCommit", ToBoard::UploadCommit),
        ("Rollback", ToBoard::Rollback(object)),
        ("ReadBack", ToBoard::ReadBack { object, offset: 0 }),
        ("Report", ToBoard::Report),
        ("Recovered", ToBoard::Recovered),
        ("Check", ToBoard::Check { stroke: false }),
        ("Clock", ToBoard::Clock { set: None }),
        ("Restart", ToBoard::Restart),
        ("OptionBytes", ToBoard::OptionBytes { set: false }),
    ] {
        assert!(PAGE.contains(&format!("| {} | {name}", number(&message))), "{name} is {}", number(&message));
    }
    let number = |message: &ToHost| postcard::to_slice(message, &mut [0; 256]).expect("fits")[0];
    for (said, message) in [
        ("0 Hello {", ToHost::Hello { nonce: 0, session: 0, manifest: Default::default() }),
        ("1 Ready {", ToHost::Ready { table_id: 0, config: 0, mission: 0, image: None }),
        ("2 Answer {", ToHost::Answer(Default::default())),
        ("3 Done {", ToHost::Done { crc: 0 }),
        ("4 Continue {", ToHost::Continue { offset: 0 }),
        ("5 Content {", ToHost::Content { offset: 0, length: 0, data: Default::default() }),
        ("6 is Refused", ToHost::Refused(Refusal::Safe)),
        ("7 Counters", ToHost::Counters(Default::default())),
        ("8 Volatile {", ToHost::Volatile { crc: 0 }),
        ("9 Checked", ToHost::Checked(Default::default())),
        ("10 Clock {", ToHost::Clock(Default::default())),
        ("11 OptionBytes(", ToHost::OptionBytes(None)),
    ] {
        assert!(PAGE.contains(said) && said.starts_with(&number(&message).to_string()), "{said}: {}", number(&message));
    }
    assert!(PAGE.contains(&format!("| version | 1 | {WIRE_VERSION};")));
}
