//! Do we agree with the sea, and what is missing: flights and vehicles are read, a model of the vehicle is run on the measured
//! inputs, its residual is whitened, and every named effect is asked whether it explains what remains.
//!
//! Folders in the order in which they may use each other: [`record`], [`vehicle`], [`preprocess`], [`model`], [`likelihood`],
//! [`inference`], [`hypotheses`], [`criticism`], [`diagnosis`], [`workbench`]; [`steady`], [`import`] and [`export`] stand beside them.
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
//! * **discrepancy**: what the form of a law leaves because nature's is another.
//! * **branch**: which way lift goes on beyond the angle of attack where the law ends; **mask**: rows that depend on it, left out.
//! * **check segments**: segments kept out of every fit; errors that are stated are theirs (**held out**).
//! * **block error**: rms over 20 s blocks of the difference of mean depth rates, measured and modelled, m/s.
//! * **noise floor**: the block error that ordinary water motion and sensor noise alone would leave.

pub mod ablation;
pub mod criticism;
pub mod diagnosis;
pub mod export;
pub mod hypotheses;
pub mod import;
pub mod inference;
pub mod likelihood;
pub mod model;
pub mod preprocess;
pub mod record;
pub mod steady;
pub mod vehicle;
pub mod workbench;

// Where modules stood before they had folders; to be deleted.
pub use criticism::localise as whereabouts;
pub use criticism::residual_tests as remainder;
pub use criticism::unmodelled as strangers;
pub use diagnosis as diagnose;
pub use diagnosis::hull_lag;
pub use diagnosis::report;
pub use hypotheses::bank;
pub use hypotheses::candidate as screen;
pub use hypotheses::search;
pub use hypotheses::sensitivity as signature;
pub use inference::evidence;
pub use inference::gauss_newton as fit;
pub use inference::initial_guess as start;
pub use likelihood as problem;
pub use likelihood::battery as moments;
pub use likelihood::block_error as metric;
pub use likelihood::displacement as ways;
pub use likelihood::selection as left_out;
pub use likelihood::stall_mask as brink;
pub use likelihood::whitening as noise;
pub use model::dynamics;
pub use model::integrator as lanes;
pub use model::internal_wave as wave;
pub use model::parameters as calibration;
pub use preprocess as prepare;
pub use preprocess::clock_offset as clocks;
pub use preprocess::dives;
pub use preprocess::sanity as inputs;
pub use preprocess::spikes;
pub use record::csv as read;
pub use record::flight;
pub use record::resample as align;
pub use vehicle::effects_table as switched_on;
pub use vehicle::expression;
pub use vehicle::file as vehicle_file;
pub use workbench::add;
pub use workbench::compare;
pub use workbench::next_flight as plan;
#[allow(unused_imports)]
pub(crate) use {
    criticism::held_out as kept_out, criticism::periodogram as periodic, criticism::plausibility as unlike, diagnosis::settle as looks,
    hypotheses::aliases as twins, hypotheses::discrepancy as form, hypotheses::late_stall, inference::wave_train,
    likelihood::finite_difference as slope, preprocess::ctd_gaps as column, preprocess::gaps as unseen,
    preprocess::stuck_sensors as repairs,
};

pub use record::flight::Flight;
pub use vehicle::Vehicle;
