//! Do we agree with the sea, and what is missing: flights and vehicles are read, a model of the vehicle is run on the measured
//! inputs, its residual is whitened, and every named effect is asked whether it explains what remains.

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
pub use criticism::residual_tests as remainder;
pub use criticism::unmodelled as strangers;
pub use diagnosis as diagnose;
pub use diagnosis::report;
pub use hypotheses::bank;
pub use hypotheses::candidate as screen;
pub use hypotheses::hull_lag;
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
pub use workbench::localise as whereabouts;
pub use workbench::next_flight as plan;
#[allow(unused_imports)]
pub(crate) use {
    criticism::held_out as kept_out, criticism::periodogram as periodic, criticism::plausibility as unlike, diagnosis::settle as looks,
    hypotheses::aliases as twins, hypotheses::late_stall, inference::wave_train, likelihood::discrepancy as form,
    likelihood::finite_difference as slope, preprocess::ctd_gaps as column, preprocess::gaps as unseen,
    preprocess::stuck_sensors as repairs,
};

pub use record::flight::Flight;
pub use vehicle::Vehicle;
