//! No answer is worse than its start: where a refit leaves a larger error on the fitted dives than the vehicle file as given, the file's
//! numbers stay. Dives that were kept out judge, and choose nothing.

use super::Diagnosis;
use crate::model::parameters::State;

impl Diagnosis {
    /// A refit that leaves more on the fitted dives than the file as given is no recalibration.
    pub(super) fn no_worse_than_the_file(mut self) -> Self {
        let [given, refitted, _] = self.fitted_error_m_s;
        if !given.is_finite() || refitted <= given {
            return self;
        }
        self.recalibrated = State::nominal();
        let unnamed = self.answer.is_empty();
        for errors in [&mut self.fitted_error_m_s, &mut self.block_error_m_s] {
            errors[1] = errors[0];
            if unnamed {
                errors[2] = errors[0];
            }
        }
        if unnamed {
            self.after = State::nominal();
            (self.parts.moved, self.parts.polar) = (Vec::new(), Vec::new());
            self.parts.worth = Err("no refit of this flight is better than the file");
        }
        self.notes
            .push("a refit of the calibration leaves a larger depth-rate error than the vehicle file as given: its numbers stay".into());
        self
    }
}
