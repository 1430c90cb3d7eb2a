//! Do we agree with the sea, and what is missing: flights and vehicles are read, a model of the vehicle is run on the measured
//! inputs, its residual is whitened, and every named effect is asked whether it explains what remains.
//!
//! Folders in the order in which they may use each other: [`preprocess`], [`model`], [`likelihood`], [`inference`], [`hypotheses`],
//! [`criticism`], [`history`], [`diagnosis`], [`workbench`], [`forecast`]; [`steady`] stands beside them. Flights and vehicles come from [`logs`].
//!
//! # Words
//!
//! * **run**: a stretch of a flight that starts from a known state: a segment, a dive, or what follows a gap.
//! * **calibration**: the parameters that scatter in every vehicle of a kind; nuisance parameters of every fit. Their priors are normal
//!   with the tolerances of the vehicle file as standard deviations, and they are counted in these.
//! * **effect**: a piece of physics that the nominal model lacks. Its first parameter is its size; at `off` it is not there.
//! * **hypothesis**: a set of effects, none included ("nothing is missing").
//! * **residual**: measurement less model. **Innovation**: the part of a residual that the residuals before it do not predict, in its
//!   own standard deviations; white and of variance 1 where nothing is missing. **Whitening** makes innovations of residuals.
//! * **sensitivity** (signature): derivative of the whitened prediction with respect to a parameter.
//! * **evidence**: likelihood of a hypothesis averaged over its prior, by Laplace's approximation. **Log odds**: log evidence and log
//!   prior against "nothing is missing". **Bayes factor**: the ratio of two evidences; below ten to one two hypotheses are *equivalent*.
//! * **discrepancy**: a smooth vertical velocity of unknown small size that the model is wrong by under every hypothesis, because nature's
//!   law is another; marginalised in every likelihood.
//! * **linearisation**: a fit with its residual, its sensitivities and their curvature. **Projected columns**: further sensitivities of which
//!   what the fit could follow is taken out.
//! * **nuisance**: a number of a sensor or of the log that is estimated with the law: clock, pressure zero and port, late hull, bank.
//! * **displacement**: the way from the GPS fixes before a run, or several, to those after.
//! * **unmodelled effect**: a structure that follows some variable and that no effect of the catalogue makes; it can only make a verdict
//!   *unexplained*.
//! * **branch**: which way lift goes on beyond the angle of attack where the law ends; **mask**: rows near the stall, which depend on it, left out.
//! * **check segments**: segments kept out of every fit; errors that are stated are theirs (**held out**).
//! * **block error**: rms over 20 s blocks of the difference of mean depth rates, measured and modelled, m/s.
//! * **noise floor**: the block error that ordinary water motion and sensor noise alone would leave.
//!
//! # Dependencies
//!
//! * `nalgebra`: linear algebra of the fits
//! * `wide`: four simulations side by side
//! * `rayon`: runs of a flight on all cores
//! * `libm`: functions that give the same bits on every computer
//! * `serde`, `serde_json`: answers as documents

pub mod ablation;
pub mod criticism;
pub mod diagnosis;
pub mod forecast;
pub mod history;
pub mod hypotheses;
pub mod inference;
pub mod likelihood;
pub mod model;
pub mod preprocess;
pub mod steady;
pub mod workbench;

#[cfg(test)]
mod tests;
