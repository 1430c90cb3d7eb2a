//! What a vehicle differs by from dive to dive when nothing happened to it.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::nature::Nature;
use super::stream;

/// Scatter of drag and lift (relative), trim (cm³), pitch zero (rad) and compressibility (relative) from dive to dive, 1 sigma of the
/// vehicle that scatters most; the least scatters by a third of it. Real months of a Slocum and a SeaExplorer have the like.
const BETWEEN_DIVES: [f64; 5] = [0.02, 0.02, 6.0, 0.002, 0.03];

/// How the numbers of one vehicle scatter from dive to dive, correlated at random.
pub(super) struct Scatter([[f64; 5]; 5]);

impl Scatter {
    /// Of case `i` of a seed.
    pub(super) fn of(seed: u64, i: u64) -> (Self, ChaCha8Rng) {
        let mut rng = stream(seed, i, 6);
        (Self::draw(&mut rng), rng)
    }

    fn draw(rng: &mut impl rand::Rng) -> Self {
        Self(BETWEEN_DIVES.map(|largest| {
            let row: [f64; 5] = std::array::from_fn(|_| rng.sample(StandardNormal));
            let sigma = largest * rng.random_range(1.0 / 3.0..1.0);
            let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
            row.map(|x| x * sigma / length)
        }))
    }

    /// The vehicle on a further dive.
    pub(super) fn apply(&self, nature: &mut Nature, rng: &mut impl rand::Rng) {
        let z: [f64; 5] = std::array::from_fn(|_| rng.sample::<f64, _>(StandardNormal).clamp(-2.5, 2.5));
        let [drag, lift, trim_cc, pitch, compressibility] = self.0.map(|row| row.iter().zip(&z).map(|(a, b)| a * b).sum::<f64>());
        nature.cd0 *= 1.0 + drag;
        nature.lift_slope *= 1.0 + lift;
        nature.volume += trim_cc * 1e-6;
        nature.pitch_zero += pitch;
        nature.compressibility *= 1.0 + compressibility;
    }
}
