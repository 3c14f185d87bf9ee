/* fmi2.c: the functions of FMI 2.0 for Co-Simulation; an event is a counter.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#include "fmi2Functions.h"
#include "fmu.h"

#include <float.h>
#include <string.h>

#define REFERENCES fmi2Component c, const fmi2ValueReference vr[], size_t n

static fmi2Status refuse(fmi2Component c, const char *why)
{
    const fmu_instance *i = (const fmu_instance *)c;
    if (i != NULL && i->logger != NULL) {
        ((fmi2CallbackLogger)i->logger)(i->environment, FMU_IDENTIFIER, fmi2Error,
                                        "logStatusError", "%s", why);
    }
    return fmi2Error;
}

static fmi2Status status(fmi2Component c)
{
    const char *trouble = fmu_trouble((const fmu_instance *)c);
    return trouble == NULL ? fmi2OK : refuse(c, trouble);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String path,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    fmu_instance *i = NULL;
    (void)name, (void)path, (void)visible, (void)logging;
    if (type == fmi2CoSimulation && guid != NULL && strcmp(guid, FMU_TOKEN) == 0) {
        i = fmu_take();
    }
    if (i == NULL) {
        if (functions != NULL && functions->logger != NULL) {
            functions->logger(functions->componentEnvironment, FMU_IDENTIFIER, fmi2Error,
                              "logStatusError",
                              "not this FMU, or all instances are in use (FMU_INSTANCES)");
        }
        return NULL;
    }
    i->is_counting = true;
    if (functions != NULL) {
        i->environment = functions->componentEnvironment;
        i->logger = (void (*)(void))functions->logger;
    }
    return i;
}

void fmi2FreeInstance(fmi2Component c)
{
    if (c != NULL) {
        ((fmu_instance *)c)->is_taken = false;
    }
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    fmu_instance *i = (fmu_instance *)c;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    i->state.time = i->state.start = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    fmu_instance *i = (fmu_instance *)c;
    fmu_start(i);
    while (fmu_next(i)) {
        continue;
    }
    return status(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    fmu_reset((fmu_instance *)c);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real size, fmi2Boolean keeps)
{
    fmu_instance *i = (fmu_instance *)c;
    double due = 0.0;
    (void)keeps;
    i->state.time = from;
    fmu_run(i);
    while (fmu_next(i)) {
        continue;
    }
    while (fmu_trouble(i) == NULL && fmu_is_due_within(i, from + size, &due)) {
        i->state.time = due;
        fmu_run(i);
        while (fmu_next(i)) {
            continue;
        }
    }
    i->state.time = from + size;
    return status(c);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return refuse(c, "no step is pending");
}

/* ---- values -------------------------------------------------------------------------------------- */

static bool is_as(fmi2ValueReference vr, fmu_representation as, fmu_representation other)
{
    return vr < FMU_COUNT && (fmu_rows[vr].as == as || fmu_rows[vr].as == other);
}

#define INTEGERS(Name, ctype, as, other)                                                           \
    fmi2Status fmi2Get##Name(REFERENCES, ctype values[])                                           \
    {                                                                                              \
        uint64_t bits = 0u;                                                                        \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (!is_as(vr[k], as, other) || !fmu_get((const fmu_instance *)c, vr[k], &bits))       \
                return refuse(c, "no such variable of this type");                                 \
            values[k] = (ctype)bits;                                                               \
        }                                                                                          \
        return fmi2OK;                                                                             \
    }                                                                                              \
    fmi2Status fmi2Set##Name(REFERENCES, const ctype values[])                                     \
    {                                                                                              \
        for (size_t k = 0u; k < n; k++) {                                                          \
            if (!is_as(vr[k], as, other)                                                           \
                || !fmu_set((fmu_instance *)c, vr[k], (uint64_t)values[k]))                        \
                return refuse(c, "no such input of this type, or a value out of its range");       \
        }                                                                                          \
        return fmi2OK;                                                                             \
    }

INTEGERS(Integer, fmi2Integer, FMU_AS_INTEGER, FMU_AS_ENUMERATION)
INTEGERS(Boolean, fmi2Boolean, FMU_AS_BOOLEAN, FMU_AS_BOOLEAN)

/* A Real holds a float, or a whole number that no Integer of FMI 2.0 holds. */
fmi2Status fmi2GetReal(REFERENCES, fmi2Real values[])
{
    for (size_t k = 0u; k < n; k++) {
        uint32_t offset = 0u;
        uint64_t bits = 0u;
        const fsm_type *type;
        if (!is_as(vr[k], FMU_AS_REAL, FMU_AS_REAL)
            || !fmu_get((const fmu_instance *)c, vr[k], &bits)) {
            return refuse(c, "no such Real");
        }
        type = fmu_type(&fmu_rows[vr[k]], &offset);
        if (type == NULL || (type->kind == FSM_FLOAT && type->size == 8u)) {
            fsm_double_bits wide;
            wide.bits = bits;
            values[k] = wide.value;
        } else if (type->kind == FSM_FLOAT) {
            fsm_float_bits narrow;
            narrow.bits = (uint32_t)bits;
            values[k] = (double)narrow.value;
        } else {
            values[k] = fsm_is_signed(type) ? (double)(int64_t)bits : (double)bits;
        }
    }
    return fmi2OK;
}

/* Whether a float can hold a value: it is not finite, or within the range of floats. */
static bool is_float(double value)
{
    return (value >= -FLT_MAX && value <= FLT_MAX) || !(value >= -DBL_MAX && value <= DBL_MAX);
}

fmi2Status fmi2SetReal(REFERENCES, const fmi2Real values[])
{
    for (size_t k = 0u; k < n; k++) {
        uint32_t offset = 0u;
        uint64_t bits;
        bool is_whole = true;
        const fsm_type *type;
        if (!is_as(vr[k], FMU_AS_REAL, FMU_AS_REAL) || !fmu_rows[vr[k]].is_input) {
            return refuse(c, "no such Real that is an input");
        }
        type = fmu_type(&fmu_rows[vr[k]], &offset);
        if (type->kind == FSM_FLOAT && type->size == 8u) {
            fsm_double_bits wide;
            wide.value = values[k];
            bits = wide.bits;
        } else if (type->kind == FSM_FLOAT && is_float(values[k])) {
            fsm_float_bits narrow;
            narrow.value = (float)values[k];
            bits = narrow.bits;
        } else if (fsm_is_signed(type) && values[k] >= -0x1p63 && values[k] < 0x1p63) {
            bits = (uint64_t)(int64_t)values[k];
            is_whole = (double)(int64_t)values[k] == values[k];
        } else if (!fsm_is_signed(type) && values[k] >= 0.0 && values[k] < 0x1p64) {
            bits = (uint64_t)values[k];
            is_whole = (double)bits == values[k];
        } else {
            return refuse(c, "a value out of the range of its variable");
        }
        if (!is_whole || !fmu_set((fmu_instance *)c, vr[k], bits)) {
            return refuse(c, "a value out of the range of its variable");
        }
    }
    return fmi2OK;
}

fmi2Status fmi2GetString(REFERENCES, fmi2String values[])
{
    (void)vr, (void)values;
    return n == 0u ? fmi2OK : refuse(c, "there is no String");
}

fmi2Status fmi2SetString(REFERENCES, const fmi2String values[])
{
    (void)vr, (void)values;
    return n == 0u ? fmi2OK : refuse(c, "there is no String");
}

/* ---- states -------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    fmu_copy *copy = fmu_save((const fmu_instance *)c, (fmu_copy *)*state);
    if (copy == NULL) {
        return refuse(c, "all saved states are in use (FMU_STATES)");
    }
    *state = copy;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ((fmu_instance *)c)->state = ((const fmu_copy *)state)->state;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    if (*state != NULL) {
        ((fmu_copy *)*state)->is_taken = false;
    }
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = FMU_SAVED_BYTES;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < FMU_SAVED_BYTES) {
        return refuse(c, "too few bytes for a state");
    }
    fmu_export(&((const fmu_copy *)state)->state, (unsigned char *)bytes);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    fmu_copy *copy = fmu_save(NULL, (fmu_copy *)*state);
    if (copy == NULL) {
        return refuse(c, "all saved states are in use (FMU_STATES)");
    }
    if (!fmu_import(&copy->state, (const unsigned char *)bytes, size)) {
        copy->is_taken = *state != NULL;
        return refuse(c, "the state is damaged, or that of another FMU");
    }
    *state = copy;
    return fmi2OK;
}

/* ---- a step never pends, and nothing has a derivative: FMI 2.0.4, 4.2.2, 4.2.3 --------------------- */

#define STATUS(Name, ctype)                                                                        \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind kind, ctype *value)             \
    {                                                                                              \
        (void)kind, (void)value;                                                                   \
        return refuse(c, "no step is pending");                                                    \
    }

STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
STATUS(BooleanStatus, fmi2Boolean)
STATUS(StringStatus, fmi2String)

fmi2Status fmi2SetRealInputDerivatives(REFERENCES, const fmi2Integer orders[],
                                       const fmi2Real values[])
{
    (void)vr, (void)orders, (void)values;
    return n == 0u ? fmi2OK : refuse(c, "inputs have no derivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(REFERENCES, const fmi2Integer orders[], fmi2Real values[])
{
    (void)vr, (void)orders, (void)values;
    return n == 0u ? fmi2OK : refuse(c, "outputs have no derivatives");
}

fmi2Status fmi2GetDirectionalDerivative(REFERENCES, const fmi2ValueReference known[],
                                        size_t known_count, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    (void)vr, (void)n, (void)known, (void)known_count, (void)seed, (void)sensitivity;
    return refuse(c, "variables have no derivatives");
}
