//! What was commanded: pitch, stroke, depths, pump rates, pauses and turns of each of the eight segments.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{SEGMENTS, Site};

/// What was commanded in one segment.
#[derive(Clone, Debug)]
pub struct Orders {
    /// Pause before it, s.
    pub gap_s: f64,
    /// Start, s since the start of the trial: the end of the segment before plus the pause.
    pub start_s: f64,
    /// Pitch of dive and climb, rad, both positive.
    pub pitch: [f64; 2],
    /// Ballast stroke, m³.
    pub ballast: f64,
    /// Number of yos, upper and lower turning depth, m.
    pub yos: usize,
    /// Upper and lower turning depth, m.
    pub depths: [f64; 2],
    /// First heading, rad.
    pub heading: f64,
    /// Pump rate when diving and when climbing, m³/s.
    pub pump: [f64; 2],
    /// Roll used for turning, rad.
    pub bank: f64,
    /// Course changes: depth m, on the dive (true) or climb, change rad.
    pub turns: Vec<(f64, bool, f64)>,
}

impl Orders {
    /// Draws the eight segments: distinct pitches over the range the wing can fly, distinct strokes.
    pub fn draw(site: Site, wing_lowest_pitch_deg: f64, days: f64, rng: &mut ChaCha8Rng) -> Vec<Self> {
        let lowest = wing_lowest_pitch_deg + rng.random_range(0.0..2.0);
        let highest = rng.random_range(36.0..44.0);
        let mut levels: Vec<usize> = (0..SEGMENTS).collect();
        let mut strokes: Vec<usize> = (0..SEGMENTS).collect();
        for i in (1..SEGMENTS).rev() {
            levels.swap(i, rng.random_range(0..=i));
            strokes.swap(i, rng.random_range(0..=i));
        }
        // Sea: enough to climb out through the light surface layer.
        let weakest = if site == Site::Lake { rng.random_range(145.0..185.0) } else { rng.random_range(182.0..205.0) };
        let fastest = rng.random_range(13.0..21.0) * 1e-6;
        let slowest = fastest * if site == Site::Lake { rng.random_range(0.55..0.8) } else { rng.random_range(0.35..0.6) };
        let bank = rng.random_range(0.2..0.32);
        // Gaps: one or two long pauses, the rest short.
        let mut gaps: Vec<f64> = (0..SEGMENTS).map(|_| libm::exp(rng.random_range(-1.2..1.2))).collect();
        if site == Site::Lake {
            let pause = rng.random_range(2..SEGMENTS - 1);
            gaps.iter_mut().enumerate().for_each(|(i, g)| *g = if i == pause { 0.0 } else { rng.random_range(1900.0..3100.0) });
            let rest: f64 = gaps.iter().sum();
            gaps[pause] = (days * 86_400.0 - rest).max(3000.0);
        } else {
            let sum: f64 = gaps.iter().sum();
            gaps.iter_mut().for_each(|g| *g = *g / sum * days * 86_400.0);
        }
        gaps[0] = rng.random_range(60.0..3000.0);
        let mut orders = Vec::with_capacity(SEGMENTS);
        for i in 0..SEGMENTS {
            let share = (levels[i] as f64 + rng.random_range(-0.25..0.25)) / (SEGMENTS - 1) as f64;
            let pitch = (lowest + (highest - lowest) * share.clamp(0.0, 1.0)).to_radians();
            let stroke = weakest + (255.0 - weakest) * (strokes[i] as f64 + rng.random_range(0.0..1.0)) / SEGMENTS as f64;
            let (yos, depths) = match site {
                Site::Lake => (2, [rng.random_range(2.8..3.8), rng.random_range(25.5..27.0)]),
                Site::Sea => (1, [0.0, rng.random_range(199.0..201.5)]),
            };
            let mut turns = Vec::new();
            for dive in [true, false] {
                let count = if site == Site::Lake { 1 } else { rng.random_range(1..4) };
                for _ in 0..count {
                    let depth = rng.random_range(0.12..0.92) * depths[1];
                    let change = rng.random_range(0.6..1.7) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                    turns.push((depth, dive, change));
                }
            }
            orders.push(Self {
                gap_s: gaps[i].max(if i == 0 { 60.0 } else { 400.0 }),
                start_s: 0.0,
                pitch: [pitch, pitch],
                ballast: stroke * 1e-6,
                yos,
                depths,
                heading: rng.random_range(0.0..core::f64::consts::TAU),
                pump: [fastest, slowest],
                bank,
                turns,
            });
        }
        orders
    }

    /// Turns to and fro by a radian and a half at six depths of every dive and climb, banked by so much, rad.
    pub(crate) fn turn_often(&mut self, bank: f64) {
        self.bank = bank;
        let depth = |k: i32| f64::from(k) / 7.0 * self.depths[1];
        let change = |k: i32| if k % 2 == 0 { 1.5 } else { -1.5 };
        self.turns = [true, false]
            .into_iter()
            .flat_map(|dive| (1..=6).map(move |k| (k, dive)))
            .map(|(k, dive)| (depth(k), dive, change(k)))
            .collect();
    }
}
