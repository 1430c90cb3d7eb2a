//! Where a hard fault lands.
//!
//! It may be a stack that has left its RAM: then nothing can be pushed, and the
//! handler begins with a fresh stack before it calls `after_fault`, which the
//! program that links this provides.

core::arch::global_asm!(
    ".section .HardFault.user,\"ax\",%progbits",
    ".global HardFault",
    ".type HardFault,%function",
    ".thumb_func",
    "HardFault:",
    "ldr r0, =_stack_start",
    "msr msp, r0",
    "b after_fault",
    ".pool",
    ".size HardFault, . - HardFault",
    ".previous",
);
