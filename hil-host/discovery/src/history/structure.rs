//! What departs and is none of the eight numbers: climb drag, Reynolds number, drag of a bank, weight that comes or goes, and structures
//! by depth, roll and heading without a name. All are made orthogonal to the eight, so that they say only what those cannot.

use super::numbers::{ALL, BALLAST_OFFSET, DRAG_LEVEL, FORMS_OF_DRAG, NUMBERS};
use super::rows::{Unit, median};
use super::summary::{Linear, Summary};
use super::weigh::weigh;
use nalgebra::{DMatrix, DVector};

/// Hats over the depth, of each leg.
const HATS: usize = 5;
/// Effects that have a form: climb drag, Reynolds exponent, bank drag, weight rate.
pub const FORMS: usize = 4;
/// Sizes of the forms: ln of drag in climbs, exponent, share per rad², kg where the engine moves 200 cm³ (the offset's own size).
pub const OF_FORMS: [f64; FORMS] = [0.2, 0.4, 4.0, 1.0];
/// Columns behind the eight numbers.
pub const FURTHER: usize = FORMS + 2 * HATS + 3;
/// All columns of a summary.
pub const COLUMNS: usize = NUMBERS + FURTHER;
/// Size of a structure without a form, m/s.
const SIZE_M_S: f64 = 0.01;
/// Scatter from dive to dive that is expected of forms and of structures, in sizes.
const STRUCTURE_SCATTER: [f64; 2] = [0.1, 0.3];

/// One thing that may depart, and its columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Departure {
    /// Name in tables.
    pub name: &'static str,
    /// The variable that it follows.
    pub variable: &'static str,
    /// What it may be.
    pub about: &'static str,
    /// Effect of the catalogue that has its form.
    pub effect: Option<&'static str>,
    first: usize,
    n: usize,
}

const fn departure(name: &'static str, variable: &'static str, about: &'static str, first: usize, n: usize) -> Departure {
    Departure { name, variable, about, effect: None, first: NUMBERS + first, n }
}

const fn of_form(effect: &'static str, of: Departure) -> Departure {
    Departure { effect: Some(effect), ..of }
}

/// All of them.
pub const DEPARTURES: [Departure; 7] = [
    of_form(FORMS_OF_DRAG[0], departure("drag_of_climbs", "climb", "more drag in climbs than in dives, or a thruster", 0, 1)),
    of_form(FORMS_OF_DRAG[1], departure("speed_exponent", "speed", "drag that depends on the speed otherwise", 1, 1)),
    of_form(FORMS_OF_DRAG[2], departure("bank_drag", "bank", "drag that grows with the bank", 2, 1)),
    departure("weight_rate", "time", "weight that comes or goes during the dive", 3, 1),
    departure(
        "by_depth",
        "depth",
        "something that comes with depth on one leg: the sea bed, a fouled sensor, a band of water",
        FORMS,
        2 * HATS,
    ),
    departure("by_roll", "roll", "one side differs from the other", FORMS + 2 * HATS, 1),
    departure("by_heading", "heading", "a current, or a compass", FORMS + 2 * HATS + 1, 2),
];

/// Standard deviations from dive to dive that are expected of the further columns, in sizes.
#[must_use]
pub fn scatter() -> Vec<f64> {
    (0..FURTHER).map(|i| STRUCTURE_SCATTER[usize::from(i >= FORMS)]).collect()
}

/// The further columns at a linearisation with these modelled vertical velocities, of one size each.
#[must_use]
pub fn columns(unit: &Unit, rises: &[f64], jacobian: &DMatrix<f64>, kept: &[bool]) -> DMatrix<f64> {
    /// Roll beyond which no drag of a bank is asked for, rad.
    const STEEP_RAD: f64 = 0.6;
    // Of the model: a measured one holds the noise that it is compared with.
    let usual = median(rises.iter().map(|w| w.abs())).max(1e-3);
    let mut deep: Vec<f64> = unit.rows.iter().map(|r| r.pressure_pa).collect();
    deep.sort_by(f64::total_cmp);
    let deep = deep.get(deep.len() * 49 / 50).copied().unwrap_or(1.0).max(1.0);
    let middle_s = unit.rows.iter().map(|r| r.time_s).sum::<f64>() / unit.rows.len() as f64;
    let duration_s = unit.duration_s().max(1.0);
    let at = |i: usize, k: usize| {
        let r = &unit.rows[i];
        let drag = jacobian[(i, DRAG_LEVEL)] / ALL[DRAG_LEVEL].size;
        match k {
            0 => drag * OF_FORMS[0] * f64::from(u8::from(r.way > 0.0)),
            1 => -drag * OF_FORMS[1] * (rises[i].abs() / usual).max(0.05).ln(),
            2 => drag * OF_FORMS[2] * r.roll_rad.abs().min(STEEP_RAD).powi(2),
            3 => jacobian[(i, BALLAST_OFFSET)] * OF_FORMS[3] * (r.time_s - middle_s) / duration_s,
            k if k < FORMS + 2 * HATS => {
                let (leg, hat) = ((k - FORMS) / HATS, (k - FORMS) % HATS);
                let z = (r.pressure_pa / deep).clamp(0.0, 1.0) * (HATS - 1) as f64;
                let on = (r.way > 0.0) == (leg == 1);
                SIZE_M_S * f64::from(u8::from(on)) * (1.0 - (z - hat as f64).abs()).max(0.0)
            }
            k if k == FORMS + 2 * HATS => SIZE_M_S * r.roll_rad.clamp(-STEEP_RAD, STEEP_RAD) / 0.3,
            k if k == FORMS + 2 * HATS + 1 => SIZE_M_S * r.heading_rad.cos(),
            _ => SIZE_M_S * r.heading_rad.sin(),
        }
    };
    let all = DMatrix::from_fn(unit.rows.len(), FURTHER, |i, k| if kept[i] { at(i, k) } else { 0.0 });
    let mut information = jacobian.tr_mul(jacobian);
    let ridge = 1e-8 * information.trace();
    (0..NUMBERS).for_each(|i| information[(i, i)] += 1e-6 * information[(i, i)] + ridge);
    let share = information.cholesky().map(|c| c.solve(&jacobian.tr_mul(&all)));
    share.map_or_else(|| DMatrix::zeros(unit.rows.len(), FURTHER), |share| all - jacobian * share)
}

/// What departs beyond the eight numbers: the likeliest, where its odds beat all that were asked.
#[must_use]
pub fn departs(linear: &Linear, level: f64, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<(Departure, f64)> {
    /// Odds against each rival.
    const ODDS: f64 = 10.0;
    let unit = Summary::of(linear, level);
    let all = DEPARTURES.iter().map(|d| {
        let columns: Vec<usize> = (d.first..d.first + d.n).collect();
        (*d, weigh(&unit, mean, covariance, &columns).ln_bayes)
    });
    let best = all.filter(|d| d.1.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 > (ODDS * (NUMBERS + DEPARTURES.len()) as f64).ln()).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_an_effect_of_the_catalogue() {
        let forms: Vec<&str> = DEPARTURES.iter().filter_map(|d| d.effect).collect();
        assert!(!forms.is_empty() && forms.iter().all(|effect| hydro::effects::by_name(effect).is_some()), "{forms:?}");
    }
}
