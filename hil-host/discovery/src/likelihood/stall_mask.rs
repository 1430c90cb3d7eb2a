//! What no model knows: flight beyond the valid angle of attack, where the law of lift is anybody's continuation.
//!
//! A glider that stalls deeply (after a launch, a turn, or at a shallow pitch) may stay there for minutes, and whether a model does
//! depends on the continuation. Rows that depend on it are left out of the fit.
//!
//! Where the vehicle is plainly seen to glide after a launch, that is settled for good: the model is held attached through the launch
//! under every hypothesis. Without that, whether a leg stalls flips with small changes of the calibration: rows that one state
//! explains make the misfit of its neighbours explode, and clean flights look as if something were missing.

use crate::likelihood::Problem;
use crate::likelihood::block_error::{Block, modelled_m_s};
use crate::model::branch::{BOTH, Branch, HELD_S, Stretch};
use crate::model::dynamics::Track;
use crate::model::integrator::tracks_of;
use crate::model::parameters::State;
use crate::preprocess::{Prepared, Run};
use hydro::effects::{ALPHA_VALID_RAD, Continuation};

/// How long rows stay out after the continuations agree again, s: two time constants of surge.
const AFTER_S: f64 = 20.0;
/// A stretch beyond the valid angle of attack that both continuations have left after this time, s, is passed through; what lasts
/// longer may be nature's other branch.
const PASSING_S: f64 = 120.0;
/// Share of the noise floor within which both continuations give a block the same rate.
const SAME_BRANCH: f64 = 0.2;
/// A stall is told from a glide where their rates differ by so many times the rms of the water motion, and one is seen where it
/// leaves less than this share of the other's mean square: what is missing in a model moves a glide by much less than a stall does.
const DISTINCT: f64 = 3.0;
const MUCH_NEARER: f64 = 0.25;
/// One row in so many may be beyond the valid angle of attack in a glide.
const HARDLY: usize = 20;

/// Whether a time lies in a stretch, after the launch that it begins with.
fn after_launch((from, to): Stretch, time_s: f64) -> bool {
    (from + HELD_S + AFTER_S..=to).contains(&time_s)
}

/// Mean square by which a track misses the measured rates of some 20 s over these rows, (m/s)²; not a number where there are none.
fn misfit_of_rates(run: &Run, rows: &[usize], t: &Track) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut start = rows.first().copied().unwrap_or(0);
    for &row in rows {
        let dt = run.time_s[row] - run.time_s[start];
        if dt >= AFTER_S {
            let missed = |from: usize, to: usize| (run.depth_m[to] - t.depth_m[to]) - (run.depth_m[from] - t.depth_m[from]);
            sum += (missed(start, row) / dt).powi(2);
            count += 1.0;
            start = row;
        }
    }
    sum / count
}

impl Problem<'_> {
    /// Tracks of these runs under each continuation.
    pub(crate) fn both_tracks(&self, runs: &[&Run], state: &State) -> Vec<[Track; 2]> {
        let (constants, effects) = self.law(state);
        let [rising, fading] = BOTH.map(|c| tracks_of(runs, constants, &effects, self.vehicle.water_depth_m, c, &[]));
        rising.into_iter().zip(fading).map(|(a, b)| [a, b]).collect()
    }

    /// Those of these blocks that do not depend, at a state, on how lift goes on beyond its law.
    pub(crate) fn away_from_stall(&self, prepared: &Prepared, state: &State, blocks: &[(usize, Vec<Block>)]) -> Vec<(usize, Vec<Block>)> {
        let runs: Vec<&Run> = blocks.iter().map(|(k, _)| &prepared.runs[*k]).collect();
        let near = SAME_BRANCH * self.noise_floor_m_s();
        let kept = |((k, list), both): (&(usize, Vec<Block>), [Track; 2])| {
            let run = &prepared.runs[*k];
            let rate = |b: &Block, t: &Track| modelled_m_s(run, b, &t.depth_m);
            let same = |b: &&Block| (rate(b, &both[0]) - rate(b, &both[1])).abs() < near;
            (*k, list.iter().filter(same).cloned().collect())
        };
        blocks.iter().zip(self.both_tracks(&runs, state)).map(kept).collect()
    }

    /// Block residuals of a state, m/s: of blocks that depend on how lift goes on beyond its law, and of the others.
    pub(crate) fn residuals_near_stall_and_elsewhere(
        &self,
        prepared: &Prepared,
        state: &State,
        blocks: &[(usize, Vec<Block>)],
    ) -> [Vec<f64>; 2] {
        let [mut near, mut elsewhere] = [Vec::new(), Vec::new()];
        let runs: Vec<&Run> = blocks.iter().map(|(k, _)| &prepared.runs[*k]).collect();
        for ((run, (_, list)), both) in runs.iter().zip(blocks).zip(self.both_tracks(&runs, state)) {
            let [mine, other] = self.branch.in_force(both).map(|t| t.depth_m);
            for b in list {
                let rate = modelled_m_s(run, b, &mine);
                let same = (rate - modelled_m_s(run, b, &other)).abs() < SAME_BRANCH * self.noise_floor_m_s();
                if same { &mut elsewhere } else { &mut near }.push(b.observed_m_s - rate);
            }
        }
        [near, elsewhere]
    }

    /// Takes rows out that at this state depend on how lift goes on beyond the valid angle of attack (launch, turns, deep stall
    /// after them), and settles on the continuation that fits those rows better. A vehicle that is seen to glide after its launch is held
    /// to that under every hypothesis, and its rows take part. Returns how many rows went or came back.
    pub fn settle_continuation(&mut self, state: &State) -> usize {
        let before = self.near_stall.clone();
        let mut misfit = [0.0; 2];
        let (mut launches, mut glides) = (0, 0);
        for (k, tracks) in self.both_tracks(&self.runs, state).into_iter().enumerate() {
            let run = self.runs[k];
            let limit = self.colour.rms_m_s;
            let mut last = f64::NEG_INFINITY;
            let mut stretches: Vec<Stretch> = Vec::new();
            let mut lost = 0.0;
            for row in 0..run.time_s.len() {
                let t = run.time_s[row];
                if (tracks[0].sink_m_s[row] - tracks[1].sink_m_s[row]).abs() > limit {
                    last = t;
                    lost += if row > 0 { t - run.time_s[row - 1] } else { 0.0 };
                }
                if t - last >= AFTER_S {
                    continue;
                }
                match stretches.last_mut() {
                    Some((_, end)) if row > 0 && *end == run.time_s[row - 1] => *end = t,
                    _ => stretches.push((t, t)),
                }
                if !run.used[row] {
                    continue;
                }
                if row > 0 && run.depth_m[row - 1].is_finite() {
                    let dt = t - run.time_s[row - 1];
                    let seen = run.depth_m[row] - run.depth_m[row - 1];
                    for (m, c) in misfit.iter_mut().zip(&tracks) {
                        *m += (seen - (c.depth_m[row] - c.depth_m[row - 1])).powi(2) / dt;
                    }
                }
                self.near_stall[k][row] = true;
            }
            // What a hypothesis does with a launch or a turn that is left out must not decide whether it stalls all the way after it.
            let (mut passed, long): (Vec<Stretch>, Vec<Stretch>) = stretches.into_iter().partition(|(from, to)| to - from < PASSING_S);
            let seen = self.seen_attached(run, state, &tracks, &long);
            launches += long.len();
            glides += seen.len();
            for (from, to) in seen {
                for row in (0..run.time_s.len()).filter(|&row| after_launch((from, to), run.time_s[row])) {
                    self.near_stall[k][row] = false;
                    let dt = if row > 0 { run.time_s[row] - run.time_s[row - 1] } else { 0.0 };
                    lost = (lost - dt).max(0.0);
                }
                passed.push((from, from + HELD_S));
            }
            self.attached[k] = passed;
            self.near_stall_s[k] = lost;
        }
        let continuation = if misfit[1] < 0.8 * misfit[0] { Continuation::Fading } else { Continuation::Rising };
        self.branch = Branch { continuation, glides: 2 * glides >= launches };
        self.refresh();
        self.near_stall.iter().flatten().zip(before.iter().flatten()).filter(|(now, then)| now != then).count()
    }

    /// Those of these stretches in which the vehicle is seen to glide: once the flow is held attached for as long as a launch takes,
    /// the model goes on in a glide that is much nearer to what was measured than a stall is.
    fn seen_attached(&self, run: &Run, state: &State, tracks: &[Track; 2], long: &[Stretch]) -> Vec<Stretch> {
        if long.is_empty() {
            return Vec::new();
        }
        let held: Vec<Stretch> = long.iter().map(|(from, _)| (*from, from + HELD_S)).collect();
        let (constants, effects) = self.law(state);
        let mut tracks_held = tracks_of(&[run], constants, &effects, self.vehicle.water_depth_m, self.branch.continuation, &held);
        let Some(glide) = tracks_held.pop() else { return Vec::new() };
        let distinct = (DISTINCT * self.colour.rms_m_s).powi(2);
        let seen = |stretch: &Stretch| {
            let rows: Vec<usize> = (0..run.time_s.len()).filter(|&i| run.used[i] && after_launch(*stretch, run.time_s[i])).collect();
            let stalled = rows.iter().filter(|&&i| glide.alpha_rad[i].abs() > ALPHA_VALID_RAD).count();
            let of_stall = tracks.iter().map(|t| misfit_of_rates(run, &rows, t)).fold(f64::NAN, f64::max);
            // Not a number where there is nothing to judge by.
            stalled * HARDLY <= rows.len() && of_stall > distinct && misfit_of_rates(run, &rows, &glide) < MUCH_NEARER * of_stall
        };
        long.iter().filter(|s| seen(s)).copied().collect()
    }

    /// Rows that [`Self::settle_continuation`] took out.
    #[must_use]
    pub fn rows_near_stall(&self) -> usize {
        self.near_stall.iter().flatten().filter(|b| **b).count()
    }
}
