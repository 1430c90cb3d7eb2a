//! Noise, resolution, bias, lag, period and dropout of the sensors are those asked for.

use super::{command, uniform};
use crate::sensors::Channel;
use crate::{Vehicle, World};
use signals::{Reading, Wings};

/// Depth readings minus the truth, every second for 2000 s, with the ages, of a gliding vehicle.
fn depth_errors(channel: Channel) -> Vec<(Option<f64>, u32, f64)> {
    let mut s = uniform(Wings::Standard, Vehicle::default());
    s.sensors.depth = channel;
    let mut world = World::new(s).unwrap();
    (0..2000)
        .map(|_| {
            world.advance(&command(-100e-6, -0.002, 0.0), 1.0);
            let t = world.truth();
            match world.sense().depth_m {
                Reading::Sampled { value, age_ms } => (Some(f64::from(value) - t.depth_m), age_ms, t.sink_rate_m_s),
                Reading::Missing => (None, 0, t.sink_rate_m_s),
            }
        })
        .collect()
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
}

#[test]
fn channels_err_as_described() {
    let errors = |c| depth_errors(c).into_iter().filter_map(|e| e.0).collect::<Vec<_>>();
    // Uniform water of the density for which depth is computed: a perfect channel is exact to f32 (1e-4 m at 1000 m).
    let (mean, sd) = mean_and_sd(&errors(Channel::default()));
    assert!(mean.abs() < 2e-4 && sd < 2e-4, "{mean} {sd}");
    // Standard error of 2000 samples: 2 % of the sd and 0.01 of it in the mean; four of them.
    let (mean, sd) = mean_and_sd(&errors(Channel { noise: 0.5, bias: 2.0, ..Channel::default() }));
    assert!((mean - 2.0).abs() < 0.05 && (sd - 0.5).abs() < 0.04, "{mean} {sd}");
    let (_, sd) = mean_and_sd(&errors(Channel { resolution: 0.4, ..Channel::default() }));
    assert!((sd - 0.4 / 12f64.sqrt()).abs() < 0.01, "uniform quantisation error: {sd}");
    let lagging = depth_errors(Channel { lag_s: 5.0, ..Channel::default() });
    // A ramp behind a first-order lag is late by lag times rate; sampled each second the discrete filter is half a second early.
    let late: Vec<f64> = lagging[1000..].iter().map(|e| -e.0.unwrap() / e.2).collect();
    assert!((mean_and_sd(&late).0 - 5.0).abs() < 0.7, "late by {} s", mean_and_sd(&late).0);
    let missing = depth_errors(Channel { dropout: 0.1, ..Channel::default() }).iter().filter(|e| e.0.is_none()).count();
    assert!((150..250).contains(&missing), "a tenth of 2000: {missing}");
    let held = depth_errors(Channel { period_s: 3.0, ..Channel::default() });
    assert!(held.iter().enumerate().all(|(n, e)| e.1 == 1000 * (n as u32 % 3)), "ages 0, 1, 2 s");
    assert!(depth_errors(Channel { absent: true, ..Channel::default() }).iter().all(|e| e.0.is_none()));
}
