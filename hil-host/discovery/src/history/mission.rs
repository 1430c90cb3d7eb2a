//! A mission as its own history: which changes its dives show, and what each dive says given the quiet ones before it. A dive is what was
//! logged of it, or the summary that a surfacing sent.

use super::changes::{Found, Observed, find};
use super::flight::{Said, sent_one_by_one};
use super::glide::Glider;
use super::judge::{Judgement, judge};
use super::kinds::{AFLOAT_ZERO, FOLLOWED};
use super::learn::{Between, FEWEST_CONTROLS, Learnt, WINDOW, learn, levels, linear_about, place, start_of_first};
use super::numbers::Numbers;
use super::rows::{Unit, median};
use super::sent::Sent;
use super::shown::afloat;
use super::summary::{Linear, Summary};
use super::weigh::{chance, inverse};
use hydro::effects::DAY_S;
use logs::vehicle::Vehicle;
use nalgebra::DVector;

/// A unit compared with the quiet ones before it.
#[derive(Clone, Debug)]
pub struct Compared {
    /// What is said of it.
    pub judgement: Judgement,
    /// How probable it is that a healthy one departs as much, and the least that this could be.
    pub chance: (f64, f64),
}

/// A dive, or the dives of one surfacing, of which a packet is all there is.
#[derive(Clone, Debug)]
pub struct SentDive {
    /// Its place.
    pub id: String,
    /// When its first row was, s since the start of the mission.
    pub start_s: f64,
    /// Mean of the size of pitch, rad.
    pub pitch_rad: f64,
    /// What it says, counted from the numbers of the vehicle file.
    pub sent: Sent,
}

/// Steady dives in the order of time.
#[derive(Clone, Debug)]
pub enum Dives {
    /// As logged.
    Logged(Vec<Unit>),
    /// As surfacings sent them, and the vehicle in whose sizes and from whose file on their numbers count.
    Sent(Vec<SentDive>, Box<Glider>),
}

impl Dives {
    /// How many.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Logged(units) => units.len(),
            Self::Sent(all, _) => all.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The dives of a mission as their own history.
#[derive(Clone, Debug)]
pub struct Mission {
    /// Its dives.
    pub dives: Dives,
    /// What its numbers are relative to.
    pub glider: Glider,
    /// Numbers beyond the vehicle file that the start of the mission has, in sizes.
    pub from: Numbers,
    /// What changed, of a mission with dives enough to ask.
    pub found: Found,
    /// Where each unit is linearised beyond the start and what is known to have changed, in sizes.
    own: Vec<Numbers>,
}

/// Fewest dives of which changes are asked.
pub const FEWEST_DIVES: usize = 5;

impl Mission {
    /// Of its steady dives in the order of time, at least one; `threshold` is that of a change.
    #[must_use]
    pub fn of(dives: Dives, vehicle: &Vehicle, threshold: f64) -> Self {
        /// Times that the dives are linearised anew where they say themselves that they are: before changes are asked, and with the
        /// changes found.
        const RELINEARISED: usize = 2;
        let (glider, from) = match &dives {
            Dives::Logged(units) => {
                let glider = Glider::of_units(vehicle, units);
                let from = start_of_first(units, &glider);
                (glider, from)
            }
            Dives::Sent(_, glider) => ((**glider).clone(), Numbers::zeros()),
        };
        let asked = if dives.len() < FEWEST_DIVES { f64::INFINITY } else { threshold };
        let own = vec![Numbers::zeros(); dives.len()];
        let mut out = Self { dives, glider, from, found: find(&[], f64::INFINITY), own };
        (0..RELINEARISED).for_each(|_| out.place());
        out.found = find(&out.observed(), asked);
        for _ in 0..RELINEARISED {
            if out.found.changes.is_empty() {
                break;
            }
            out.take_changes();
            out.own.fill(Numbers::zeros());
            out.found = find(&out.observed(), asked);
        }
        out.take_changes();
        out
    }

    /// Linearises each unit where it says itself that it is: a large change of one dive is not linear about the start.
    fn place(&mut self) {
        let days = self.days();
        let of = |(d, observed): (usize, Observed)| {
            let known = self.changed(d, &days);
            let expected = Between { mean: &self.found.between.mean + &known, ..self.found.between.clone() };
            let beyond = place(&observed.says, &expected) - known;
            Numbers::from_fn(|i, _| beyond[i].clamp(-1.0, 1.0))
        };
        self.own = self.observed().into_iter().enumerate().map(of).collect();
    }

    /// Day of the mission at which each unit began.
    #[must_use]
    pub fn days(&self) -> Vec<f64> {
        match &self.dives {
            Dives::Logged(units) => units.iter().map(|u| u.start_s() / DAY_S).collect(),
            Dives::Sent(all, _) => all.iter().map(|d| d.start_s / DAY_S).collect(),
        }
    }

    /// Usual size of pitch, rad, of dives and of climbs.
    #[must_use]
    pub fn pitch_rad(&self) -> [f64; 2] {
        [-1.0, 1.0].map(|way| match &self.dives {
            Dives::Logged(units) => median(units.iter().flat_map(|u| &u.rows).filter(|r| r.way == way).map(|r| r.pitch_rad.abs())),
            Dives::Sent(all, _) => median(all.iter().map(|d| d.pitch_rad)),
        })
    }

    /// What the changes found have done to the numbers of unit `d`, in sizes.
    #[must_use]
    pub fn changed(&self, d: usize, days: &[f64]) -> DVector<f64> {
        let mut out = DVector::zeros(FOLLOWED);
        for c in &self.found.changes {
            let gone = c.gone_at(d, days);
            match &c.several[..] {
                [] => out[c.kind.number] += c.size * gone,
                several => several.iter().for_each(|(number, size, _)| out[*number] += size * gone),
            }
        }
        out
    }

    /// What the changes found have done to the eight numbers of each dive.
    fn beyond(&self) -> Vec<Numbers> {
        let days = self.days();
        (0..days.len()).map(|d| Numbers::from_fn(|i, _| self.changed(d, &days)[i])).collect()
    }

    /// The units are linearised, and judged, as a vehicle that has changed so. A summary is linear as it is.
    fn take_changes(&mut self) {
        let beyond = self.beyond();
        if let Dives::Logged(units) = &mut self.dives {
            units.iter_mut().zip(beyond).for_each(|(u, beyond)| u.beyond = beyond);
        }
    }

    /// What each unit says, counted from the start of the mission.
    #[must_use]
    pub fn observed(&self) -> Vec<Observed> {
        let followed = |says: Summary, (precision, zero): (f64, f64), start_s: f64| {
            let mut out = Summary { n: says.n.resize(FOLLOWED, FOLLOWED, 0.0), u: says.u.resize_vertically(FOLLOWED, 0.0) };
            (out.n[(AFLOAT_ZERO, AFLOAT_ZERO)], out.u[AFLOAT_ZERO]) = (precision, zero);
            Observed { says: out, day: start_s / DAY_S }
        };
        match &self.dives {
            Dives::Logged(units) => {
                let all: Vec<Linear> = units.iter().zip(&self.own).map(|(u, own)| linear_about(u, &self.glider, &self.from, own)).collect();
                let (own, _) = levels(&all, None);
                let one = |((u, mut linear), level): ((&Unit, Linear), f64)| {
                    linear.count_from(&-u.beyond);
                    followed(Summary::of(&linear, level), afloat(u.afloat_pa), u.start_s())
                };
                units.iter().zip(all).zip(own).map(one).collect()
            }
            Dives::Sent(all, _) => {
                let usual = median(all.iter().map(|d| d.sent.level(None)));
                // No packet says what the sensor of pressure showed afloat.
                all.iter().map(|d| followed(d.sent.summary(Some(usual)), (0.0, 0.0), d.start_s)).collect()
            }
        }
    }

    /// Numbers of each unit beyond the vehicle file and 1 sigma of them, in sizes: what it says itself with what is usual of the mission,
    /// a number that is named in it free by one size. The sigma holds the scatter from dive to dive, not what all dives share.
    #[must_use]
    pub fn levels(&self, compared: &[Option<Compared>]) -> Vec<(DVector<f64>, DVector<f64>)> {
        let (days, between) = (self.days(), &self.found.between);
        let from = DVector::from_column_slice(self.from.as_slice()).resize_vertically(FOLLOWED, 0.0);
        let one = |(d, observed): (usize, &Observed)| {
            let expected = &between.mean + self.changed(d, &days);
            let mut prior = between.scatter.clone();
            let named = compared[d].iter().flat_map(|c| c.judgement.class.iter().take(1));
            named.for_each(|k| prior[(*k, *k)] += 1.0);
            let covariance = inverse(&(&observed.says.n + inverse(&prior)));
            let mean = &expected + &covariance * observed.says.about(&expected);
            let sigma = DVector::from_fn(FOLLOWED, |i, _| (covariance[(i, i)] + between.scatter[(i, i)]).sqrt());
            (&from + mean, sigma)
        };
        self.observed().iter().enumerate().map(one).collect()
    }

    fn quiet_before<'a>(&self, units: &'a [Unit], i: usize) -> Vec<&'a Unit> {
        let quiet: Vec<&Unit> = units[..i].iter().zip(&self.found.quiet).filter(|(_, quiet)| **quiet).map(|(u, _)| u).collect();
        quiet[quiet.len().saturating_sub(WINDOW)..].to_vec()
    }

    /// Every unit compared with the quiet ones before it, the changes found taken for known; none of those that have too few before them.
    #[must_use]
    pub fn one_by_one(&self) -> Vec<Option<Compared>> {
        match &self.dives {
            Dives::Logged(units) => self.logged_one_by_one(units),
            Dives::Sent(all, _) => {
                let without_changes = all.iter().zip(self.beyond()).map(|(d, beyond)| {
                    let mut sent = d.sent.clone();
                    sent.count_from(&beyond);
                    (d.id.clone(), sent)
                });
                let said = sent_one_by_one(&without_changes.collect::<Vec<_>>(), &self.glider);
                said.into_iter().map(|s| s.map(|Said { judgement, chance, .. }| Compared { judgement, chance })).collect()
            }
        }
    }

    fn logged_one_by_one(&self, units: &[Unit]) -> Vec<Option<Compared>> {
        /// A history of this many controls is learnt anew after so many more.
        const LEARNT: (usize, usize) = (12, 4);
        let mut earlier = Vec::new();
        let mut last: Option<(usize, Learnt)> = None;
        let one = |i: usize| {
            let before = self.quiet_before(units, i);
            let seen = self.found.quiet[..i].iter().filter(|quiet| **quiet).count();
            if before.len() < FEWEST_CONTROLS {
                return None;
            }
            let is_new = |at: usize| seen > at && (seen < LEARNT.0 || seen >= at + LEARNT.1);
            if last.as_ref().is_none_or(|l| is_new(l.0)) {
                last = Some((seen, learn(&before, &self.glider, &self.from)));
            }
            let history = &last.as_ref()?.1;
            let judgement = judge(&units[i], &self.glider, history, &history.at);
            let chance = chance(judgement.chi2, &earlier);
            if judgement.is_quiet() {
                earlier.push(judgement.chi2);
            }
            Some(Compared { judgement, chance })
        };
        (0..units.len()).map(one).collect()
    }
}
