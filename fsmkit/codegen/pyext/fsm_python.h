/* fsm_python.h: the common part of machines in extension modules of CPython. Stable ABI of 3.11.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef FSM_PYTHON_H
#define FSM_PYTHON_H

#include "fsm_python_hooks.h"

#include <pyconfig.h>
#ifndef Py_GIL_DISABLED /* such builds have no stable ABI */
#define Py_LIMITED_API 0x030B0000
#endif
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__APPLE__) || defined(__FreeBSD__) /* there these save no mask of signals */
#define FSM_PY_SET _setjmp
#define FSM_PY_LEAVE _longjmp
#else
#define FSM_PY_SET setjmp
#define FSM_PY_LEAVE longjmp
#endif

enum { FSM_PY_STRINGS = 65535, FSM_PY_OPEN = -1, FSM_PY_CLOSE = -2 };

/* An event: the names of its fields in Python, and their names in messages. */
typedef struct {
    const char *const *fields;
    const char *const *said;
} fsm_py_event;

/* A class with its module as the first member, so a pointer to one converts to the other. */
typedef struct {
    PyModuleDef module;
    const char *type, *doc;  /* its name, with the module, and its docstring */
    const char *arguments;   /* of its construction, for PyArg_ParseTupleAndKeywords */
    const char *file;        /* the name of `python` in messages */
    const fsm_driver *driver;
    uint32_t saved_size; /* bytes; 0: it cannot be saved */
    bool calls;          /* a step can call Python code, which may raise or call the machine */
    bool replies;
    const fsm_py_machine *const *machines; /* those in its slots, each before its holder, then its own; NULL */
    const fsm_py_event *events;
    const char *const *host; /* the names of the host's methods */
    int host_count;
    PyMethodDef *methods;
    PyGetSetDef *attributes; /* variables in the order of the table, then others */
    const char *python;      /* definitions that are written in Python */
    uint32_t inputs_size;    /* bytes of the inputs that records remember */
    void (*restored)(void *m, uint32_t now); /* record all of a machine; NULL: it is not recorded */
} fsm_py_class;

/* The state of a module, separate in each interpreter. */
typedef struct {
    const fsm_py_class *of;
    PyObject *symbols; /* a list: strings by their numbers */
    PyObject *numbers; /* a dictionary: numbers by their strings */
    PyObject *states;  /* a dictionary: states by name */
    PyObject *events;  /* a dictionary: events by name */
    PyObject *names;   /* a tuple: names of states */
    PyObject *calls;   /* a tuple: names of the host's methods */
} fsm_py_module;

/* The common members at the start of every machine. */
typedef struct {
    PyObject_HEAD
    PyObject *module;
    fsm_py_module *known;
    const fsm_py_class *of; /* and its driver, and the table of its machine */
    const fsm_driver *driver;
    const fsm_machine_info *info;
    PyObject *host; /* NULL: the machine itself */
    PyObject *reply;
    PyObject *log;
    PyObject *trace;
    PyObject *parts; /* of a logged line: a list in a list for each open bracket */
    const char *fault;
    jmp_buf *leave; /* the exit of a step that the host aborted */
    uint32_t now;
    uint16_t peer;
    bool busy;
    bool is_reply;
    bool after_bracket;
    char pending[32];
    char *text; /* the current line of the trace */
    size_t length;
    size_t room;
#ifdef FSM_PY_RECORDED
    fsm_records_state recorder;
    PyObject *records;  /* a bytearray */
    size_t recorded;    /* bytes since the start of the call */
    bool has_kept;      /* the call has completed a step */
#endif
    uint64_t machine[]; /* then, where steps can be left, its copy from before the current step */
} fsm_object;

/* The object that contains a machine. */
static inline fsm_object *fsm_py_object(const fsm_py_machine *of, void *m)
{
    return (fsm_object *)(void *)((char *)m - of->offset - offsetof(fsm_object, machine));
}

static inline void *fsm_py_kept(fsm_object *o)
{
    return (char *)o->machine + o->info->size;
}

/* ---- records ---------------------------------------------------------------------------------
 * The current machine writes its records into its own bytes. Python code can step other machines, so
 * the current machine is set again after it. Records without room, because the bytes are exported or
 * memory is short, are counted as lost. */

#ifdef FSM_PY_RECORDED
static inline void fsm_py_at(fsm_object *o)
{
    fsm_py_records = &o->recorder;
}

static bool fsm_py_put_record(const uint8_t *bytes, unsigned n)
{
    fsm_object *o =
        (fsm_object *)(void *)((char *)fsm_py_records - offsetof(fsm_object, recorder));
    const Py_ssize_t size = o->records == NULL ? -1 : PyByteArray_Size(o->records);
    if (size < 0) {
        return false;
    }
    if (PyByteArray_Resize(o->records, size + (Py_ssize_t)n) != 0) {
        PyErr_Clear();
        return false;
    }
    memcpy(PyByteArray_AsString(o->records) + size, bytes, n);
    o->recorded += n;
    return true;
}

/* The records before a call that may be aborted. */
typedef struct {
    fsm_records_state state;
    Py_ssize_t size;
} fsm_py_mark;

static inline fsm_py_mark fsm_py_marked(fsm_object *o)
{
    const fsm_py_mark mark = {o->recorder, o->records == NULL ? 0 : PyByteArray_Size(o->records)};
    const uint32_t size = o->of->inputs_size;
    o->recorded = 0u;
    o->has_kept = false;
    if (size > 0u) {
        memcpy((char *)o->recorder.inputs + size, o->recorder.inputs, size);
    }
    return mark;
}

/* A call was aborted by an exception, so its records are dropped. If a step of it was completed, or
 * bytes were taken meanwhile, the whole machine is recorded. */
static inline void fsm_py_unrecord(fsm_object *o, const fsm_py_mark *mark, uint32_t now)
{
    PyObject *type, *value, *traceback;
    const uint32_t size = o->of->inputs_size;
    if (o->of->restored == NULL || o->records == NULL) {
        return;
    }
    PyErr_Fetch(&type, &value, &traceback);
    fsm_py_at(o);
    if (PyByteArray_Size(o->records) == mark->size + (Py_ssize_t)o->recorded
        && (o->recorded == 0u || PyByteArray_Resize(o->records, mark->size) == 0)) {
        o->recorder = mark->state;
        if (size > 0u) {
            memcpy(o->recorder.inputs, (char *)o->recorder.inputs + size, size);
        }
    } else {
        PyErr_Clear();
        o->recorder.call = mark->state.call;
        o->has_kept = true;
    }
    if (o->has_kept) {
        o->of->restored(o->machine, now);
    }
    PyErr_Restore(type, value, traceback);
}
#else
#define fsm_py_at(o) ((void)0)
#endif

/* ---- leaving a step ---------------------------------------------------------------------------
 * An exception cannot pass through the generated C, which holds nothing but its struct: the step is
 * left as it is, and the caller of the step restores the struct. */

FSM_PY_MAYBE void fsm_py_break(fsm_object *o)
{
    Py_CLEAR(o->parts);
    o->length = 0u;
    o->pending[0] = 0;
    FSM_PY_LEAVE(*o->leave, 1);
}

/* Work that may be left; false with an exception if it was. */
FSM_PY_MAYBE bool fsm_py_guarded(fsm_object *o, void (*work)(void *), void *job)
{
    jmp_buf leave;
    o->leave = &leave;
    o->busy = true;
    if (FSM_PY_SET(leave) != 0) {
        o->leave = NULL;
        o->busy = false;
        return false;
    }
    work(job);
    o->leave = NULL;
    o->busy = false;
    return true;
}

FSM_PY_MAYBE bool fsm_py_is_free(const fsm_object *o)
{
    if (o->busy) {
        PyErr_Format(PyExc_RuntimeError, "%s was called from within one of its own steps",
                     o->info->name);
    }
    return !o->busy;
}

FSM_PY_MAYBE PyObject *fsm_py_host(fsm_object *o)
{
    return o->host != NULL ? o->host : (PyObject *)o;
}

FSM_PY_MAYBE PyObject *fsm_py_method(fsm_object *o, Py_ssize_t number)
{
    return PyTuple_GetItem(o->known->calls, number);
}

FSM_PY_MAYBE PyObject *fsm_py_or_none(PyObject *value)
{
    PyObject *found = value == NULL ? Py_None : value;
    Py_INCREF(found);
    return found;
}

/* ---- values -------------------------------------------------------------------------------- */

FSM_PY_MAYBE bool fsm_py_outside(const char *what, PyObject *value, const fsm_type *type)
{
    if (type->kind == FSM_BOOL) {
        PyErr_Format(PyExc_ValueError, "%s must be in False..True, not %R", what, value);
    } else if (type->hi > INT64_MAX && !fsm_is_signed(type)) {
        PyErr_Format(PyExc_ValueError, "%s must be in %llu..%llu, not %R", what,
                     (unsigned long long)type->lo, (unsigned long long)type->hi, value);
    } else {
        PyErr_Format(PyExc_ValueError, "%s must be in %lld..%lld, not %R", what,
                     (long long)type->lo, (long long)type->hi, value);
    }
    return false;
}

FSM_PY_MAYBE bool fsm_py_wrong(const char *what, const char *wanted, PyObject *value)
{
    PyObject *type = PyObject_GetAttrString((PyObject *)Py_TYPE(value), "__name__");
    if (type != NULL) {
        PyErr_Format(PyExc_TypeError, "%s must be %s, not %S", what, wanted, type);
    }
    Py_XDECREF(type);
    return false;
}

FSM_PY_MAYBE PyObject *fsm_py_index(PyObject *value, const char *what)
{
    PyObject *index = PyNumber_Index(value);
    if (index == NULL && PyErr_ExceptionMatches(PyExc_TypeError)) {
        PyErr_Clear();
        (void)fsm_py_wrong(what, "an integer", value);
    }
    return index;
}

/* A whole number within the bounds of its type. */
FSM_PY_MAYBE bool fsm_py_integer(
    PyObject *value, const char *what, const fsm_type *type, uint64_t *out)
{
    int overflow = 0;
    PyObject *index = fsm_py_index(value, what);
    if (index == NULL) {
        return false;
    }
    if (type->kind == FSM_UNSIGNED && type->hi > INT64_MAX) {
        *out = PyLong_AsUnsignedLongLong(index);
        if (PyErr_Occurred() != NULL && PyErr_ExceptionMatches(PyExc_OverflowError)) {
            PyErr_Clear();
            overflow = 1;
        }
    } else {
        *out = (uint64_t)PyLong_AsLongLongAndOverflow(index, &overflow);
        if (!fsm_is_signed(type) && *out > INT64_MAX && PyErr_Occurred() == NULL) {
            overflow = -1;
        }
    }
    Py_DECREF(index);
    if (PyErr_Occurred() != NULL) {
        return false;
    }
    return (overflow == 0 && fsm_is_of(type, *out)) || fsm_py_outside(what, value, type);
}

FSM_PY_MAYBE bool fsm_py_double(PyObject *value, const char *what, double *out)
{
    double taken = PyFloat_AsDouble(value);
    if (PyErr_Occurred() != NULL) {
        if (PyErr_ExceptionMatches(PyExc_TypeError)) {
            PyErr_Clear();
            return fsm_py_wrong(what, "a number", value);
        }
        return false;
    }
    *out = taken;
    return true;
}

/* The number of a string; one that the chart does not know gets the next. */
FSM_PY_MAYBE bool fsm_py_symbol(fsm_object *o, PyObject *value, const char *what, uint16_t *out)
{
    fsm_py_module *known = o->known;
    if (!PyUnicode_Check(value)) {
        return fsm_py_wrong(what, "a string", value);
    }
    PyObject *found = PyDict_GetItemWithError(known->numbers, value);
    if (found != NULL) {
        *out = (uint16_t)PyLong_AsLong(found);
        return true;
    }
    Py_ssize_t next = PyList_Size(known->symbols);
    if (PyErr_Occurred() != NULL) {
        return false;
    }
    if (next > FSM_PY_STRINGS) {
        PyErr_Format(PyExc_ValueError, "%s: there are over %d different strings", what,
                     (int)FSM_PY_STRINGS);
        return false;
    }
    PyObject *number = PyLong_FromSsize_t(next);
    bool is_known = number != NULL && PyList_Append(known->symbols, value) == 0;
    if (is_known && PyDict_SetItem(known->numbers, value, number) != 0) {
        (void)PyList_SetSlice(known->symbols, next, next + 1, NULL);
        is_known = false;
    }
    Py_XDECREF(number);
    *out = (uint16_t)next;
    return is_known;
}

FSM_PY_MAYBE PyObject *fsm_py_string(const fsm_object *o, uint16_t number)
{
    PyObject *text = PyList_GetItem(o->known->symbols, number);
    Py_XINCREF(text);
    return text;
}

/* Whether a value has as many parts as an array or a record. */
FSM_PY_MAYBE bool fsm_py_parts(PyObject *value, const char *what, Py_ssize_t wanted)
{
    if (!PySequence_Check(value) || PyUnicode_Check(value) || PyBytes_Check(value)) {
        return fsm_py_wrong(what, "a sequence", value);
    }
    Py_ssize_t count = PySequence_Size(value);
    if (count >= 0 && count != wanted) {
        PyErr_Format(PyExc_ValueError, "%s must have %zd parts, not %zd", what, wanted, count);
    }
    return count == wanted;
}

/* Store the next part in a tuple. Return false and drop the tuple if the part is NULL. */
FSM_PY_MAYBE bool fsm_py_put(PyObject **parts, Py_ssize_t place, PyObject *part)
{
    if (*parts != NULL && part != NULL && PyTuple_SetItem(*parts, place, part) == 0) {
        return true; /* SetItem takes the part over, even when it fails */
    }
    if (*parts == NULL) {
        Py_XDECREF(part);
    }
    Py_CLEAR(*parts);
    return false;
}

/* Read an object of Python into a value of a type; false with what is wrong with it. Arrays and
 * records are sequences, members of enumerations integers. */
FSM_PY_MAYBE bool fsm_py_take(
    fsm_object *o, const fsm_type *type, PyObject *value, const char *what, void *out)
{
    double real = 0.0;
    uint16_t symbol = 0u;
    uint64_t bits = 0u;
    switch (type->kind) {
        case FSM_SYMBOL:
            if (!fsm_py_symbol(o, value, what, &symbol)) {
                return false;
            }
            fsm_set_bits(type, out, symbol);
            return true;
        case FSM_FLOAT:
            if (!fsm_py_double(value, what, &real)) {
                return false;
            }
            fsm_set_float(type, out, real);
            return true;
        case FSM_ARRAY:
        case FSM_RECORD:
            if (!fsm_py_parts(value, what, (Py_ssize_t)type->count)) {
                return false;
            }
            for (uint32_t i = 0u; i < type->count; i++) {
                const bool is_array = type->kind == FSM_ARRAY;
                const fsm_type *of = is_array ? type->element : type->fields[i].type;
                const uint32_t offset = is_array ? i * of->size : type->fields[i].offset;
                PyObject *part = PySequence_GetItem(value, (Py_ssize_t)i);
                bool is_taken =
                    part != NULL && fsm_py_take(o, of, part, what, fsm_place_at(out, offset));
                Py_XDECREF(part);
                if (!is_taken) {
                    return false;
                }
            }
            return true;
        default:
            if (!fsm_py_integer(value, what, type, &bits)) {
                return false;
            }
            fsm_set_bits(type, out, bits);
            return true;
    }
}

/* The object of a value: a new reference, NULL with an exception. */
FSM_PY_MAYBE PyObject *fsm_py_give(const fsm_object *o, const fsm_type *type, const void *value)
{
    PyObject *parts = NULL;
    switch (type->kind) {
        case FSM_BOOL:
            return PyBool_FromLong((long)fsm_bits_at(type, value));
        case FSM_SYMBOL:
            return fsm_py_string(o, (uint16_t)fsm_bits_at(type, value));
        case FSM_FLOAT:
            return PyFloat_FromDouble(fsm_float_at(type, value));
        case FSM_ARRAY:
        case FSM_RECORD:
            parts = PyTuple_New((Py_ssize_t)type->count);
            for (uint32_t i = 0u; i < type->count; i++) {
                const bool is_array = type->kind == FSM_ARRAY;
                const fsm_type *of = is_array ? type->element : type->fields[i].type;
                const uint32_t offset = is_array ? i * of->size : type->fields[i].offset;
                PyObject *part = fsm_py_give(o, of, fsm_at(value, offset));
                if (!fsm_py_put(&parts, (Py_ssize_t)i, part)) {
                    return NULL;
                }
            }
            return parts;
        case FSM_SIGNED:
            return PyLong_FromLongLong((long long)fsm_bits_at(type, value));
        default:
            return PyLong_FromUnsignedLongLong(fsm_bits_at(type, value));
    }
}

/* Give a variable of a machine a value, or leave it as it is. */
FSM_PY_MAYBE int fsm_py_assign(
    fsm_object *o, const fsm_type *type, PyObject *value, const char *what, void *place)
{
    double small[2] = {0.0, 0.0};
    void *taken = type->size <= sizeof small ? small : PyMem_Malloc(type->size);
    bool is_taken = taken != NULL;
    if (!is_taken) {
        PyErr_NoMemory();
    }
    is_taken = is_taken && fsm_py_take(o, type, value, what, taken);
    if (is_taken) {
        memcpy(place, taken, type->size);
    }
    if (taken != small) {
        PyMem_Free(taken);
    }
    return is_taken ? 0 : -1;
}

/* Read the payload of an event; false with an exception. */
FSM_PY_MAYBE bool fsm_py_fill(
    fsm_object *o, Py_ssize_t index, void *e, PyObject *const *values)
{
    const fsm_machine_info *info = o->info;
    const fsm_py_event *events = o->of->events;
    const fsm_event_info *event = &info->events[index];
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, (uint64_t)index + 1u);
    for (uint16_t i = 0u; i < event->field_count; i++) {
        void *place = fsm_place_at(e, event->fields[i].offset);
        if (!fsm_py_take(o, event->fields[i].type, values[i], events[index].said[i], place)) {
            return false;
        }
    }
    return true;
}

FSM_PY_MAYBE bool fsm_py_time(PyObject *value, uint32_t *out)
{
    PyObject *index = fsm_py_index(value, "a time");
    if (index == NULL) {
        return false;
    }
    unsigned long long taken = PyLong_AsUnsignedLongLongMask(index);
    Py_DECREF(index);
    if (PyErr_Occurred() != NULL) {
        return false;
    }
    *out = (uint32_t)(taken & 0xFFFFFFFFu);
    return true;
}

FSM_PY_MAYBE PyObject *fsm_py_bool_of(bool value)
{
    return PyBool_FromLong(value);
}

/* ---- arguments ----------------------------------------------------------------------------- */

/* Arguments by position and name, in the order of the names; missing ones are NULL. */
FSM_PY_MAYBE bool fsm_py_arguments(
    const char *name, const char *const *names, Py_ssize_t count, PyObject *const *given,
    Py_ssize_t positional, PyObject *keywords, PyObject **out)
{
    if (positional > count) {
        PyErr_Format(PyExc_TypeError, "%s() takes %zd arguments, not %zd", name, count, positional);
        return false;
    }
    for (Py_ssize_t i = 0; i < count; i++) {
        out[i] = i < positional ? given[i] : NULL;
    }
    Py_ssize_t others = keywords == NULL ? 0 : PyTuple_Size(keywords);
    for (Py_ssize_t k = 0; k < others; k++) {
        PyObject *keyword = PyTuple_GetItem(keywords, k);
        Py_ssize_t place = 0;
        while (place < count && PyUnicode_CompareWithASCIIString(keyword, names[place]) != 0) {
            place++;
        }
        if (place == count || out[place] != NULL) {
            PyErr_Format(PyExc_TypeError, "%s() got %s argument %R", name,
                         place == count ? "an unexpected" : "twice the", keyword);
            return false;
        }
        out[place] = given[positional + k];
    }
    return true;
}

FSM_PY_MAYBE bool fsm_py_all(
    const char *name, const char *const *names, Py_ssize_t count, PyObject *const *values)
{
    for (Py_ssize_t i = 0; i < count; i++) {
        if (values[i] == NULL) {
            PyErr_Format(PyExc_TypeError, "%s() lacks the argument '%s'", name, names[i]);
            return false;
        }
    }
    return true;
}

/* Return the event with a name and a number of fields, or -1 with an exception. */
FSM_PY_MAYBE Py_ssize_t fsm_py_named(const fsm_object *o, PyObject *event, Py_ssize_t count)
{
    const fsm_machine_info *info = o->info;
    PyObject *found = PyDict_GetItemWithError(o->known->events, event);
    if (found == NULL) {
        if (PyErr_Occurred() == NULL) {
            PyObject *separator = PyUnicode_FromString(", ");
            PyObject *all =
                separator == NULL ? NULL : PyUnicode_Join(separator, o->known->events);
            if (all != NULL) {
                PyErr_Format(PyExc_ValueError, "%s receives no event %R, but %U", info->name, event,
                             all);
            }
            Py_XDECREF(all);
            Py_XDECREF(separator);
        }
        return -1;
    }
    Py_ssize_t index = PyLong_AsSsize_t(found);
    if (index >= 0 && info->events[index].field_count != count) {
        PyErr_Format(PyExc_TypeError, "%s carries %zd values, not %zd",
                     info->events[index].name, (Py_ssize_t)info->events[index].field_count, count);
        return -1;
    }
    return index;
}

/* ---- values for the host ------------------------------------------------------------------- */

/* Start a line of values for `log`, or for the reply if the label is NULL. */
FSM_PY_MAYBE void fsm_py_begin(fsm_object *o, const char *label)
{
    Py_CLEAR(o->parts);
    o->is_reply = label == NULL;
    if (label != NULL && o->log == NULL) {
        return;
    }
    PyObject *values = PyList_New(0);
    PyObject *text = label == NULL ? NULL : PyUnicode_FromString(label);
    if (values != NULL && (label == NULL || (text != NULL && PyList_Append(values, text) == 0))) {
        o->parts = PyList_New(0);
        if (o->parts != NULL && PyList_Append(o->parts, values) != 0) {
            Py_CLEAR(o->parts);
        }
    }
    Py_XDECREF(text);
    Py_XDECREF(values);
    if (o->parts == NULL) {
        fsm_py_break(o);
    }
}

/* Add a value to it, which is taken over. */
FSM_PY_MAYBE void fsm_py_add(fsm_object *o, PyObject *value)
{
    Py_ssize_t depth = PyList_Size(o->parts);
    int failed = value == NULL ? -1 : PyList_Append(PyList_GetItem(o->parts, depth - 1), value);
    Py_XDECREF(value);
    if (failed != 0) {
        fsm_py_break(o);
    }
}

FSM_PY_MAYBE void fsm_py_bracket(fsm_object *o, bool opens)
{
    Py_ssize_t depth = PyList_Size(o->parts);
    if (opens) {
        PyObject *inner = PyList_New(0);
        int failed = inner == NULL ? -1 : PyList_Append(o->parts, inner);
        Py_XDECREF(inner);
        if (failed != 0) {
            fsm_py_break(o);
        }
    } else {
        PyObject *whole = PyList_AsTuple(PyList_GetItem(o->parts, depth - 1));
        if (whole == NULL || PyList_SetSlice(o->parts, depth - 1, depth, NULL) != 0) {
            Py_XDECREF(whole);
            fsm_py_break(o);
        }
        fsm_py_add(o, whole);
    }
}

/* Call a callback and drop its result; steals the references of its arguments. */
FSM_PY_MAYBE void fsm_py_tell(fsm_object *o, PyObject *callback, PyObject *arguments)
{
    PyObject *called = NULL;
    if (arguments != NULL) {
        Py_INCREF(callback); /* it may be replaced meanwhile */
        called = PyObject_Call(callback, arguments, NULL);
        Py_DECREF(callback);
        Py_DECREF(arguments);
    }
    if (called == NULL) {
        fsm_py_break(o);
    }
    Py_XDECREF(called);
}

FSM_PY_MAYBE void fsm_py_finish(fsm_object *o)
{
    if (o->parts == NULL) {
        return;
    }
    PyObject *values = PyList_AsTuple(PyList_GetItem(o->parts, 0));
    Py_CLEAR(o->parts);
    if (values == NULL) {
        fsm_py_break(o);
    }
    if (!o->is_reply) {
        if (o->log == NULL) {
            Py_XDECREF(values);
        } else {
            fsm_py_tell(o, o->log, values);
        }
        return;
    }
    PyObject *before = o->reply;
    o->reply = PyTuple_GetItem(values, 0);
    Py_XINCREF(o->reply);
    Py_XDECREF(before);
    Py_DECREF(values);
}

/* ---- the trace ----------------------------------------------------------------------------- */

FSM_PY_MAYBE void fsm_py_write(fsm_object *o, const char *text)
{
    size_t size = strlen(text);
    if (o->trace == NULL) {
        return;
    }
    if (o->length + size > o->room) {
        size_t room = 2u * (o->length + size) + 64u;
        char *larger = (char *)PyMem_Realloc(o->text, room);
        if (larger == NULL) {
            PyErr_NoMemory();
            fsm_py_break(o);
            return;
        }
        o->text = larger;
        o->room = room;
    }
    memcpy(o->text + o->length, text, size);
    o->length += size;
}

FSM_PY_MAYBE void fsm_py_line(fsm_object *o)
{
    if (o->trace == NULL) {
        o->length = 0u;
        return;
    }
    PyObject *line = PyUnicode_DecodeUTF8(o->text, (Py_ssize_t)o->length, "replace");
    o->length = 0u;
    PyObject *arguments = line == NULL ? NULL : PyTuple_New(1);
    if (arguments == NULL) {
        Py_XDECREF(line);
    } else {
        (void)PyTuple_SetItem(arguments, 0, line);
    }
    fsm_py_tell(o, o->trace, arguments);
}

/* Write the start of a line: its cause, unless that was written, and the slots. */
FSM_PY_MAYBE void fsm_py_begun(fsm_object *o, const char *path)
{
    if (o->pending[0] != 0) {
        char cause[sizeof o->pending];
        memcpy(cause, o->pending, sizeof cause);
        o->pending[0] = 0;
        fsm_py_write(o, cause);
        fsm_py_line(o);
    }
    fsm_py_write(o, path);
}

FSM_PY_MAYBE void fsm_py_whole(fsm_object *o, const char *path, const char *verb, const char *text)
{
    fsm_py_begun(o, path);
    fsm_py_write(o, verb);
    fsm_py_write(o, text);
    fsm_py_line(o);
}

FSM_PY_MAYBE void fsm_py_space(fsm_object *o)
{
    if (!o->after_bracket) {
        fsm_py_write(o, " ");
    }
    o->after_bracket = false;
}

FSM_PY_MAYBE void fsm_py_show_integer(fsm_object *o, bool negative, uint64_t value)
{
    char text[32];
    (void)PyOS_snprintf(text, sizeof text, negative ? "%lld" : "%llu", (long long)value);
    fsm_py_space(o);
    fsm_py_write(o, text);
}

FSM_PY_MAYBE void fsm_py_show_float(fsm_object *o, double value)
{
    char *text = PyOS_double_to_string(value, 'g', 17, 0, NULL);
    fsm_py_space(o);
    if (text == NULL) {
        PyErr_NoMemory();
        fsm_py_break(o);
        return;
    }
    fsm_py_write(o, text);
    PyMem_Free(text);
}

FSM_PY_MAYBE void fsm_py_show_string(fsm_object *o, uint16_t number, bool is_quoted)
{
    PyObject *bytes = PyUnicode_AsUTF8String(PyList_GetItem(o->known->symbols, number));
    fsm_py_space(o);
    if (bytes == NULL) { /* half a pair of surrogates */
        PyErr_Clear();
        fsm_py_write(o, "?");
        return;
    }
    if (is_quoted) {
        fsm_py_write(o, "\"");
    }
    fsm_py_write(o, PyBytes_AsString(bytes));
    if (is_quoted) {
        fsm_py_write(o, "\"");
    }
    Py_DECREF(bytes);
}

FSM_PY_MAYBE void fsm_py_show_bracket(fsm_object *o, bool opens)
{
    if (opens) {
        fsm_py_space(o);
    }
    fsm_py_write(o, opens ? "[" : "]");
    o->after_bracket = opens;
}

FSM_PY_MAYBE void fsm_py_show(fsm_object *o, const fsm_type *type, const void *value)
{
    const bool is_array = type->kind == FSM_ARRAY;
    if (is_array || type->kind == FSM_RECORD) {
        fsm_py_show_bracket(o, true);
        for (uint32_t i = 0u; i < type->count; i++) {
            const fsm_type *of = is_array ? type->element : type->fields[i].type;
            fsm_py_show(o, of, fsm_at(value, is_array ? i * of->size : type->fields[i].offset));
        }
        fsm_py_show_bracket(o, false);
    } else if (type->kind == FSM_FLOAT) {
        fsm_py_show_float(o, fsm_float_at(type, value));
    } else {
        const uint64_t bits = fsm_bits_at(type, value);
        if (type->kind == FSM_SYMBOL) {
            fsm_py_show_string(o, (uint16_t)bits, true);
        } else {
            fsm_py_show_integer(o, fsm_is_signed(type) && (int64_t)bits < 0, bits);
        }
    }
}

FSM_PY_MAYBE void fsm_py_show_event(fsm_object *o, const fsm_machine_info *info, const void *e)
{
    const fsm_event_info *event = &info->events[fsm_event_of(info, e) - 1u];
    fsm_py_write(o, event->name);
    for (uint16_t i = 0u; i < event->field_count; i++) {
        fsm_py_show(o, event->fields[i].type, fsm_at(e, event->fields[i].offset));
    }
}

/* Data and outputs, of the machines in slots that run too; `before`: of those around it. */
typedef struct fsm_py_path {
    const struct fsm_py_path *before;
    const char *slot;
} fsm_py_path;

FSM_PY_MAYBE void fsm_py_write_path(fsm_object *o, const fsm_py_path *path)
{
    if (path->before != NULL) {
        fsm_py_write_path(o, path->before);
        fsm_py_write(o, path->slot);
        fsm_py_write(o, ": ");
    }
}

FSM_PY_MAYBE void fsm_py_dump(
    fsm_object *o, const fsm_machine_info *info, const void *m, const fsm_py_path *path)
{
    for (uint32_t i = 0u; i < (uint32_t)info->data_count + info->output_count; i++) {
        fsm_py_begun(o, "");
        fsm_py_write_path(o, path);
        fsm_py_write(o, "d ");
        fsm_py_write(o, info->variables[i].name);
        fsm_py_show(o, info->variables[i].type, fsm_at(m, info->variables[i].offset));
        fsm_py_line(o);
    }
    for (uint32_t i = 0u; i < info->slot_count; i += 1u + info->slots[i].within) {
        const fsm_slot *slot = &info->slots[i];
        const fsm_py_path inner = {path, slot->name};
        if (fsm_is_running(slot->info, fsm_at(m, slot->offset))) {
            fsm_py_dump(o, slot->info, fsm_at(m, slot->offset), &inner);
        }
    }
}

/* ---- calling the host ------------------------------------------------------------------------ */

/* Call a method of the host; an exception or an invalid result aborts the step. */
FSM_PY_MAYBE void fsm_py_ask(
    fsm_object *o, const fsm_py_call *call, const fsm_field *fields, uint16_t count,
    const void *const *given, const fsm_type *type, void *result)
{
    enum { FEW = 6 };
    PyObject *few[FEW + 1] = {NULL};
    const Py_ssize_t passed = count + (call->has_peer ? 1 : 0);
    PyObject *many = passed > FEW ? PyTuple_New(passed) : NULL;
    PyObject *answer = NULL;
    bool is_fine = passed <= FEW || many != NULL;
    for (Py_ssize_t i = 0; i < passed && is_fine; i++) {
        PyObject *value = NULL;
        if (i < count) {
            value = fsm_py_give(o, fields[i].type, given[i]);
        } else {
            value = o->peer == 0u ? fsm_py_or_none(NULL) : fsm_py_string(o, o->peer);
        }
        is_fine = value != NULL;
        if (passed <= FEW) {
            few[i] = value;
        } else {
            is_fine = fsm_py_put(&many, i, value);
        }
    }
    PyObject *method = is_fine ? fsm_py_method(o, call->number) : NULL;
    if (is_fine && passed <= FEW) {
        answer = PyObject_CallMethodObjArgs(fsm_py_host(o), method, few[0], few[1], few[2], few[3],
                                            few[4], few[5], NULL);
    } else if (is_fine) {
        PyObject *bound = PyObject_GetAttr(fsm_py_host(o), method);
        answer = bound == NULL ? NULL : PyObject_CallObject(bound, many);
        Py_XDECREF(bound);
    }
    for (Py_ssize_t i = 0; i < passed && passed <= FEW; i++) {
        Py_XDECREF(few[i]);
    }
    Py_XDECREF(many);
    is_fine = answer != NULL && (type == NULL || fsm_py_take(o, type, answer, call->said, result));
    Py_XDECREF(answer);
    if (!is_fine) {
        fsm_py_break(o);
    }
}

FSM_PY_MAYBE void fsm_py_operate(
    const fsm_py_machine *of, void *m, uint32_t number, const void *const *given, void *result)
{
    fsm_object *o = fsm_py_object(of, m);
    const fsm_operation_info *is = &of->info->operations[number];
    if (is->result != NULL) {
        memset(result, 0, is->result->size);
    }
    if (of->operations[number].number < 0) {
        return;
    }
    fsm_py_ask(o, &of->operations[number], is->parameters, is->parameter_count, given, is->result,
               result);
    if (o->trace == NULL) {
        fsm_py_at(o);
        return;
    }
    fsm_py_begun(o, of->path);
    fsm_py_write(o, "op ");
    fsm_py_write(o, is->name);
    for (uint16_t i = 0u; i < is->parameter_count; i++) {
        fsm_py_show(o, is->parameters[i].type, given[i]);
    }
    if (is->result != NULL) {
        fsm_py_write(o, " =");
        fsm_py_show(o, is->result, result);
    }
    fsm_py_line(o);
    fsm_py_at(o);
}

FSM_PY_MAYBE void fsm_py_emit(
    const fsm_py_machine *of, void *m, uint32_t number, const void *const *given)
{
    const fsm_event_info *event = &of->info->events[number];
    const fsm_py_call *call = &of->sent[number];
    if (call->number >= 0) {
        fsm_py_ask(fsm_py_object(of, m), call, event->fields, event->field_count, given, NULL, NULL);
    }
    fsm_py_at(fsm_py_object(of, m));
}

/* ---- objects ------------------------------------------------------------------------------- */

/* A machine of a type or of one derived from it, with the module that the type came from. */
FSM_PY_MAYBE void fsm_py_module_free(void *module);

FSM_PY_MAYBE PyObject *fsm_py_new(PyTypeObject *type, PyObject *given, PyObject *keywords)
{
    PyObject *module = NULL;
    (void)given;
    (void)keywords;
    for (PyTypeObject *base = type; base != NULL && module == NULL;) {
        PyObject *found = PyType_GetModule(base);
        PyModuleDef *definition = found == NULL ? NULL : PyModule_GetDef(found);
        if (definition != NULL && definition->m_free == fsm_py_module_free) {
            module = found;
        }
        PyErr_Clear(); /* classes that a program derived have no module */
        base = (PyTypeObject *)PyType_GetSlot(base, Py_tp_base);
    }
    if (module == NULL) {
        PyErr_SetString(PyExc_TypeError, "the module of the machine is gone");
        return NULL;
    }
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    fsm_object *o = (fsm_object *)allocate(type, 0);
    if (o != NULL) {
        Py_INCREF(module);
        o->module = module;
        o->known = (fsm_py_module *)PyModule_GetState(module);
        o->of = o->known->of;
        o->driver = o->of->driver;
        o->info = o->driver->info;
        o->info->init(o->machine);
#ifdef FSM_PY_RECORDED
        if (o->of->inputs_size > 0u) { /* as recorded, and as before the current call */
            o->recorder.inputs = PyMem_Calloc(2u, o->of->inputs_size);
            if (o->recorder.inputs == NULL) {
                Py_DECREF(o);
                return PyErr_NoMemory();
            }
        }
#endif
    }
    return (PyObject *)o;
}

FSM_PY_MAYBE int fsm_py_traverse(PyObject *self, visitproc visit, void *arg)
{
    fsm_object *o = (fsm_object *)self;
    Py_VISIT(Py_TYPE(self));
    Py_VISIT(o->module);
    Py_VISIT(o->host);
    Py_VISIT(o->reply);
    Py_VISIT(o->log);
    Py_VISIT(o->trace);
    Py_VISIT(o->parts);
    return 0;
}

/* Keep the module: its strings may still be requested. */
FSM_PY_MAYBE int fsm_py_clear(PyObject *self)
{
    fsm_object *o = (fsm_object *)self;
    Py_CLEAR(o->host);
    Py_CLEAR(o->reply);
    Py_CLEAR(o->log);
    Py_CLEAR(o->trace);
    Py_CLEAR(o->parts);
    return 0;
}

FSM_PY_MAYBE void fsm_py_dealloc(PyObject *self)
{
    PyTypeObject *type = Py_TYPE(self);
    fsm_object *o = (fsm_object *)self;
    PyObject_GC_UnTrack(self);
    (void)fsm_py_clear(self);
    Py_CLEAR(o->module);
    PyMem_Free(o->text);
#ifdef FSM_PY_RECORDED
    Py_CLEAR(o->records);
    PyMem_Free(o->recorder.inputs);
#endif
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DECREF(type);
}

/* Return whether the host has all methods that a machine calls; else raise their names. */
FSM_PY_MAYBE bool fsm_py_provides(
    fsm_object *o, PyObject *host, const fsm_py_machine *of)
{
    PyObject *missing = PyList_New(0);
    bool is_fine = missing != NULL;
    for (Py_ssize_t i = of->first; i < of->after && is_fine; i++) {
        PyObject *found = PyObject_GetAttr(host, fsm_py_method(o, i));
        if (found == NULL) {
            is_fine = PyErr_ExceptionMatches(PyExc_AttributeError);
            if (is_fine) {
                PyErr_Clear();
                is_fine = PyList_Append(missing, fsm_py_method(o, i)) == 0;
            }
        }
        Py_XDECREF(found);
    }
    if (is_fine && PyList_Size(missing) > 0) {
        PyObject *type = PyObject_GetAttrString((PyObject *)Py_TYPE(host), "__name__");
        PyObject *separator = PyUnicode_FromString(", ");
        PyObject *all = separator == NULL ? NULL : PyUnicode_Join(separator, missing);
        if (type != NULL && all != NULL) {
            PyErr_Format(PyExc_TypeError, "%U lacks what %s calls: %U", type, of->info->name, all);
        }
        Py_XDECREF(type);
        Py_XDECREF(separator);
        Py_XDECREF(all);
        is_fine = false;
    }
    Py_XDECREF(missing);
    return is_fine;
}

FSM_PY_MAYBE void fsm_py_set(PyObject **place, PyObject *value)
{
    PyObject *before = *place;
    *place = value == Py_None ? NULL : value;
    Py_XINCREF(*place);
    Py_XDECREF(before);
}

FSM_PY_MAYBE bool fsm_py_given(PyObject *value)
{
    if (value == NULL) {
        PyErr_SetString(PyExc_AttributeError, "a part of a machine cannot be deleted");
    }
    return value != NULL;
}

#define FSM_PY_ATTRIBUTE(name)                                                                     \
    FSM_PY_MAYBE PyObject *fsm_py_get_##name(PyObject *self, void *unused)                         \
    {                                                                                              \
        (void)unused;                                                                              \
        return fsm_py_or_none(((fsm_object *)self)->name);                                         \
    }                                                                                              \
    FSM_PY_MAYBE int fsm_py_set_##name(PyObject *self, PyObject *value, void *unused)              \
    {                                                                                              \
        (void)unused;                                                                              \
        if (!fsm_py_given(value))                                                                  \
            return -1;                                                                             \
        fsm_py_set(&((fsm_object *)self)->name, value);                                            \
        return 0;                                                                                  \
    }

#ifdef FSM_PY_RECORDED
FSM_PY_MAYBE PyObject *fsm_py_get_records(PyObject *self, void *unused)
{
    (void)unused;
    return fsm_py_or_none(((fsm_object *)self)->records);
}
#endif

FSM_PY_ATTRIBUTE(log)
FSM_PY_ATTRIBUTE(reply)
FSM_PY_ATTRIBUTE(trace)

/* ---- modules ------------------------------------------------------------------------------- */

/* Names, a field of the rows of a table. */
FSM_PY_MAYBE PyObject *fsm_py_texts(const void *first, size_t each, Py_ssize_t count)
{
    PyObject *all = PyTuple_New(count);
    for (Py_ssize_t i = 0; i < count; i++) {
        const char *const *text = (const void *)((const char *)first + each * (size_t)i);
        if (!fsm_py_put(&all, i, PyUnicode_InternFromString(*text))) {
            return NULL;
        }
    }
    return all;
}

/* Return a dictionary of positions by name. For events of one name, the input event counts. */
FSM_PY_MAYBE PyObject *fsm_py_places(PyObject *names, const fsm_event_info *events)
{
    PyObject *all = PyDict_New();
    for (Py_ssize_t i = 0; all != NULL && i < PyTuple_Size(names); i++) {
        PyObject *name = PyTuple_GetItem(names, i), *place = PyLong_FromSsize_t(i);
        bool is_meant = events == NULL || (events[i].flags & FSM_EVENT_NAMED) != 0;
        bool is_set = is_meant || PyDict_Contains(all, name) == 0;
        if (place == NULL || (is_set && PyDict_SetItem(all, name, place) != 0)) {
            Py_CLEAR(all);
        }
        Py_XDECREF(place);
    }
    return all;
}

/* Run the definitions that are written in Python. */
FSM_PY_MAYBE bool fsm_py_define(PyObject *module, const char *text, const char *file)
{
    PyObject *space = PyModule_GetDict(module);
    PyObject *code = Py_CompileString(text, file, Py_file_input);
    PyObject *done = code == NULL ? NULL : PyEval_EvalCode(code, space, space);
    Py_XDECREF(code);
    Py_XDECREF(done);
    return done != NULL;
}

/* Give a class an attribute, which is taken over. */
FSM_PY_MAYBE bool fsm_py_attribute(PyObject *type, const char *name, PyObject *value)
{
    bool is_fine = value != NULL && PyObject_SetAttrString(type, name, value) == 0;
    Py_XDECREF(value);
    return is_fine;
}

FSM_PY_MAYBE int fsm_py_module_traverse(PyObject *module, visitproc visit, void *arg)
{
    fsm_py_module *known = (fsm_py_module *)PyModule_GetState(module);
    Py_VISIT(known->symbols);
    Py_VISIT(known->numbers);
    Py_VISIT(known->states);
    Py_VISIT(known->events);
    Py_VISIT(known->names);
    Py_VISIT(known->calls);
    return 0;
}

/* Only at the end: machines keep their module and read its strings until they are freed. */
FSM_PY_MAYBE void fsm_py_module_free(void *module)
{
    fsm_py_module *known = (fsm_py_module *)PyModule_GetState((PyObject *)module);
    if (known == NULL) {
        return;
    }
    Py_CLEAR(known->symbols);
    Py_CLEAR(known->numbers);
    Py_CLEAR(known->states);
    Py_CLEAR(known->events);
    Py_CLEAR(known->names);
    Py_CLEAR(known->calls);
}

/* ---- hooks of a step --------------------------------------------------------------------------- */

FSM_PY_MAYBE void fsm_py_keep(const fsm_py_machine *of, void *m)
{
    /* Completed steps are kept, whatever the host does in the next step. */
    fsm_object *o = fsm_py_object(of, m);
    memcpy(fsm_py_kept(o), o->machine, of->info->size);
#ifdef FSM_PY_RECORDED
    o->has_kept = true;
#endif
}

FSM_PY_MAYBE void fsm_py_on_begin(const fsm_py_machine *of, void *m, int cause, unsigned index)
{
    fsm_object *o = fsm_py_object(of, m);
    const uint32_t at = of->info->now;
    const unsigned long now = at == FSM_ABSENT ? o->now : *(const uint32_t *)fsm_at(m, at);
    char text[48];
    if (cause == FSM_EVENTLESS) {
        (void)PyOS_snprintf(o->pending, sizeof o->pending, "@%lu > eventless", now);
        return;
    }
    fsm_py_begun(o, of->path);
    if (cause == FSM_START) {
        (void)PyOS_snprintf(text, sizeof text, "@%lu > start", now);
    } else if (cause == FSM_EVENT) {
        (void)PyOS_snprintf(text, sizeof text, "@%lu > event ", now);
    } else {
        (void)PyOS_snprintf(text, sizeof text, "@%lu > timeout %u", now, index);
    }
    fsm_py_write(o, text);
    if (cause != FSM_EVENT) { /* its line goes on when the event is taken */
        fsm_py_line(o);
    }
    fsm_py_at(o);
}

/* The number of the active leaf of a region; 0 if it has none. */
static inline uint32_t fsm_py_leaf(const fsm_machine_info *info, const void *m, uint32_t region)
{
    const uint32_t deepest = fsm_number_at(&info->numbers[region], m);
    return info->states[deepest].kind >= FSM_ATOMIC ? deepest : 0u;
}

static inline bool fsm_py_has_finished(const fsm_machine_info *info, const void *m)
{
    return info->finished != FSM_ABSENT && *(const bool *)fsm_at(m, info->finished);
}

static inline uint8_t fsm_py_fault_of(const fsm_machine_info *info, const void *m)
{
    return info->fault == FSM_ABSENT ? (uint8_t)FSM_NO_FAULT : *(const uint8_t *)fsm_at(m, info->fault);
}

FSM_PY_MAYBE void fsm_py_on_end(const fsm_py_machine *of, void *m)
{
    fsm_object *o = fsm_py_object(of, m);
    if (o->pending[0] != 0) {
        o->pending[0] = 0;
    } else {
        fsm_py_begun(o, of->path);
        fsm_py_write(o, "=");
        for (uint32_t region = 0u; region < of->info->region_count; region++) {
            const uint32_t leaf = fsm_py_leaf(of->info, m, region);
            if (leaf == 0u) {
                continue;
            }
            fsm_py_write(o, " ");
            fsm_py_write(o, of->info->states[leaf].name);
        }
        if (fsm_py_has_finished(of->info, m)) {
            fsm_py_write(o, " finished");
        }
        fsm_py_line(o);
    }
    if (m == (void *)o->machine) {
        fsm_py_keep(of, m);
    }
    fsm_py_at(o);
}

FSM_PY_MAYBE void fsm_py_on_event(const fsm_py_machine *of, void *m, int what, const void *e)
{
    static const char *const verbs[] = {"raise ", "send ", "delay ", "out ", "unhandled "};
    fsm_object *o = fsm_py_object(of, m);
    if (what != FSM_TAKEN) {
        fsm_py_begun(o, of->path);
        fsm_py_write(o, verbs[what]);
    }
    if (what == FSM_UNHANDLED) {
        fsm_py_write(o, of->info->events[fsm_event_of(of->info, e) - 1u].name);
    } else {
        fsm_py_show_event(o, of->info, e);
    }
    if (what != FSM_DELAYED && what != FSM_LEFT) { /* these go on with a text */
        fsm_py_line(o);
    }
    fsm_py_at(o);
}

FSM_PY_MAYBE void fsm_py_on_state(const fsm_py_machine *of, void *m, const char *verb, uint32_t state)
{
    fsm_py_whole(fsm_py_object(of, m), of->path, verb, of->info->states[state].name);
    fsm_py_at(fsm_py_object(of, m));
}

FSM_PY_MAYBE void fsm_py_on_take(const fsm_py_machine *of, void *m, unsigned transition)
{
    char text[24];
    (void)PyOS_snprintf(text, sizeof text, "%u", transition);
    fsm_py_whole(fsm_py_object(of, m), of->path, "t ", text);
    fsm_py_at(fsm_py_object(of, m));
}

static inline void fsm_py_trace_text(
    const fsm_py_machine *of, fsm_object *o, int what, const char *text, unsigned long number)
{
    static const char *const verbs[] = {"error ", "full ", "fault ", "cancel ", "log "};
    char delay[32];
    switch (what) {
        case FSM_DELAYED:
            (void)PyOS_snprintf(delay, sizeof delay, " in %lu", number);
            fsm_py_write(o, delay);
            fsm_py_line(o);
            break;
        case FSM_LEFT:
            if (number != 0) {
                fsm_py_write(o, " to");
                fsm_py_show_string(o, (uint16_t)number, false);
            }
            fsm_py_line(o);
            break;
        case FSM_LOG: /* values follow, as after `reply` */
            fsm_py_begun(o, of->path);
            fsm_py_write(o, verbs[FSM_LOG - FSM_ERROR]);
            fsm_py_write(o, text);
            break;
        case FSM_REPLY:
            fsm_py_begun(o, of->path);
            fsm_py_write(o, "reply");
            break;
        default:
            fsm_py_whole(o, of->path, verbs[what - FSM_ERROR], text);
            break;
    }
}

FSM_PY_MAYBE void fsm_py_on_text(
    const fsm_py_machine *of, void *m, int what, const char *text, unsigned long number)
{
    fsm_object *o = fsm_py_object(of, m);
    if (what == FSM_FAULT && m == (void *)o->machine) {
        o->fault = text;
    }
    if (what == FSM_LEFT) {
        o->peer = (uint16_t)number;
    }
    if (o->trace != NULL) {
        fsm_py_trace_text(of, o, what, text, number);
    }
    if (what == FSM_LOG) {
        fsm_py_begin(o, text);
    } else if (what == FSM_REPLY) {
        fsm_py_begin(o, NULL);
    }
    fsm_py_at(o);
}

FSM_PY_MAYBE void fsm_py_on_integer(const fsm_py_machine *of, void *m, char kind, uint64_t value)
{
    fsm_object *o = fsm_py_object(of, m);
    bool is_negative = kind == 'i' && (int64_t)value < 0;
    if (o->trace != NULL) {
        fsm_py_show_integer(o, is_negative, value);
    }
    if (o->parts == NULL) {
        return;
    }
    if (kind == 'b') {
        fsm_py_add(o, fsm_py_bool_of(value != 0u));
    } else if (is_negative) {
        fsm_py_add(o, PyLong_FromLongLong((int64_t)value));
    } else {
        fsm_py_add(o, PyLong_FromUnsignedLongLong(value));
    }
}

FSM_PY_MAYBE void fsm_py_on_float(const fsm_py_machine *of, void *m, double value)
{
    fsm_object *o = fsm_py_object(of, m);
    if (o->trace != NULL) {
        fsm_py_show_float(o, value);
    }
    if (o->parts != NULL) {
        fsm_py_add(o, PyFloat_FromDouble(value));
    }
}

FSM_PY_MAYBE void fsm_py_on_string(const fsm_py_machine *of, void *m, long value)
{
    fsm_object *o = fsm_py_object(of, m);
    if (o->trace != NULL && value < 0) {
        fsm_py_show_bracket(o, value == FSM_PY_OPEN);
    } else if (o->trace != NULL) {
        fsm_py_show_string(o, (uint16_t)value, true);
    }
    if (o->parts == NULL) {
        return;
    }
    if (value < 0) {
        fsm_py_bracket(o, value == FSM_PY_OPEN);
    } else {
        fsm_py_add(o, fsm_py_string(o, (uint16_t)value));
    }
}

FSM_PY_MAYBE void fsm_py_on_line(const fsm_py_machine *of, void *m)
{
    fsm_object *o = fsm_py_object(of, m);
    if (o->trace != NULL) {
        fsm_py_line(o);
    }
    fsm_py_finish(o);
    fsm_py_at(o);
}

/* ---- methods ------------------------------------------------------------------------------------ */

static inline bool fsm_py_runs(const fsm_object *o)
{
    return fsm_is_running(o->info, o->machine);
}

/* A step, which may be left in its midst where the host is called. */
typedef struct {
    fsm_object *o;
    const void *e;
    uint32_t now;
    fsm_result result;
} fsm_py_job;

FSM_PY_MAYBE bool fsm_py_attempt(fsm_py_job *job, void (*work)(void *))
{
    fsm_object *o = job->o;
    const char *fault = o->fault;
    fsm_py_at(o);
    if (!o->of->calls) {
        work(job);
        return true;
    }
#ifdef FSM_PY_RECORDED
    const fsm_py_mark mark = fsm_py_marked(o);
#endif
    memcpy(fsm_py_kept(o), o->machine, o->info->size);
    if (fsm_py_guarded(o, work, job)) {
        return true;
    }
    memcpy(o->machine, fsm_py_kept(o), o->info->size);
    o->fault = fault;
#ifdef FSM_PY_RECORDED
    fsm_py_unrecord(o, &mark, job->now);
#endif
    return false;
}

FSM_PY_MAYBE void fsm_py_do_start(void *of)
{
    fsm_py_job *job = (fsm_py_job *)of;
    job->o->driver->start(job->o->machine, job->now);
}

FSM_PY_MAYBE void fsm_py_do_run(void *of)
{
    fsm_py_job *job = (fsm_py_job *)of;
    job->o->driver->run(job->o->machine, job->now);
}

FSM_PY_MAYBE void fsm_py_do_dispatch(void *of)
{
    fsm_py_job *job = (fsm_py_job *)of;
    job->result = job->o->driver->dispatch(job->o->machine, job->e, job->now);
}

FSM_PY_MAYBE PyObject *fsm_py_dispatched(fsm_object *o, const void *e, Py_ssize_t index)
{
    fsm_py_at(o);
    if (!o->of->calls) {
        return fsm_py_bool_of(o->driver->dispatch(o->machine, e, o->now) == FSM_HANDLED);
    }
    fsm_py_job job = {o, e, o->now, FSM_STOPPED};
    const fsm_type *reply = o->info->events[index].reply;
    if (!fsm_py_is_free(o)) {
        return NULL;
    }
    if (o->of->replies) {
        fsm_py_set(&o->reply, Py_None);
    }
    if (fsm_py_runs(o) && !fsm_py_attempt(&job, fsm_py_do_dispatch)) {
        return NULL;
    }
    if (o->of->replies && reply != NULL && reply->kind == FSM_BOOL && o->reply != NULL) {
        fsm_py_set(&o->reply, PyObject_IsTrue(o->reply) ? Py_True : Py_False);
    }
    return fsm_py_bool_of(job.result == FSM_HANDLED);
}

FSM_PY_MAYBE PyObject *fsm_py_posted(fsm_object *o, const void *e)
{
    fsm_py_at(o);
    return fsm_py_bool_of(o->driver->post(o->machine, e));
}

/* Read the arguments of `post_` or `dispatch_` of an event into it. */
FSM_PY_MAYBE bool fsm_py_event_of(
    fsm_object *o, const char *method, Py_ssize_t index, void *e,
    PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    enum { FEW = 8 };
    const Py_ssize_t fields = o->info->events[index].field_count;
    const char *const *names = o->of->events[index].fields;
    PyObject *few[FEW], **values = fields <= FEW ? few : PyMem_Malloc((size_t)fields * sizeof *values);
    if (values == NULL) {
        (void)PyErr_NoMemory();
        return false;
    }
    const bool is_filled = fsm_py_arguments(method, names, fields, given, count, keywords, values)
        && fsm_py_all(method, names, fields, values) && fsm_py_fill(o, index, e, values);
    if (values != few) {
        PyMem_Free(values);
    }
    return is_filled;
}

FSM_PY_MAYBE PyObject *fsm_py_start(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    fsm_py_job job = {(fsm_object *)object, NULL, 0u, FSM_STOPPED};
    PyObject *values[1];
    if (!fsm_py_arguments("start", names, 1, given, count, keywords, values)
        || (values[0] != NULL && !fsm_py_time(values[0], &job.now)) || !fsm_py_is_free(job.o))
        return NULL;
    job.o->now = job.now;
    return fsm_py_attempt(&job, fsm_py_do_start) ? fsm_py_or_none(NULL) : NULL;
}

FSM_PY_MAYBE PyObject *fsm_py_run(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    fsm_py_job job = {(fsm_object *)object, NULL, 0u, FSM_STOPPED};
    PyObject *values[1];
    if (!fsm_py_arguments("run", names, 1, given, count, keywords, values)
        || !fsm_py_all("run", names, 1, values) || !fsm_py_time(values[0], &job.now)
        || !fsm_py_is_free(job.o))
        return NULL;
    if (fsm_py_runs(job.o)) {
        job.o->now = job.now;
        if (!fsm_py_attempt(&job, fsm_py_do_run)) {
            return NULL;
        }
    }
    return fsm_py_bool_of(fsm_py_runs(job.o));
}

/* An event by its name, with its payload by position. */
FSM_PY_MAYBE bool fsm_py_read(fsm_object *o, PyObject *const *given, Py_ssize_t count, void *e,
                              const char *method, Py_ssize_t *index)
{
    memset(e, 0, o->info->event_size);
    if (count < 1) {
        PyErr_Format(PyExc_TypeError, "%s() lacks the argument 'event'", method);
        return false;
    }
    *index = fsm_py_named(o, given[0], count - 1);
    return *index >= 0 && fsm_py_fill(o, *index, e, given + 1);
}

FSM_PY_MAYBE PyObject *fsm_py_post(PyObject *object, PyObject *const *given, Py_ssize_t count)
{
    fsm_object *o = (fsm_object *)object;
    uint64_t e[o->info->event_size / sizeof(uint64_t) + 1u];
    Py_ssize_t index = 0;
    return fsm_py_read(o, given, count, e, "post", &index) ? fsm_py_posted(o, e) : NULL;
}

FSM_PY_MAYBE PyObject *fsm_py_dispatch(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    fsm_object *o = (fsm_object *)object;
    uint64_t e[o->info->event_size / sizeof(uint64_t) + 1u];
    PyObject *values[1];
    uint32_t now = 0u;
    Py_ssize_t index = 0;
    if (!fsm_py_arguments("dispatch", names, 1, given + count, 0, keywords, values)
        || !fsm_py_read(o, given, count, e, "dispatch", &index))
        return NULL;
    bool is_given = values[0] != NULL && values[0] != Py_None;
    if ((is_given && !fsm_py_time(values[0], &now)) || !fsm_py_is_free(o)) {
        return NULL;
    }
    if (is_given && fsm_py_runs(o)) {
        o->now = now;
    }
    return fsm_py_dispatched(o, e, index);
}

FSM_PY_MAYBE PyObject *fsm_py_next_deadline(PyObject *object, PyObject *unused)
{
    const fsm_object *o = (fsm_object *)object;
    uint32_t due = 0u;
    (void)unused;
    if (!o->driver->next_deadline(o->machine, &due)) {
        return fsm_py_or_none(NULL);
    }
    return PyLong_FromUnsignedLong(due);
}

FSM_PY_MAYBE PyObject *fsm_py_is_in(PyObject *object, PyObject *state)
{
    fsm_object *o = (fsm_object *)object;
    PyObject *found = PyDict_GetItemWithError(o->known->states, state);
    if (found != NULL) {
        const uint32_t number = (uint32_t)PyLong_AsUnsignedLong(found);
        const fsm_machine_info *info = o->info;
        return fsm_py_bool_of(info->states[number].kind != FSM_HISTORY
                              && fsm_is_active(info, o->machine, number));
    }
    if (PyErr_Occurred() == NULL) {
        PyErr_Format(PyExc_ValueError, "%s has no state %R", o->info->name, state);
    }
    return NULL;
}

FSM_PY_MAYBE PyObject *fsm_py_active(PyObject *object, PyObject *unused)
{
    fsm_object *o = (fsm_object *)object;
    const fsm_machine_info *info = o->info;
    Py_ssize_t count = 0;
    (void)unused;
    for (uint32_t region = 0u; region < info->region_count; region++) {
        count += fsm_py_leaf(info, o->machine, region) != 0u;
    }
    PyObject *names = PyTuple_New(count);
    count = 0;
    for (uint32_t region = 0u; region < info->region_count; region++) {
        const uint32_t leaf = fsm_py_leaf(info, o->machine, region);
        if (leaf != 0u
            && !fsm_py_put(&names, count++, fsm_py_or_none(PyTuple_GetItem(o->known->names, leaf))))
            return NULL;
    }
    return names;
}

FSM_PY_MAYBE void fsm_py_do_dump(void *of)
{
    fsm_py_job *job = (fsm_py_job *)of;
    const fsm_py_path outermost = {NULL, NULL};
    fsm_py_dump(job->o, job->o->info, job->o->machine, &outermost);
}

/* For tests: all data as lines of the trace. */
FSM_PY_MAYBE PyObject *fsm_py_dump_all(PyObject *object, PyObject *unused)
{
    fsm_py_job job = {(fsm_object *)object, NULL, 0u, FSM_STOPPED};
    (void)unused;
    if (!fsm_py_is_free(job.o) || !fsm_py_attempt(&job, fsm_py_do_dump)) {
        return NULL;
    }
    return fsm_py_or_none(NULL);
}

FSM_PY_MAYBE PyObject *fsm_py_save(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    fsm_object *o = (fsm_object *)object;
    const fsm_py_class *of = o->of;
    PyObject *values[1], *bytes = NULL;
    uint32_t now = o->now;
    if (!fsm_py_arguments("save", names, 1, given, count, keywords, values)
        || (values[0] != NULL && values[0] != Py_None && !fsm_py_time(values[0], &now))
        || !fsm_py_is_free(o)
        || (bytes = PyBytes_FromStringAndSize(NULL, (Py_ssize_t)of->saved_size)) == NULL)
        return NULL;
    fsm_py_is_foreign = false;
    if (!of->driver->save(o->machine, now, (uint8_t *)PyBytes_AsString(bytes)) || fsm_py_is_foreign) {
        Py_DECREF(bytes);
        PyErr_Format(PyExc_ValueError, "%s holds a text that its chart nowhere mentions",
                     o->info->name);
        return NULL;
    }
    return bytes;
}

FSM_PY_MAYBE PyObject *fsm_py_restore(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"saved", "now"};
    static const char *const faults[] = {
        NULL, "microsteps", "internal", "range", "error.*", "invoked",
    };
    fsm_object *o = (fsm_object *)object;
    PyObject *values[2];
    char *bytes = NULL;
    Py_ssize_t size = 0;
    uint32_t now = 0u;
    if (!fsm_py_arguments("restore", names, 2, given, count, keywords, values)
        || !fsm_py_all("restore", names, 1, values)
        || (values[1] != NULL && !fsm_py_time(values[1], &now))
        || PyBytes_AsStringAndSize(values[0], &bytes, &size) != 0 || !fsm_py_is_free(o))
        return NULL;
    const fsm_driver *driver = o->driver;
    fsm_py_at(o);
    switch (driver->restore(o->machine, now, (const uint8_t *)bytes, (size_t)size)) {
        case FSM_RESTORED:
            o->now = now;
            o->fault = faults[fsm_py_fault_of(o->info, o->machine)];
            return fsm_py_or_none(NULL);
        case FSM_FOREIGN:
            PyErr_Format(PyExc_ValueError, "this was saved by another chart than %s",
                         o->info->name);
            return NULL;
        default:
            PyErr_Format(PyExc_ValueError, "this is no saved %s, or damaged", o->info->name);
            return NULL;
    }
}

FSM_PY_MAYBE PyObject *fsm_py_get_running(PyObject *object, void *unused)
{
    (void)unused;
    return fsm_py_bool_of(fsm_py_runs((fsm_object *)object));
}

FSM_PY_MAYBE PyObject *fsm_py_get_finished(PyObject *object, void *unused)
{
    const fsm_object *o = (fsm_object *)object;
    (void)unused;
    return fsm_py_bool_of(fsm_py_has_finished(o->info, o->machine));
}

FSM_PY_MAYBE PyObject *fsm_py_get_fault(PyObject *object, void *unused)
{
    const fsm_object *o = (fsm_object *)object;
    (void)unused;
    if (fsm_py_fault_of(o->info, o->machine) == FSM_NO_FAULT || o->fault == NULL) {
        return fsm_py_or_none(NULL);
    }
    return PyUnicode_FromString(o->fault);
}

/* Data, outputs and inputs, by their number in the table. */
FSM_PY_MAYBE PyObject *fsm_py_get(PyObject *object, void *number)
{
    const fsm_object *o = (fsm_object *)object;
    const fsm_field *of = &o->info->variables[(uintptr_t)number];
    return fsm_py_give(o, of->type, fsm_at(o->machine, of->offset));
}

FSM_PY_MAYBE int fsm_py_put_variable(PyObject *object, PyObject *value, void *number)
{
    fsm_object *o = (fsm_object *)object;
    const fsm_field *of = &o->info->variables[(uintptr_t)number];
    const char *what = o->of->attributes[(uintptr_t)number].name;
    if (!fsm_py_given(value)) {
        return -1;
    }
    return fsm_py_assign(o, of->type, value, what, fsm_place_at(o->machine, of->offset));
}

FSM_PY_MAYBE int fsm_py_init(PyObject *object, PyObject *given, PyObject *keywords)
{
    static char first[] = "operations";
    static char *names[] = {first, NULL};
    fsm_object *o = (fsm_object *)object;
    const fsm_py_machine *const *machines = o->of->machines;
    PyObject *host = Py_None;
    if (!PyArg_ParseTupleAndKeywords(given, keywords, o->of->arguments, names, &host) || !fsm_py_is_free(o)) {
        return -1;
    }
    for (; *machines != NULL; machines++) {
        if (!fsm_py_provides(o, host == Py_None ? object : host, *machines)) {
            return -1;
        }
    }
    fsm_py_set(&o->host, host == object ? Py_None : host);
    fsm_py_set(&o->log, Py_None);
    fsm_py_set(&o->reply, Py_None);
    fsm_py_set(&o->trace, Py_None);
    o->now = 0u;
    o->fault = NULL;
    o->info->init(o->machine);
#ifdef FSM_PY_RECORDED
    if (o->of->restored != NULL) {
        PyObject *records = PyByteArray_FromStringAndSize("", 0), *before = o->records;
        if (records == NULL) {
            return -1;
        }
        const fsm_records_state none = {.inputs = o->recorder.inputs};
        o->recorder = none;
        o->records = records;
        Py_XDECREF(before);
    }
#endif
    return 0;
}

FSM_PY_MAYBE bool fsm_py_know_symbols(fsm_py_module *known)
{
    const fsm_machine_info *info = known->of->driver->info;
    bool is_fine = known->symbols != NULL && known->numbers != NULL;
    for (uint32_t i = 0u; is_fine && i < info->symbol_count; i++) {
        PyObject *text = PyUnicode_FromString(info->symbol(i));
        PyObject *number = PyLong_FromUnsignedLong(i);
        is_fine = text != NULL && number != NULL && PyList_Append(known->symbols, text) == 0
            && PyDict_SetItem(known->numbers, text, number) == 0;
        Py_XDECREF(text);
        Py_XDECREF(number);
    }
    return is_fine;
}

FSM_PY_MAYBE PyObject *fsm_py_make_class(PyObject *module, const fsm_py_class *of)
{
    const size_t each = of->driver->info->size;
    PyType_Slot slots[] = {
        {Py_tp_doc, (void *)(uintptr_t)of->doc}, {Py_tp_new, (void *)fsm_py_new},
        {Py_tp_init, (void *)fsm_py_init}, {Py_tp_dealloc, (void *)fsm_py_dealloc},
        {Py_tp_traverse, (void *)fsm_py_traverse}, {Py_tp_clear, (void *)fsm_py_clear},
        {Py_tp_methods, of->methods}, {Py_tp_getset, of->attributes}, {0, NULL},
    };
    PyType_Spec spec = {
        of->type, (int)(offsetof(fsm_object, machine) + each * (of->calls ? 2u : 1u)), 0,
        Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, slots,
    };
    return PyType_FromModuleAndSpec(module, &spec, NULL);
}

FSM_PY_MAYBE int fsm_py_execute(PyObject *module)
{
    const fsm_py_class *of = (const fsm_py_class *)(void *)PyModule_GetDef(module);
    const fsm_machine_info *info = of->driver->info;
    fsm_py_module *known = (fsm_py_module *)PyModule_GetState(module);
    const Py_ssize_t calls = of->host_count;
    Py_ssize_t first = 0;
    for (const fsm_py_machine *const *machine = of->machines; *machine != NULL; machine++) {
        first = (*machine)->first;
    }
    known->of = of;
    known->names = fsm_py_texts(&info->states[0].name, sizeof info->states[0], info->state_count);
    PyObject *events = fsm_py_texts(info->events == NULL ? NULL : &info->events[0].name,
                                    sizeof info->events[0], info->event_count);
    known->calls = fsm_py_texts(of->host, sizeof of->host[0], calls);
    known->symbols = PyList_New(0);
    known->numbers = PyDict_New();
    bool is_fine = known->names != NULL && events != NULL && known->calls != NULL
        && fsm_py_know_symbols(known);
    if (is_fine) {
        known->states = fsm_py_places(known->names, NULL);
        known->events = fsm_py_places(events, info->events);
    }
    is_fine = is_fine && known->states != NULL && known->events != NULL
        && fsm_py_define(module, of->python, of->file);
    PyObject *type = is_fine ? fsm_py_make_class(module, of) : NULL;
    is_fine = type != NULL
        && fsm_py_attribute(type, "__module__", PyModule_GetNameObject(module))
        && fsm_py_attribute(type, "NAME", PyUnicode_FromString(info->name))
        && fsm_py_attribute(type, "STATES", fsm_py_or_none(known->names))
        && fsm_py_attribute(type, "EVENTS", fsm_py_or_none(events))
        && fsm_py_attribute(type, "OPERATIONS", PyTuple_GetSlice(known->calls, first, calls))
        && PyModule_AddObjectRef(module, strrchr(of->type, '.') + 1, type) == 0;
    Py_XDECREF(type);
    Py_XDECREF(events);
    return is_fine ? 0 : -1;
}

/* ---- for the tables of a module ------------------------------------------------------------------ */

FSM_PY_MAYBE PyModuleDef_Slot fsm_py_slots[] = {{Py_mod_exec, (void *)fsm_py_execute}, {0, NULL}};

#define FSM_PY_MODULE(name, doc)                                                                   \
    {PyModuleDef_HEAD_INIT, name, doc, sizeof(fsm_py_module), NULL, fsm_py_slots,                  \
     fsm_py_module_traverse, NULL, fsm_py_module_free}

#define FSM_PY_CALL(function) (PyCFunction)(void (*)(void))function
#define FSM_PY_METHOD(name, arguments, doc)                                                        \
    {#name, FSM_PY_CALL(fsm_py_##name), METH_FASTCALL | METH_KEYWORDS,                             \
     #name "($self" arguments ")\n--\n\n" doc}
#define FSM_PY_METHODS                                                                             \
    FSM_PY_METHOD(start, ", now=0", "Start or restart at a time in ticks."),                        \
    FSM_PY_METHOD(run, ", now",                                                                    \
                  "Run until a time; return whether the machine is still running."),               \
    {"post", FSM_PY_CALL(fsm_py_post), METH_FASTCALL, "post($self, event, /, *payload)\n--\n\n"    \
     "Put an event into the queue; False if full."},                                               \
    FSM_PY_METHOD(dispatch, ", event, /, *payload, now=None", "Process one event immediately."),   \
    {"next_deadline", fsm_py_next_deadline, METH_NOARGS, "next_deadline($self)\n--\n\n"            \
     "Return the first timer's deadline; None if none is armed."},                                 \
    {"is_in", fsm_py_is_in, METH_O, "is_in($self, state, /)\n--\n\n"                               \
     "Whether the state of that name is active."},                                                 \
    {"active", fsm_py_active, METH_NOARGS, "active($self)\n--\n\n"                                 \
     "Return the names of the active atomic states."}
#define FSM_PY_SAVING                                                                              \
    FSM_PY_METHOD(save, ", now=None", "Return the machine as bytes, timers with their remaining time."), \
    FSM_PY_METHOD(restore, ", saved, now=0", "Go on from what was saved, at a time in ticks.")
#define FSM_PY_TRACING {"_dump", fsm_py_dump_all, METH_NOARGS, "Show the trace all data."}

/* Methods of the event `index` of the machine X: with a payload, and without; `calls`: of its class. */
#define FSM_PY_DO(X, o, e, is_posted, calls, index)                                                \
    (is_posted) ? (fsm_py_at(o), fsm_py_bool_of(X##_post((X *)(void *)(o)->machine, e)))           \
    : (calls)   ? fsm_py_dispatched(o, e, index)                                                   \
                : (fsm_py_at(o),                                                                   \
                   fsm_py_bool_of(X##_dispatch((X *)(void *)(o)->machine, e, (o)->now) == FSM_HANDLED))
#define FSM_PY_EVENT(function, X, is_posted, calls, index, method)                                 \
    static PyObject *function(                                                                     \
        PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)            \
    {                                                                                              \
        fsm_object *o = (fsm_object *)object;                                                      \
        X##_event e;                                                                               \
        memset(&e, 0, sizeof e);                                                                   \
        if (!fsm_py_event_of(o, method, index, &e, given, count, keywords))                        \
            return NULL;                                                                           \
        return FSM_PY_DO(X, o, &e, is_posted, calls, index);                                       \
    }
#define FSM_PY_PLAIN(function, X, is_posted, calls, index)                                         \
    static PyObject *function(PyObject *object, PyObject *unused)                                  \
    {                                                                                              \
        fsm_object *o = (fsm_object *)object;                                                      \
        X##_event e;                                                                               \
        (void)unused;                                                                              \
        memset(&e, 0, sizeof e);                                                                   \
        fsm_store_bits(&e.event, (uint32_t)sizeof e.event, (index) + 1u);                          \
        return FSM_PY_DO(X, o, &e, is_posted, calls, index);                                       \
    }

#define FSM_PY_VARIABLE(name, number) {name, fsm_py_get, fsm_py_put_variable, NULL, (void *)(number)}
#define FSM_PY_SEEN(name) {#name, fsm_py_get_##name, NULL, NULL, NULL}
#define FSM_PY_HELD(name) {#name, fsm_py_get_##name, fsm_py_set_##name, NULL, NULL}
#define FSM_PY_ATTRIBUTES                                                                          \
    FSM_PY_SEEN(running), FSM_PY_SEEN(finished), FSM_PY_SEEN(fault), FSM_PY_HELD(log), FSM_PY_HELD(reply)

#endif
