//! Tests of several crates together, as one program.

mod architecture;
#[cfg(feature = "whole")]
mod bit_flips;
#[cfg(feature = "whole")]
mod board_time;
mod circles;
#[cfg(feature = "whole")]
mod closed_loop;
mod contributing;
#[cfg(feature = "whole")]
mod fault_campaign;
mod folders;
#[cfg(feature = "whole")]
mod hil_autopsy;
#[cfg(feature = "whole")]
mod hil_backseat;
#[cfg(feature = "whole")]
mod hil_bad_input;
#[cfg(feature = "whole")]
mod hil_bit_flips;
#[cfg(feature = "whole")]
mod hil_board;
#[cfg(feature = "whole")]
mod hil_faults;
#[cfg(feature = "whole")]
mod hil_monitor_upload;
#[cfg(feature = "whole")]
mod hil_replay;
#[cfg(feature = "whole")]
mod hil_same_flight;
#[cfg(feature = "whole")]
mod hil_seats;
#[cfg(feature = "whole")]
mod image_update;
#[cfg(feature = "whole")]
mod launch;
#[cfg(feature = "whole")]
mod margins;
#[cfg(feature = "whole")]
mod on_board_summary;
#[cfg(feature = "whole")]
mod own_parts;
#[cfg(feature = "whole")]
mod own_radio;
#[cfg(feature = "whole")]
mod pages;
mod pages_dropped_logs;
#[cfg(feature = "whole")]
mod power;
#[cfg(feature = "whole")]
mod qemu_line;
#[cfg(feature = "whole")]
mod scorecard_flight;
#[cfg(feature = "whole")]
mod workbench_server;
