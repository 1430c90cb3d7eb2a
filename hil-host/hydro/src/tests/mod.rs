//! Tests of several files together, in the program of the unit tests.

mod delta_wings;
mod rectangular_plates;
mod side_edge_lattice;
