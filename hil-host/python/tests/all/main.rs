//! Tests of the module of Python, as one program.

mod package;
