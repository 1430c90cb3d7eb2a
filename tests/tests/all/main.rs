//! Tests of several crates together, as one program.

mod architecture;
mod bit_flips;
mod board_time;
mod closed_loop;
mod contributing;
mod fault_campaign;
mod folders;
mod hil_autopsy;
mod hil_backseat;
mod hil_bad_input;
mod hil_bit_flips;
mod hil_board;
mod hil_faults;
mod hil_monitor_upload;
mod hil_same_flight;
mod hil_seats;
mod image_update;
mod launch;
mod margins;
mod own_parts;
mod own_radio;
mod pages;
mod power;
mod qemu_line;
mod scorecard_flight;
mod workbench_server;
