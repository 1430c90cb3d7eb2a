//! Where a hard fault lands.
//!
//! It may be a stack that has left its RAM: then nothing can be pushed, and the
//! handler begins with a fresh stack before it calls `after_fault`, which the
//! program that links this provides: `after_fault(sp, lr, pc, xpsr)` with the
//! stack pointer at the fault and of its frame (Armv7-M ARM B1.5.6) what came
//! to lie inside the stack's RAM, else 0. It is read before the fresh stack
//! can overwrite it.

core::arch::global_asm!(
    ".section .HardFault.user,\"ax\",%progbits",
    ".global HardFault",
    ".type HardFault,%function",
    ".thumb_func",
    "HardFault:",
    "mrs r0, msp",
    "movs r1, #0",
    "movs r2, #0",
    "movs r3, #0",
    "ldr r4, =_stack_end",
    "ldr r5, =_stack_start",
    "cmp r0, r4",
    "blo 1f",
    "sub r4, r5, #32",
    "cmp r0, r4",
    "bhi 1f",
    "ldr r1, [r0, #20]",
    "ldr r2, [r0, #24]",
    "ldr r3, [r0, #28]",
    "1:",
    "msr msp, r5",
    "b after_fault",
    ".pool",
    ".size HardFault, . - HardFault",
    ".previous",
);
