//! The ordinary controller, called directly: only for comparison, so it has no
//! bytes and no image.

use super::{Seat, SeatError};
use control::{Config, stock};
use signals::{Answer, Manifest, Mission, Refusal, SensorFrame, Wings};

/// The ordinary controller.
#[derive(Default)]
pub struct Stock {
    config: Config,
    mission: Option<Mission>,
    state: Option<stock::State>,
}

impl Seat for Stock {
    fn hello(&mut self) -> Result<Manifest, SeatError> {
        Ok(Manifest { cycle_ms: (crate::seats::CYCLE_S * 1e3) as u32, hil: true, ..Manifest::default() })
    }

    fn configure(&mut self, _manifest: &Manifest, config: &Config) -> Result<(), SeatError> {
        self.config = config.clone();
        Ok(())
    }

    fn tabulate(&mut self, _wings: Wings, _table: &[u8]) -> Result<(), SeatError> {
        // It flies a preset pitch.
        Err(SeatError::Refused { asked: "the flight table", why: Refusal::NotNow })
    }

    fn recover(&mut self) -> Result<(), SeatError> {
        self.state = None;
        Ok(())
    }

    fn recall(&mut self) -> Result<(), SeatError> {
        // The ordinary controller of the comparison has no such order.
        Err(SeatError::Refused { asked: "the recall", why: Refusal::NotNow })
    }

    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        mission
            .validate(self.config.working_depth_m, self.config.pump_m3)
            .map_err(|why| SeatError::Refused { asked: "the mission", why: Refusal::Mission(why) })?;
        self.mission = Some(mission.clone());
        self.state = None;
        Ok(0)
    }

    fn exchange(&mut self, frame: &SensorFrame) -> Result<Answer, SeatError> {
        let Some(mission) = &self.mission else {
            return Err(SeatError::Refused { asked: "a sensor frame", why: Refusal::NotNow });
        };
        let state = self.state.get_or_insert_with(|| stock::State::new(&self.config, mission.clone(), frame.time));
        Ok(stock::step(&self.config, state, frame.time, frame))
    }

    fn reset(&mut self) -> Result<(), SeatError> {
        Err(SeatError::NoReset { seat: self.describe() })
    }

    fn describe(&self) -> String {
        "ordinary controller (stock), called directly".to_owned()
    }
}
