//! No answer is worse than its start: where a refit leaves a larger error than the vehicle file as given, the file's numbers stay.

use super::Diagnosis;
use crate::model::parameters::State;

impl Diagnosis {
    /// A refit that leaves more than the file as given, on fitted dives or on those kept out, is no recalibration: the file's numbers stay.
    pub(super) fn no_worse_than_the_file(mut self) -> Self {
        let rises = |[given, refitted, _]: [f64; 3]| given.is_finite() && !(refitted <= given);
        if !rises(self.fitted_error_m_s) && !rises(self.block_error_m_s) {
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
            (self.parts.moved, self.parts.worth) = (Vec::new(), None);
        }
        self.notes
            .push("a refit of the calibration leaves a larger depth-rate error than the vehicle file as given: its numbers stay".into());
        self
    }
}
