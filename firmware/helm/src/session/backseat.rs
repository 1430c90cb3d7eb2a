//! A mission of the glider whose backseat the board is: no message of our line begins it.

use super::Helm;
use crate::mark::Seat;
use crate::objects;
use crate::storage::{Content, Storage};
use control::{Config, Settings};
use evidence::History;
use signals::surfacing::OfGlides;
use signals::{Mission, Object, Phase, Refusal};

impl<S: Storage> Helm<S> {
    /// The configuration that the next mission is flown with.
    #[inline(never)]
    pub fn next_config(&mut self) -> Config {
        objects::select_config(&mut self.storage, &self.built_in)
    }

    /// What the glides since the last call say, for a report of the surfacing; none where they say too little.
    #[inline(never)]
    pub fn said_of_glides(&mut self) -> Option<OfGlides> {
        let mut bytes = Content::new();
        let history = if self.storage.load(Object::History, &mut bytes) { History::decode(&bytes) } else { None };
        self.glides.said(history.as_ref())
    }

    /// Takes the stored mission, flown `within` what the vehicle says of its actuators; it starts with the next frame. Returns its
    /// deepest depth, m. One that a reset interrupted goes on in SAFE.
    ///
    /// # Errors
    /// [`Refusal::NoMission`]: none is stored. [`Refusal::NotNow`]: one was flown since the board started. [`Refusal::OnTrial`]: the image. Else what cannot be flown.
    pub fn begin_backseat(&mut self, within: impl FnOnce(&Settings) -> Settings) -> Result<f32, Refusal> {
        self.sealed(|helm| helm.arm_stored(within))
    }

    #[inline(never)]
    fn arm_stored(&mut self, within: impl FnOnce(&Settings) -> Settings) -> Result<f32, Refusal> {
        let mut bytes = Content::new();
        let stored = if self.storage.load(Object::Mission, &mut bytes) { objects::mission(&bytes) } else { None };
        match self.flight.phase() {
            Some(Phase::Done) => return Err(Refusal::NotNow),
            Some(_) => return Ok(stored.as_ref().map_or(0.0, Mission::deepest_m)),
            None => {}
        }
        let mut mission = stored.ok_or(Refusal::NoMission)?;
        self.tried()?;
        self.abandon();
        let config = Config::new(within(self.next_config().settings())).map_err(|_| Refusal::Corrupt)?;
        for leg in &mut mission.legs {
            leg.ballast_m3 = leg.ballast_m3.min(config.pump_m3);
        }
        mission.validate(config.working_depth_m, config.pump_m3).map_err(Refusal::Mission)?;
        let deepest = mission.deepest_m();
        self.flight.arm(mission, config, Seat::Backseat, &mut self.storage);
        Ok(deepest)
    }
}
