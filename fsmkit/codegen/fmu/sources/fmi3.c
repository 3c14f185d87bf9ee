/* fmi3.c: the functions of FMI 3.0 for Co-Simulation.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#include "fmi3Functions.h"
#include "fmu.h"

#include <string.h>

#define REFERENCES fmi3Instance c, const fmi3ValueReference vr[], size_t n

static fmi3Status refuse(fmi3Instance c, const char *why)
{
    const fmu_instance *i = (const fmu_instance *)c;
    if (i != NULL && i->logger != NULL) {
        ((fmi3LogMessageCallback)i->logger)(i->environment, fmi3Error, "logStatusError", why);
    }
    return fmi3Error;
}

static fmi3Status status(fmi3Instance c)
{
    const char *trouble = fmu_trouble((const fmu_instance *)c);
    return trouble == NULL ? fmi3OK : refuse(c, trouble);
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean with_events, fmi3Boolean early, const fmi3ValueReference needed[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update)
{
    fmu_instance *i = NULL;
    const char *why = "the instantiation token is that of another FMU";
    (void)name, (void)path, (void)visible, (void)logging, (void)needed, (void)n, (void)update;
    if (token != NULL && strcmp(token, FMU_TOKEN) == 0) {
        i = fmu_take();
        why = "all instances are in use (FMU_INSTANCES)";
    }
    if (i == NULL) {
        if (logger != NULL) {
            logger(environment, fmi3Error, "logStatusError", why);
        }
        return NULL;
    }
    i->with_events = with_events;
    i->returns_early = early;
    i->environment = environment;
    i->logger = (void (*)(void))logger;
    return i;
}

void fmi3FreeInstance(fmi3Instance c)
{
    if (c != NULL) {
        ((fmu_instance *)c)->is_taken = false;
    }
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    fmu_instance *i = (fmu_instance *)c;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    i->state.time = i->state.start = start;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    fmu_instance *i = (fmu_instance *)c;
    fmu_start(i);
    i->is_new = true;
    if (i->with_events) { /* initialization is followed by Event Mode */
        (void)fmu_next(i);
    }
    return status(c);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    fmu_instance *i = (fmu_instance *)c;
    i->is_new = true;
    (void)fmu_next(i);
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    fmu_reset((fmu_instance *)c);
    return fmi3OK;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    (void)c;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *ends,
                                    fmi3Boolean *nominals, fmi3Boolean *values,
                                    fmi3Boolean *has_next, fmi3Float64 *next)
{
    fmu_instance *i = (fmu_instance *)c;
    if (i->is_new) { /* once in a visit of Event Mode: events that never end must not hold it */
        fmu_run(i);
        i->is_new = false;
    }
    *again = fmu_next(i);
    *ends = *nominals = *values = *has_next = fmi3False;
    *next = 0.0;
    return status(c);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 from, fmi3Float64 size, fmi3Boolean keeps,
                      fmi3Boolean *needs_events, fmi3Boolean *ends, fmi3Boolean *early,
                      fmi3Float64 *reached)
{
    fmu_instance *i = (fmu_instance *)c;
    const double end = from + size;
    double due = 0.0;
    (void)keeps;
    *needs_events = *ends = *early = fmi3False;
    i->state.time = from;
    fmu_run(i);
    while (i->state.pending_count == 0u && fmu_is_due_within(i, end, &due)) {
        i->state.time = due;
        *needs_events = i->with_events;
        if (i->with_events && i->returns_early) {
            break;
        }
        fmu_run(i);
    }
    *needs_events = i->with_events && (*needs_events || i->state.pending_count > 0u);
    *early = *needs_events && i->returns_early && i->state.time < end;
    if (!*early) {
        i->state.time = end;
        if (!*needs_events || !i->returns_early) {
            fmu_run(i);
        }
    }
    if (!i->with_events) {
        while (fmu_next(i)) {
            continue;
        }
    }
    *reached = i->state.time;
    return status(c);
}

/* ---- values -------------------------------------------------------------------------------------- */

static bool is_as(fmi3ValueReference vr, fmu_representation as, fmu_representation other)
{
    return vr < FMU_COUNT && (fmu_rows[vr].as == as || fmu_rows[vr].as == other);
}

#define INTEGERS(Name, ctype, as, other)                                                           \
    fmi3Status fmi3Get##Name(REFERENCES, ctype values[], size_t count)                             \
    {                                                                                              \
        uint64_t bits = 0u;                                                                        \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (k >= count || !is_as(vr[k], as, other)                                             \
                || !fmu_get((const fmu_instance *)c, vr[k], &bits))                                \
                return refuse(c, "no such variable of this type");                                 \
            values[k] = (ctype)bits;                                                               \
        }                                                                                          \
        return fmi3OK;                                                                             \
    }                                                                                              \
    fmi3Status fmi3Set##Name(REFERENCES, const ctype values[], size_t count)                       \
    {                                                                                              \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (k >= count || !is_as(vr[k], as, other)                                             \
                || !fmu_set((fmu_instance *)c, vr[k], (uint64_t)values[k]))                        \
                return refuse(c, "no such input of this type, or a value out of its range");       \
        }                                                                                          \
        return fmi3OK;                                                                             \
    }

INTEGERS(Int8, fmi3Int8, FMU_AS_INT8, FMU_AS_INT8)
INTEGERS(UInt8, fmi3UInt8, FMU_AS_UINT8, FMU_AS_UINT8)
INTEGERS(Int16, fmi3Int16, FMU_AS_INT16, FMU_AS_INT16)
INTEGERS(UInt16, fmi3UInt16, FMU_AS_UINT16, FMU_AS_UINT16)
INTEGERS(Int32, fmi3Int32, FMU_AS_INT32, FMU_AS_INT32)
INTEGERS(UInt32, fmi3UInt32, FMU_AS_UINT32, FMU_AS_UINT32)
INTEGERS(Int64, fmi3Int64, FMU_AS_INT64, FMU_AS_ENUMERATION)
INTEGERS(UInt64, fmi3UInt64, FMU_AS_UINT64, FMU_AS_UINT64)
INTEGERS(Boolean, fmi3Boolean, FMU_AS_BOOLEAN, FMU_AS_BOOLEAN)

#define FLOATS(Name, ctype, as, wire)                                                              \
    fmi3Status fmi3Get##Name(REFERENCES, ctype values[], size_t count)                             \
    {                                                                                              \
        wire both;                                                                                 \
        uint64_t bits = 0u;                                                                        \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (k >= count || !is_as(vr[k], as, as)                                                \
                || !fmu_get((const fmu_instance *)c, vr[k], &bits))                                \
                return refuse(c, "no such variable of this type");                                 \
            memset(&both, 0, sizeof both);                                                         \
            fsm_store_bits(&both, sizeof both, bits);                                              \
            values[k] = both.value;                                                                \
        }                                                                                          \
        return fmi3OK;                                                                             \
    }                                                                                              \
    fmi3Status fmi3Set##Name(REFERENCES, const ctype values[], size_t count)                       \
    {                                                                                              \
        wire both;                                                                                 \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (k >= count || !is_as(vr[k], as, as))                                               \
                return refuse(c, "no such input of this type");                                    \
            both.value = values[k];                                                                \
            if (!fmu_set((fmu_instance *)c, vr[k], both.bits))                                     \
                return refuse(c, "not an input");                                                  \
        }                                                                                          \
        return fmi3OK;                                                                             \
    }

FLOATS(Float32, fmi3Float32, FMU_AS_FLOAT32, fsm_float_bits)
FLOATS(Float64, fmi3Float64, FMU_AS_FLOAT64, fsm_double_bits)

fmi3Status fmi3GetClock(REFERENCES, fmi3Clock values[])
{
    uint64_t bits = 0u;
    for (size_t k = 0u; k < n; k++) {
        if (!is_as(vr[k], FMU_AS_CLOCK, FMU_AS_CLOCK)
            || !fmu_get((const fmu_instance *)c, vr[k], &bits)) {
            return refuse(c, "no such Clock");
        }
        values[k] = bits != 0u;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(REFERENCES, const fmi3Clock values[])
{
    for (size_t k = 0u; k < n; k++) {
        if (!is_as(vr[k], FMU_AS_CLOCK, FMU_AS_CLOCK)) {
            return refuse(c, "no such Clock");
        }
        if (fmu_rows[vr[k]].source == FMU_DEADLINE) {
            continue; /* time alone fires timers */
        }
        if (!fmu_set((fmu_instance *)c, vr[k], values[k] ? 1u : 0u)) {
            return refuse(c, "not an input Clock");
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(REFERENCES, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[])
{
    const fmu_instance *i = (const fmu_instance *)c;
    double due = 0.0;
    for (size_t k = 0u; k < n; k++) {
        if (vr[k] >= FMU_COUNT || fmu_rows[vr[k]].source != FMU_DEADLINE) {
            return refuse(c, "no Clock with an interval");
        }
        qualifiers[k] = fmu_deadline(i, &due) ? fmi3IntervalChanged : fmi3IntervalNotYetKnown;
        intervals[k] = qualifiers[k] == fmi3IntervalChanged ? due - i->state.time : 0.0;
    }
    return fmi3OK;
}

fmi3Status fmi3GetString(REFERENCES, fmi3String values[], size_t count)
{
    (void)vr, (void)values, (void)count;
    return n == 0u ? fmi3OK : refuse(c, "there is no String");
}

fmi3Status fmi3SetString(REFERENCES, const fmi3String values[], size_t count)
{
    (void)vr, (void)values, (void)count;
    return n == 0u ? fmi3OK : refuse(c, "there is no String");
}

/* ---- states -------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    fmu_copy *copy = fmu_save((const fmu_instance *)c, (fmu_copy *)*state);
    if (copy == NULL) {
        return refuse(c, "all saved states are in use (FMU_STATES)");
    }
    *state = copy;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    ((fmu_instance *)c)->state = ((const fmu_copy *)state)->state;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    if (*state != NULL) {
        ((fmu_copy *)*state)->is_taken = false;
    }
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c, (void)state;
    *size = FMU_SAVED_BYTES;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    if (size < FMU_SAVED_BYTES) {
        return refuse(c, "too few bytes for a state");
    }
    fmu_export(&((const fmu_copy *)state)->state, bytes);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    fmu_copy *copy = fmu_save(NULL, (fmu_copy *)*state);
    if (copy == NULL) {
        return refuse(c, "all saved states are in use (FMU_STATES)");
    }
    if (!fmu_import(&copy->state, bytes, size)) {
        copy->is_taken = *state != NULL;
        return refuse(c, "the state is damaged, or that of another FMU");
    }
    *state = copy;
    return fmi3OK;
}

/* ---- what Co-Simulation of discrete variables has no use for: FMI 3.0, 2.2 ------------------------ */

#define UNUSED_OF_CLOCKS(Name, one, other)                                                         \
    fmi3Status fmi3##Name(REFERENCES, one, other)                                                  \
    {                                                                                              \
        (void)vr, (void)n, (void)first, (void)second;                                              \
        return refuse(c, "no Clock is periodic or has a fraction");                                \
    }

UNUSED_OF_CLOCKS(SetIntervalFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])
UNUSED_OF_CLOCKS(GetShiftFraction, fmi3UInt64 first[], fmi3UInt64 second[])
UNUSED_OF_CLOCKS(SetShiftFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])

fmi3Status fmi3GetIntervalFraction(REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
    (void)vr, (void)n, (void)counters, (void)resolutions, (void)qualifiers;
    return refuse(c, "intervals are decimal");
}

fmi3Status fmi3SetIntervalDecimal(REFERENCES, const fmi3Float64 intervals[])
{
    (void)vr, (void)n, (void)intervals;
    return refuse(c, "the machine sets the interval of its Clock");
}

fmi3Status fmi3GetShiftDecimal(REFERENCES, fmi3Float64 shifts[])
{
    (void)vr, (void)n, (void)shifts;
    return refuse(c, "no Clock is periodic");
}

fmi3Status fmi3SetShiftDecimal(REFERENCES, const fmi3Float64 shifts[])
{
    (void)vr, (void)n, (void)shifts;
    return refuse(c, "no Clock is periodic");
}

fmi3Status fmi3GetBinary(REFERENCES, size_t sizes[], fmi3Binary values[], size_t count)
{
    (void)vr, (void)sizes, (void)values, (void)count;
    return n == 0u ? fmi3OK : refuse(c, "there is no Binary");
}

fmi3Status fmi3SetBinary(REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t count)
{
    (void)vr, (void)sizes, (void)values, (void)count;
    return n == 0u ? fmi3OK : refuse(c, "there is no Binary");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *count)
{
    (void)vr, (void)count;
    return refuse(c, "dependencies are in modelDescription.xml");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t elements[],
                                       fmi3ValueReference others[], size_t other_elements[],
                                       fmi3DependencyKind kinds[], size_t count)
{
    (void)vr, (void)elements, (void)others, (void)other_elements, (void)kinds, (void)count;
    return refuse(c, "dependencies are in modelDescription.xml");
}

#define NO_DERIVATIVE(Name)                                                                        \
    fmi3Status fmi3##Name(REFERENCES, const fmi3ValueReference known[], size_t known_count,        \
                          const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[],  \
                          size_t count)                                                            \
    {                                                                                              \
        (void)vr, (void)n, (void)known, (void)known_count, (void)seed, (void)seed_count;           \
        (void)sensitivity, (void)count;                                                            \
        return refuse(c, "variables have no derivatives");                                         \
    }

NO_DERIVATIVE(GetDirectionalDerivative)
NO_DERIVATIVE(GetAdjointDerivative)

fmi3Status fmi3GetOutputDerivatives(REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t count)
{
    (void)vr, (void)orders, (void)values, (void)count;
    return n == 0u ? fmi3OK : refuse(c, "outputs have no derivatives");
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)name, (void)token, (void)path, (void)visible, (void)logging;
    if (logger != NULL) {
        logger(environment, fmi3Error, "logStatusError", "this FMU is for Co-Simulation");
    }
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    (void)update, (void)lock, (void)unlock;
    return fmi3InstantiateModelExchange(name, token, path, visible, logging, environment, logger);
}

/* ---- of Model Exchange and Scheduled Execution: there, since importers load every function --------- */

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock, (void)time;
    return refuse(c, "this FMU is for Co-Simulation");
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return refuse(c, "this FMU is for Co-Simulation");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean keeps, fmi3Boolean *needs_events,
                                       fmi3Boolean *ends)
{
    (void)keeps, (void)needs_events, (void)ends;
    return refuse(c, "this FMU is for Co-Simulation");
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    (void)time;
    return refuse(c, "this FMU is for Co-Simulation");
}

#define CONTINUOUS(Name, ctype)                                                                    \
    fmi3Status fmi3##Name(fmi3Instance c, ctype values[], size_t count)                            \
    {                                                                                              \
        (void)values;                                                                              \
        return count == 0u ? fmi3OK : refuse(c, "there is nothing continuous");                    \
    }

CONTINUOUS(SetContinuousStates, const fmi3Float64)
CONTINUOUS(GetContinuousStates, fmi3Float64)
CONTINUOUS(GetContinuousStateDerivatives, fmi3Float64)
CONTINUOUS(GetNominalsOfContinuousStates, fmi3Float64)
CONTINUOUS(GetEventIndicators, fmi3Float64)

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    (void)c;
    *count = 0u;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    (void)c;
    *count = 0u;
    return fmi3OK;
}
