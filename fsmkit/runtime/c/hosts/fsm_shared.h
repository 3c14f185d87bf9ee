/* fsm_shared.h: a counter that one context writes and others read: interrupts, threads, cores.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * What was written before fsm_shared_write is seen by whoever reads the new value with
 * fsm_shared_read (release and acquire, C11 7.17.3); fsm_shared_own reads what only the caller
 * writes. By the first of these that applies:
 *
 *   FSM_BARRIER()  you defined it: a full memory barrier, or one for the compiler where only
 *                  interrupts on the same single core come in between. For compilers that know
 *                  neither of the following, e.g. -D'FSM_BARRIER()=__dmb(0xF)'.
 *   C11            <stdatomic.h>
 *   gcc, clang     their __atomic functions, in C99 and in C++
 *
 * FSM_INDEX is an unsigned type that the processor reads and writes in one instruction: uint32_t
 * unless you say otherwise; uint8_t on an 8-bit processor. */
#ifndef FSM_SHARED_H
#define FSM_SHARED_H

#include <stdint.h>

#ifndef FSM_INDEX
#define FSM_INDEX uint32_t
#endif

#if defined(FSM_BARRIER)

typedef volatile FSM_INDEX fsm_shared;

static inline FSM_INDEX fsm_shared_read(const fsm_shared *from)
{
    FSM_INDEX value = *from;
    FSM_BARRIER();
    return value;
}

static inline void fsm_shared_write(fsm_shared *to, FSM_INDEX value)
{
    FSM_BARRIER();
    *to = value;
}

static inline FSM_INDEX fsm_shared_own(const fsm_shared *from)
{
    return *from;
}

#elif !defined(__cplusplus) && defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L &&         \
    !defined(__STDC_NO_ATOMICS__)

#include <stdatomic.h>

typedef _Atomic(FSM_INDEX) fsm_shared;

static inline FSM_INDEX fsm_shared_read(const fsm_shared *from)
{
    return atomic_load_explicit(from, memory_order_acquire);
}

static inline void fsm_shared_write(fsm_shared *to, FSM_INDEX value)
{
    atomic_store_explicit(to, value, memory_order_release);
}

static inline FSM_INDEX fsm_shared_own(const fsm_shared *from)
{
    return atomic_load_explicit(from, memory_order_relaxed);
}

#elif defined(__GNUC__)

typedef FSM_INDEX fsm_shared;

static inline FSM_INDEX fsm_shared_read(const fsm_shared *from)
{
    return __atomic_load_n(from, __ATOMIC_ACQUIRE);
}

static inline void fsm_shared_write(fsm_shared *to, FSM_INDEX value)
{
    __atomic_store_n(to, value, __ATOMIC_RELEASE);
}

static inline FSM_INDEX fsm_shared_own(const fsm_shared *from)
{
    return __atomic_load_n(from, __ATOMIC_RELAXED);
}

#else
#error "define FSM_BARRIER(): this compiler has no atomics that are known here"
#endif

#endif
