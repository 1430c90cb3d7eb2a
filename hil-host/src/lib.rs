//! What talks to people: commands, pages, scorecards, reports. What flies on a laptop is [`rig`], what decides is [`discovery`].
//!
//! # Dependencies
//!
//! * `clap`, `clap_complete`: the command line
//! * `comfy-table`, `console`, `indicatif`: tables, colours and progress in a terminal
//! * `plotters`: figures as SVG
//! * `resvg`, `ttf-noto-sans`, `svg2pdf`: the same as PNG and PDF
//! * `axum`, `hyper`, `hyper-util`, `tokio`, `tokio-stream`: the page on this machine
//! * `base64`: files that a browser sends
//! * `getrandom`: its token
//! * `serialport`: a board's port
//! * `postcard`: bytes of an object for a board
//! * `rayon`: flights side by side
//! * `rand_chacha`, `rand_distr`: draws that a seed repeats
//! * `nalgebra`: linear algebra of a scorecard
//! * `sha2`: keys of a cache
//! * `serde`, `serde_json`, `toml`: documents
//! * `anyhow`: errors for a person

pub mod calls;
pub mod cli;
pub mod fleet;
pub mod next_mission;
pub mod packets;
pub mod pages;
pub mod paper;
pub mod score;
#[cfg(feature = "serve")]
pub mod serve;
pub mod terminal;
pub mod what_if;
