@ Copying and clearing memory: Run-time ABI for the Arm architecture, 4.3.4 and 4.3.5. The compiler's own, made for
@ speed on large pieces, take 1.4 kB of flash; these take 0.1 kB, and no longer for the few words that are copied here.
@ A Cortex-M4 loads and stores single words at any address.
    .syntax unified
    .thumb

    .section .text.memory_copy, "ax", %progbits
    .p2align 2
    .global __aeabi_memcpy4, __aeabi_memcpy8, __aeabi_memcpy
    .type __aeabi_memcpy4, %function
    .type __aeabi_memcpy8, %function
    .type __aeabi_memcpy, %function
@ r0 to, r1 from, r2 bytes
__aeabi_memcpy4:
__aeabi_memcpy8:
__aeabi_memcpy:
    subs    r2, #4
    blo     2f
1:  ldr     r3, [r1], #4
    str     r3, [r0], #4
    subs    r2, #4
    bhs     1b
2:  adds    r2, #4
    beq     4f
3:  ldrb    r3, [r1], #1
    strb    r3, [r0], #1
    subs    r2, #1
    bne     3b
4:  bx      lr
    .size __aeabi_memcpy4, . - __aeabi_memcpy4
    .size __aeabi_memcpy8, . - __aeabi_memcpy8
    .size __aeabi_memcpy, . - __aeabi_memcpy

    .section .text.memory_set, "ax", %progbits
    .p2align 2
    .global __aeabi_memclr4, __aeabi_memclr8, __aeabi_memclr
    .global __aeabi_memset4, __aeabi_memset8, __aeabi_memset
    .type __aeabi_memclr4, %function
    .type __aeabi_memclr8, %function
    .type __aeabi_memclr, %function
    .type __aeabi_memset4, %function
    .type __aeabi_memset8, %function
    .type __aeabi_memset, %function
@ r0 to, r1 bytes
__aeabi_memclr4:
__aeabi_memclr8:
__aeabi_memclr:
    movs    r2, #0
@ and r2 what with
__aeabi_memset4:
__aeabi_memset8:
__aeabi_memset:
    uxtb    r2, r2
    orr     r2, r2, r2, lsl #8
    orr     r2, r2, r2, lsl #16
    subs    r1, #4
    blo     2f
1:  str     r2, [r0], #4
    subs    r1, #4
    bhs     1b
2:  adds    r1, #4
    beq     4f
3:  strb    r2, [r0], #1
    subs    r1, #1
    bne     3b
4:  bx      lr
    .size __aeabi_memclr4, . - __aeabi_memclr4
    .size __aeabi_memclr8, . - __aeabi_memclr8
    .size __aeabi_memclr, . - __aeabi_memclr
    .size __aeabi_memset4, . - __aeabi_memset4
    .size __aeabi_memset8, . - __aeabi_memset8
    .size __aeabi_memset, . - __aeabi_memset
