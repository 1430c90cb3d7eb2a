//! Mutations of valid frames, and what must hold whatever comes in.

use control::{Config, Settings};
use helm::objects::{check, config_bytes, config_of, mission};
use helm::{Boot, Content, Helm, Mark, RamStorage, Seat};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use signals::link::{CRC32, MAX_WIRE};
use signals::{
    Goal, Leg, Micros, Mission, Object, Older, Reading, Request, SensorFrame, Switch, ToBoard, ToHost, WIRE_VERSION, Wings, encode,
};

macro_rules! corpus {
    ($($name:literal),* $(,)?) => {
        /// Committed seeds: one frame of each message.
        pub const CORPUS: &[(&str, &[u8])] = &[$(($name, include_bytes!(concat!("../../tests/corpus/", $name)))),*];
    };
}
corpus!(
    "hello.bin",
    "begin.bin",
    "launch.bin",
    "sensor.bin",
    "sensor_old.bin",
    "recall.bin",
    "recovered.bin",
    "upload_begin.bin",
    "upload_chunk.bin",
    "upload_commit.bin",
    "rollback.bin",
    "read_back.bin",
    "report.bin",
    "clock.bin",
    "clock_set.bin",
    "upload_image.bin",
    "restart.bin",
    "option_bytes.bin",
    "option_bytes_set.bin",
);

/// Which of them is a sensor frame.
const SENSOR: usize = 3;

/// The corpus, made again.
#[allow(dead_code)] // the test only reads the committed files
pub fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let sensor = SensorFrame {
        seq: 1,
        time: Micros::from_secs(4),
        depth_m: Reading::now(12.5),
        pitch_rad: Reading::now(-0.35),
        ballast_m3: Reading::now(-2e-4),
        battery_mass_m: Reading::now(0.01),
        density_kg_m3: Reading::now(1025.0),
        temperature_degc: Reading::now(12.0),
        battery_v: Reading::now(14.5),
        charge: Reading::now(0.9),
        vacuum_pa: Reading::now(70_000.0),
        leak: Switch::Clear,
        ..SensorFrame::default()
    };
    let old = SensorFrame { depth_m: Reading::Sampled { value: 30.0, age_ms: 90_000 }, pitch_rad: Reading::Missing, ..sensor };
    let mut flown = Mission { wings: Wings::LowAspectRatio, surface_every: 2, ..Mission::default() };
    for goal in
        [Goal::BestRange { hotel_w: 2.0 }, Goal::BestSpeed, Goal::Current { along_track_m_s: 0.1 }, Goal::FixedPitch { pitch_rad: 0.4 }]
    {
        flown.legs.push(Leg { goal, ..Leg::default() }).expect("five of eight legs");
    }
    let mut settings = Content::new();
    config_bytes(&Config::default(), &mut settings);
    let data = heapless::Vec::from_slice(&settings[..settings.len().min(128)]).expect("a chunk");
    let messages = [
        ToBoard::Hello { nonce: 7 },
        ToBoard::Begin(flown.clone()),
        ToBoard::Launch(flown),
        ToBoard::Sensor(sensor),
        ToBoard::Sensor(old),
        ToBoard::Recall,
        ToBoard::Recovered,
        ToBoard::UploadBegin { object: Object::Config, length: data.len() as u32, crc: CRC32.checksum(&data) },
        ToBoard::UploadChunk { offset: 0, data },
        ToBoard::UploadCommit,
        ToBoard::Rollback(Object::Config),
        ToBoard::ReadBack { object: Object::Table(Wings::Standard), offset: 0 },
        ToBoard::Report,
        ToBoard::Clock { set: None },
        ToBoard::Clock { set: Some((1_800_000_000_000, 20)) },
        ToBoard::UploadBegin { object: Object::Image(Older::Refused), length: 1_000, crc: 7 },
        ToBoard::Restart,
        ToBoard::OptionBytes { set: false },
        ToBoard::OptionBytes { set: true },
    ];
    let wire = |message: ToBoard| {
        let mut out = [0; MAX_WIRE];
        let n = encode(&Request { session: 0x1234_5678, id: 7, message }, &mut out).expect("a seed fits");
        out[..n].to_vec()
    };
    CORPUS.iter().map(|(name, _)| *name).zip(messages.into_iter().map(wire)).collect()
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Bytes pushed.
    pub bytes: u64,
    /// Frames built from the corpus.
    pub frames: u64,
    /// Frames the decoder took.
    pub accepted: u64,
    /// Steps of the law.
    pub stepped: u64,
    /// Uploaded objects taken as valid.
    pub objects: u64,
}

/// Every answer's promise: finite and inside the actuators' ranges.
fn hold(said: &ToHost, found: &mut Found, settings: &Settings) {
    if let ToHost::Answer(answer) = said {
        found.stepped += 1;
        let c = &answer.command;
        // One part in a thousand for f32 rounding at the limits.
        assert!(c.ballast_m3.is_finite() && c.ballast_m3.abs() <= settings.pump_m3 * 1.001, "{answer:?}");
        assert!(c.battery_mass_m.is_finite() && c.battery_mass_m.abs() <= settings.battery_m * 1.001, "{answer:?}");
        assert!(c.fin_rad.is_finite() && c.fin_rad.abs() <= settings.fin_rad * 1.001, "{answer:?}");
        let t = &answer.trace;
        let told = [t.pitch_setpoint_rad, t.alpha_rad, t.speed_m_s, t.glide_angle_rad, t.depth_m];
        assert!(told.iter().all(|x| x.is_finite()), "{answer:?}");
    }
}

fn mutate(rng: &mut ChaCha8Rng, body: &mut Vec<u8>) {
    const MAGIC: [u8; 8] = [0x00, 0x01, 0x7f, 0x80, 0xff, 0xfe, 0x10, 0x08];
    const FLOATS: [f32; 8] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 9999.0, 1e38, -1e-40, 0.0, f32::MIN];
    for _ in 0..rng.next_u32() % 4 {
        if body.is_empty() {
            return;
        }
        let at = rng.next_u32() as usize % body.len();
        match rng.next_u32() % 7 {
            0 => body[at] ^= 1 << (rng.next_u32() % 8),
            1 => body[at] = rng.next_u32() as u8,
            2 => body[at] = MAGIC[rng.next_u32() as usize % MAGIC.len()],
            3 => body.truncate(at),
            4 => body.insert(at, rng.next_u32() as u8),
            5 => {
                let float = FLOATS[rng.next_u32() as usize % FLOATS.len()].to_le_bytes();
                for (place, byte) in body[at..].iter_mut().zip(float) {
                    *place = byte;
                }
            }
            _ => {
                let n = (rng.next_u32() as usize % 16).min(body.len() - at);
                let piece = body[at..at + n].to_vec();
                body.splice(at..at, piece);
            }
        }
    }
}

/// Pushes `bytes` mutated bytes through; panics at the first finding.
pub fn run(bytes: u64, seed: u64, mut progress: impl FnMut(u64)) -> Found {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let bodies: Vec<Vec<u8>> = CORPUS
        .iter()
        .map(|(_, wire)| {
            let mut raw = vec![0; wire.len()];
            let n = cobs::decode(&wire[..wire.len() - 1], &mut raw).expect("corpus is COBS").frame_size();
            raw.truncate(n - 4); // without the CRC
            let Request { message, .. } = postcard::from_bytes(&raw[1..]).expect("a request");
            postcard::to_slice(&message, &mut [0; MAX_WIRE]).expect("fits").to_vec()
        })
        .collect();
    let mut found = Found::default();
    let fresh = |n: u64| {
        let mark = if n % 16 == 1 { Mark::mission(Seat::Host, None, false) } else { Mark::NONE };
        Helm::new(Config::default(), Boot { mark, ..Boot::default() }, RamStorage::default())
    };
    let mut helm = fresh(0);
    let (mut sequence, mut session) = (0u32, 0u32);
    let mut wire = vec![0u8; 2048];
    while found.bytes < bytes {
        found.frames += 1;
        if found.frames % 4096 == 0 {
            found.accepted += u64::from(helm.counters().accepted);
            helm = fresh(found.frames / 4096);
            if let ToHost::Hello { session: given, .. } = helm.handle(ToBoard::Hello { nonce: rng.next_u32() }) {
                session = given;
            }
            helm.handle(ToBoard::Begin(Mission::default()));
            sequence = 0;
            if found.frames % (4096 * 256) == 0 {
                progress(found.bytes);
            }
        }
        let pick = rng.next_u32();
        let mut body = if pick % 4 == 0 { bodies[(pick >> 8) as usize % bodies.len()].clone() } else { bodies[SENSOR].clone() };
        if pick % 4 != 0 {
            // Keep the conversation going: the next sensor frame, its number a varint after its kind.
            sequence = sequence.wrapping_add(1) & 0x1fff;
            body.splice(1..2, if sequence < 0x80 { vec![sequence as u8] } else { vec![(sequence as u8) | 0x80, (sequence >> 7) as u8] });
        }
        mutate(&mut rng, &mut body);
        parsers(&body, &mut found);
        // Around it what comes before a message: of the present session nine times in ten.
        let mut front = vec![WIRE_VERSION];
        let of = if rng.next_u32().is_multiple_of(10) { rng.next_u32() } else { session };
        front.extend_from_slice(postcard::to_slice(&(of, 7u16), &mut [0; 16]).expect("two numbers"));
        if rng.next_u32().is_multiple_of(16) {
            mutate(&mut rng, &mut front);
        }
        body.splice(0..0, front);
        // A right CRC nine times in ten, or nothing gets past the door.
        let crc = CRC32.checksum(&body) ^ u32::from(rng.next_u32().is_multiple_of(10));
        body.extend(crc.to_le_bytes());
        if body.len() + body.len() / 254 + 2 > wire.len() {
            continue;
        }
        let n = cobs::encode(&body, &mut wire);
        wire[n] = 0;
        if rng.next_u32().is_multiple_of(20) {
            let at = rng.next_u32() as usize % n;
            wire[at] = rng.next_u32() as u8;
        }
        let settings = *helm::objects::select_config(helm.storage(), &Config::default()).settings();
        let widest = Settings { pump_m3: settings.pump_m3.max(Settings::default().pump_m3), ..settings };
        let widest = Settings { battery_m: widest.battery_m.max(Settings::default().battery_m), fin_rad: 0.8, ..widest };
        for byte in &wire[..=n] {
            if let Some(said) = helm.byte(*byte) {
                hold(&said.message, &mut found, &widest);
                if let ToHost::Hello { session: given, .. } = said.message {
                    session = given;
                }
                let mut out = [0; MAX_WIRE];
                assert!(encode(&said, &mut out).is_ok(), "an answer does not fit: {said:?}");
            }
        }
        found.bytes += n as u64 + 1;
    }
    found
}

/// The parsers of stored objects, on the same bytes.
fn parsers(body: &[u8], found: &mut Found) {
    let Some(body) = body.get(1..) else { return };
    let config = Config::default();
    for object in [Object::Table(Wings::Standard), Object::Table(Wings::LowAspectRatio), Object::Config, Object::Mission, Object::History] {
        found.objects += u64::from(check(object, body, &config).is_ok());
    }
    let _ = (config_of(body), mission(body));
}
