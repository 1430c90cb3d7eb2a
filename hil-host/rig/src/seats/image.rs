//! An image of the firmware on its way to a board: staged, started on trial, named, and the way back.

use super::Seat;
use super::error::SeatError;
use super::link::upload;
use super::link::{Link, Wire};
use signals::{Image, Object, Older, Refusal, Standing, ToBoard, ToHost};

/// Where an image stands, in words with what to do.
#[must_use]
pub fn words(image: &Image) -> String {
    let standing = match image.standing {
        Standing::Flashed => "flashed by a probe".to_owned(),
        Standing::Confirmed => "confirmed".to_owned(),
        Standing::Trial { boots_left } => format!(
            "ON TRIAL, {boots_left} more boots: fit the strap and fly it on the bench (glider fly --seat PORT); its first finished cycle confirms it"
        ),
        Standing::RolledBack => "back in place: the one after it was given up or taken back".to_owned(),
        Standing::Leaving => "another one takes its place at the next restart".to_owned(),
    };
    format!("{:08x}, {standing}", image.id)
}

/// Name of a standing, for a program.
#[must_use]
pub const fn name(image: &Image) -> &'static str {
    match image.standing {
        Standing::Flashed => "flashed",
        Standing::Confirmed => "confirmed",
        Standing::Trial { .. } => "trial",
        Standing::RolledBack => "rolled_back",
        Standing::Leaving => "leaving",
    }
}

/// The image that runs on a board.
///
/// # Errors
/// No answer; a controller that keeps no images.
pub fn running<W: Wire>(link: &mut Link<W>) -> Result<Image, SeatError> {
    link.hello()?.image.ok_or(SeatError::Refused { asked: "an image", why: Refusal::NoImages })
}

/// Stages an image; it is installed by [`restart`]. `progress` is told bytes sent.
///
/// # Errors
/// Line lost, or refused; what runs goes on.
pub fn stage<W: Wire>(link: &mut Link<W>, bytes: &[u8], older: Older, progress: impl FnMut(usize)) -> Result<(), SeatError> {
    upload::send(link, Object::Image(older), bytes, progress).map(drop)
}

/// Takes an installation back, or has the image before put back by [`restart`].
///
/// # Errors
/// As above.
pub fn go_back<W: Wire>(link: &mut Link<W>) -> Result<(), SeatError> {
    upload::rollback(link, Object::Image(Older::Refused)).map(drop)
}

/// Starts the board again, and says which image runs then. Asked for once: the board may be on its way before its answer is whole.
///
/// # Errors
/// Refused, or no answer after it.
pub fn restart<W: Wire>(link: &mut Link<W>) -> Result<Image, SeatError> {
    const WHAT: &str = "the restart";
    let said = link.once(WHAT, &ToBoard::Restart, |answer| match answer {
        ToHost::Done { .. } => Some(Ok(())),
        ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: WHAT, why })),
        _ => None,
    });
    match said {
        Ok(Err(refused)) => Err(refused),
        // An installation may take longer than a board is waited for: two images of 256 KiB are erased and copied.
        Ok(Ok(())) | Err(SeatError::NoAnswer { .. }) => running(link).or_else(|_| running(link)),
        Err(other) => Err(other),
    }
}
