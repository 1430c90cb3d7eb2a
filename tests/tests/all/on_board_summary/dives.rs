//! Dives of a made-up vehicle, cycle by cycle: what is left out, and what the packet says of a vehicle that is off.

use evidence::glide::linearise;
use evidence::rows::{Row, Rows};
use evidence::{Cycle, Dives, NUMBERS, SIZES, Vehicle};
use polar::Table;
use signals::Wings;

const VEHICLE: Vehicle = Vehicle {
    mass_kg: 60.0,
    volume_m3: 0.0585,
    compressibility_per_pa: 4e-10,
    expansion_per_k: 6e-5,
    reference_degc: 12.0,
    ballast_gain: 1.0,
    pitch_gain: 1.0,
    pitch_offset_rad: 0.0,
};

fn table() -> Table<'static> {
    polar::builtin(Wings::Standard).unwrap()
}

/// Vertical speed of the steady glide, m/s.
fn speed(vehicle: &Vehicle, table: &Table<'_>, row: &Row) -> f32 {
    f64::from(linearise(vehicle, table, row, 0.05).unwrap().square).sqrt() as f32
}

/// Water at a depth: density kg/m³, temperature °C.
fn water(pressure_pa: f32) -> (f32, f32) {
    let degc = (6.0 + 14.0 * (-f64::from(pressure_pa) / 4e5).exp()) as f32;
    (1027.0 - 0.2 * degc + 4.4e-7 * pressure_pa, degc)
}

/// Two dives to about 150 m of a vehicle whose numbers are as `truth` has them, a cycle each 4 s.
fn dives(truth: &Vehicle) -> Vec<Cycle> {
    let table = table();
    let (mut out, mut p, mut s) = (Vec::new(), 1e4_f32, 0_u64);
    let mut way = -1.0_f32;
    for _ in 0..4 {
        for i in 0_u32.. {
            let (density_kg_m3, temperature_degc) = water(p);
            let pitch_rad = way * (0.42 + 0.06 * (f64::from(i) * 0.02).sin()) as f32;
            let row =
                Row { pressure_pa: p, rise_m_s: way, density_kg_m3, temperature_degc, pitch_rad, ballast_m3: way * 2e-4, ..Row::default() };
            let rise_m_s = way * speed(truth, &table, &row);
            out.push(Cycle {
                time_us: s * 1_000_000,
                pressure_pa: p,
                pitch_rad,
                roll_rad: 0.02,
                ballast_m3: way * 2e-4,
                density_kg_m3,
                temperature_degc,
            });
            p -= rise_m_s * 4.0 * density_kg_m3 * 9.81;
            s += 4;
            if !(5e3..1.5e6).contains(&p) {
                break;
            }
        }
        way = -way;
    }
    out
}

fn rows(cycles: &[Cycle]) -> Vec<Row> {
    let (mut rows, mut out) = (Rows::new(), Vec::new());
    cycles.iter().for_each(|c| rows.take(c, |row| out.push(*row)));
    out
}

#[test]
fn accuracy_derivatives_are_differences_of_the_glide() {
    let table = table();
    for (way, p) in [(-1.0, 2e5), (1.0, 1.2e6)] {
        let (density_kg_m3, temperature_degc) = water(p);
        let row = Row {
            pressure_pa: p,
            rise_m_s: way,
            density_kg_m3,
            temperature_degc,
            pitch_rad: way * 0.4,
            ballast_m3: way * 2e-4,
            ..Row::default()
        };
        let row = Row { rise_m_s: way * speed(&VEHICLE, &table, &row), ..row };
        let here = linearise(&VEHICLE, &table, &row, 0.0).unwrap();
        assert!(here.residual.abs() < 1e-6);
        let moved: [fn(&mut Vehicle, &mut Row, f32); 6] = [
            |v, _, x| v.mass_kg += x,
            |v, _, x| v.compressibility_per_pa += x,
            |v, _, x| v.expansion_per_k += x,
            |v, _, x| v.pitch_offset_rad += x,
            |v, _, x| v.pitch_gain *= f64::from(x).exp() as f32,
            |v, _, x| v.ballast_gain *= f64::from(x).exp() as f32,
        ];
        for (k, by) in (1..=6).zip(moved) {
            let at = |share: f32| {
                let (mut v, mut r) = (VEHICLE, row);
                by(&mut v, &mut r, share * SIZES[k]);
                speed(&v, &table, &r) * way
            };
            let difference = (at(0.1) - at(-0.1)) / 0.2;
            assert!(
                (difference - here.by_number[k]).abs() < 0.01 * difference.abs() + 1e-5,
                "{way} {k}: {difference} {}",
                here.by_number[k]
            );
        }
        // The balance itself: lift and drag at the angle that was found.
        let c = table.at(here.alpha_rad);
        assert!((f64::from(c.cd / c.cl) - f64::from(0.4 + here.alpha_rad).tan()).abs() < 1e-4);
    }
}

#[test]
fn rows_near_turns_with_a_moving_pump_or_old_sensors_are_left_out() {
    let cycles = dives(&VEHICLE);
    let good = rows(&cycles);
    assert!(good.len() > 60, "{}", good.len());
    assert!(good.iter().all(|r| r.pressure_pa < 1.41e6 && r.pressure_pa > 1e5));
    let (mut at, mut n) = (cycles.clone(), 0);
    let mut with = |change: &mut dyn FnMut(usize, &mut Cycle)| {
        at.clone_from(&cycles);
        at.iter_mut().for_each(|c| {
            change(n, c);
            n += 1;
        });
        n = 0;
        rows(&at).len()
    };
    assert_eq!(with(&mut |i, c| c.ballast_m3 += 1e-6 * (i % 20) as f32), 0, "the pump moves");
    assert_eq!(with(&mut |_, c| c.pitch_rad = f32::NAN), 0, "no pitch");
    assert_eq!(with(&mut |_, c| c.pressure_pa = 1.2e6), 0, "on the sea bed");
    assert_eq!(with(&mut |i, c| c.density_kg_m3 = if i % 2 == 0 { f32::INFINITY } else { f32::NAN }), 0, "no water");
    let missing = with(&mut |i, c| {
        if (100..140).contains(&i) {
            c.pressure_pa = f32::NAN;
        }
    });
    assert!(missing < good.len() && missing > good.len() - 8, "{missing} of {}", good.len());
}

#[test]
fn accuracy_a_vehicle_that_is_off_is_found_in_its_packet() {
    let table = table();
    let said = |truth: &Vehicle| {
        let mut of = Dives::new();
        dives(truth).iter().for_each(|c| of.take(&VEHICLE, &table, c));
        of.packet(7)
    };
    let right = said(&VEHICLE);
    assert!(right.blocks == 4 && right.directions == 16 && right.refused == 0 && (right.drive_m3 - 2e-4).abs() < 1e-8, "{right:?}");
    assert!(right.variance < 1e-6, "means over 40 s of a glide that bends: {right:?}");
    // 0.05 kg too heavy is half a size: R d = y in the least squares' sense.
    let heavy = said(&Vehicle { mass_kg: 60.05, ..VEHICLE });
    let mut all = evidence::factor::Factor::default();
    heavy.lines.iter().for_each(|l| all.add(*l));
    let mut alone = (0.0, 0.0);
    heavy.lines.iter().for_each(|l| alone = (alone.0 + l[1] * l[1], alone.1 + l[1] * l[NUMBERS]));
    assert!((alone.1 / alone.0 - 0.5).abs() < 0.05, "{}", alone.1 / alone.0);
    assert!(heavy.variance > 20.0 * right.variance);
}

#[test]
fn its_state_is_bounded() {
    assert!(size_of::<Dives>() <= 2048, "{}", size_of::<Dives>());
}

#[test]
fn prop_no_numbers_make_it_panic_or_not_finite() {
    let table = table();
    let (mut of, mut seed) = (Dives::new(), 7_u64);
    let odd = [f32::NAN, f32::INFINITY, -1e30, 1e30, 0.0, -0.0, 1e-38, 0.4, -0.4, 1e6, 1025.0, 2e-4];
    for i in 0..200_000_u64 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let pick = |k: u32| odd[(seed >> (5 * k + 8)) as usize % odd.len()];
        let (ways, whole) = ((i / 300) % 2 == 0, seed >> 60 > 0);
        let way = if ways { -1.0 } else { 1.0 };
        let p = 2e4 + (i % 300) as f32 * 8e3;
        let p = if ways { p } else { 2.4e6 - p };
        let sound = Cycle {
            time_us: i * 4_000_000,
            pressure_pa: p,
            pitch_rad: way * 0.4,
            roll_rad: 0.0,
            ballast_m3: way * 2e-4,
            density_kg_m3: 1025.0,
            temperature_degc: 10.0,
        };
        let cycle = if whole {
            sound
        } else {
            Cycle {
                pressure_pa: pick(0),
                pitch_rad: pick(1),
                ballast_m3: pick(2),
                density_kg_m3: pick(3),
                temperature_degc: pick(4),
                roll_rad: pick(5),
                ..sound
            }
        };
        of.take(&VEHICLE, &table, &cycle);
        if i % 5000 == 0 {
            assert!(of.packet(0).encode().is_some(), "{:?}", of.packet(0));
        }
    }
    assert!(of.rows() > 100, "{}", of.rows());
}
