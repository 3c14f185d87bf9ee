/* fsm_python.h: what machines that are extension modules of CPython share. Stable ABI of 3.11.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef FSM_PYTHON_H
#define FSM_PYTHON_H

#include "fsm_info.h"

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

#ifdef __GNUC__
#define FSM_PY_MAYBE __attribute__((unused)) static
#else
#define FSM_PY_MAYBE static
#endif

#if defined(__APPLE__) || defined(__FreeBSD__) /* there these save no mask of signals */
#define FSM_PY_SET _setjmp
#define FSM_PY_LEAVE _longjmp
#else
#define FSM_PY_SET setjmp
#define FSM_PY_LEAVE longjmp
#endif

enum { FSM_PY_STRINGS = 65535, FSM_PY_OPEN = -1, FSM_PY_CLOSE = -2 };

/* What a module keeps, in each interpreter its own. */
typedef struct {
    PyObject *symbols; /* a list: strings by their numbers */
    PyObject *numbers; /* a dictionary: the other way round */
    PyObject *states;  /* a dictionary: states by name */
    PyObject *events;  /* a dictionary: events by name */
    PyObject *names;   /* a tuple: names of states */
    PyObject *calls;   /* a tuple: names of what the host provides */
} fsm_py_module;

/* What every machine begins with. */
typedef struct {
    PyObject_HEAD
    PyObject *module;
    fsm_py_module *known;
    PyObject *host; /* NULL: the machine itself */
    PyObject *reply;
    PyObject *log;
    PyObject *trace;
    PyObject *parts; /* of a line that is told: a list in a list for each bracket that is open */
    const char *fault;
    jmp_buf *leave; /* the way out of a step that the host broke off */
    uint32_t now;
    uint16_t peer;
    bool busy;
    bool is_reply;
    bool after_bracket;
    char pending[32];
    char *text; /* the line of the trace at hand */
    size_t length;
    size_t room;
} fsm_object;

/* An event: the names of its fields in Python, and what messages call these. */
typedef struct {
    const char *const *fields;
    const char *const *said;
} fsm_py_event;

/* What the host is called for: the number of its method, what messages call the result, whether it
 * is given the peer. Number -1: it is never called. */
typedef struct {
    Py_ssize_t number;
    const char *said;
    bool has_peer;
} fsm_py_call;

/* ---- leaving a step ---------------------------------------------------------------------------
 * An exception cannot pass through the generated C, which holds nothing but its struct: the step is
 * left as it is, and whoever began it puts the struct back. */

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

FSM_PY_MAYBE bool fsm_py_is_free(const fsm_object *o, const char *name)
{
    if (o->busy)
        PyErr_Format(PyExc_RuntimeError, "%s was called from within one of its own steps", name);
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
    if (type->kind == FSM_BOOL)
        PyErr_Format(PyExc_ValueError, "%s must be in False..True, not %R", what, value);
    else if (type->hi > INT64_MAX && type->kind != FSM_SIGNED)
        PyErr_Format(PyExc_ValueError, "%s must be in %llu..%llu, not %R", what,
                     (unsigned long long)type->lo, (unsigned long long)type->hi, value);
    else
        PyErr_Format(PyExc_ValueError, "%s must be in %lld..%lld, not %R", what,
                     (long long)type->lo, (long long)type->hi, value);
    return false;
}

FSM_PY_MAYBE bool fsm_py_wrong(const char *what, const char *wanted, PyObject *value)
{
    PyObject *type = PyObject_GetAttrString((PyObject *)Py_TYPE(value), "__name__");
    if (type != NULL)
        PyErr_Format(PyExc_TypeError, "%s must be %s, not %S", what, wanted, type);
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
    if (index == NULL)
        return false;
    if (type->kind == FSM_UNSIGNED && type->hi > INT64_MAX) {
        *out = PyLong_AsUnsignedLongLong(index);
        if (PyErr_Occurred() != NULL && PyErr_ExceptionMatches(PyExc_OverflowError)) {
            PyErr_Clear();
            overflow = 1;
        }
    } else {
        *out = (uint64_t)PyLong_AsLongLongAndOverflow(index, &overflow);
        if (type->kind != FSM_SIGNED && *out > INT64_MAX && PyErr_Occurred() == NULL)
            overflow = -1;
    }
    Py_DECREF(index);
    if (PyErr_Occurred() != NULL)
        return false;
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
    if (!PyUnicode_Check(value))
        return fsm_py_wrong(what, "a string", value);
    PyObject *found = PyDict_GetItemWithError(known->numbers, value);
    if (found != NULL) {
        *out = (uint16_t)PyLong_AsLong(found);
        return true;
    }
    Py_ssize_t next = PyList_Size(known->symbols);
    if (PyErr_Occurred() != NULL)
        return false;
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
    if (!PySequence_Check(value) || PyUnicode_Check(value) || PyBytes_Check(value))
        return fsm_py_wrong(what, "a sequence", value);
    Py_ssize_t count = PySequence_Size(value);
    if (count >= 0 && count != wanted)
        PyErr_Format(PyExc_ValueError, "%s must have %zd parts, not %zd", what, wanted, count);
    return count == wanted;
}

/* Put the next part into a tuple; false if there is none. Drops the tuple then. */
FSM_PY_MAYBE bool fsm_py_put(PyObject **parts, Py_ssize_t place, PyObject *part)
{
    if (*parts != NULL && part != NULL && PyTuple_SetItem(*parts, place, part) == 0)
        return true; /* SetItem takes the part over, even when it fails */
    if (*parts == NULL)
        Py_XDECREF(part);
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
            if (!fsm_py_symbol(o, value, what, &symbol))
                return false;
            fsm_set_bits(type, out, symbol);
            return true;
        case FSM_FLOAT:
            if (!fsm_py_double(value, what, &real))
                return false;
            fsm_set_float(type, out, real);
            return true;
        case FSM_ARRAY:
        case FSM_RECORD:
            if (!fsm_py_parts(value, what, (Py_ssize_t)type->count))
                return false;
            for (uint32_t i = 0u; i < type->count; i++) {
                const bool is_array = type->kind == FSM_ARRAY;
                const fsm_type *of = is_array ? type->element : type->fields[i].type;
                const uint32_t offset = is_array ? i * of->size : type->fields[i].offset;
                PyObject *part = PySequence_GetItem(value, (Py_ssize_t)i);
                bool is_taken =
                    part != NULL && fsm_py_take(o, of, part, what, fsm_place_at(out, offset));
                Py_XDECREF(part);
                if (!is_taken)
                    return false;
            }
            return true;
        default:
            if (!fsm_py_integer(value, what, type, &bits))
                return false;
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
                if (!fsm_py_put(&parts, (Py_ssize_t)i, part))
                    return NULL;
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
    if (!is_taken)
        PyErr_NoMemory();
    is_taken = is_taken && fsm_py_take(o, type, value, what, taken);
    if (is_taken)
        memcpy(place, taken, type->size);
    if (taken != small)
        PyMem_Free(taken);
    return is_taken ? 0 : -1;
}

/* Read the payload of an event; false with an exception. */
FSM_PY_MAYBE bool fsm_py_fill(
    fsm_object *o, const fsm_machine_info *info, const fsm_py_event *events, Py_ssize_t index,
    void *e, PyObject *const *values)
{
    const fsm_event_info *event = &info->events[index];
    fsm_store_bits(fsm_place_at(e, info->event_number), info->event_width, (uint64_t)index + 1u);
    for (uint16_t i = 0u; i < event->field_count; i++) {
        void *place = fsm_place_at(e, event->fields[i].offset);
        if (!fsm_py_take(o, event->fields[i].type, values[i], events[index].said[i], place))
            return false;
    }
    return true;
}

FSM_PY_MAYBE bool fsm_py_time(PyObject *value, uint32_t *out)
{
    PyObject *index = fsm_py_index(value, "a time");
    if (index == NULL)
        return false;
    unsigned long long taken = PyLong_AsUnsignedLongLongMask(index);
    Py_DECREF(index);
    if (PyErr_Occurred() != NULL)
        return false;
    *out = (uint32_t)(taken & 0xFFFFFFFFu);
    return true;
}

FSM_PY_MAYBE PyObject *fsm_py_bool_of(bool value)
{
    return PyBool_FromLong(value);
}

/* ---- arguments ----------------------------------------------------------------------------- */

/* Arguments by position and name, in the order of the names; what is not given is NULL. */
FSM_PY_MAYBE bool fsm_py_arguments(
    const char *name, const char *const *names, Py_ssize_t count, PyObject *const *given,
    Py_ssize_t positional, PyObject *keywords, PyObject **out)
{
    if (positional > count) {
        PyErr_Format(PyExc_TypeError, "%s() takes %zd arguments, not %zd", name, count, positional);
        return false;
    }
    for (Py_ssize_t i = 0; i < count; i++)
        out[i] = i < positional ? given[i] : NULL;
    Py_ssize_t others = keywords == NULL ? 0 : PyTuple_Size(keywords);
    for (Py_ssize_t k = 0; k < others; k++) {
        PyObject *keyword = PyTuple_GetItem(keywords, k);
        Py_ssize_t place = 0;
        while (place < count && PyUnicode_CompareWithASCIIString(keyword, names[place]) != 0)
            place++;
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

/* The event of a name, of that many fields; -1 with an exception if there is none. */
FSM_PY_MAYBE Py_ssize_t fsm_py_named(
    const fsm_object *o, const fsm_machine_info *info, PyObject *event, Py_ssize_t count)
{
    PyObject *found = PyDict_GetItemWithError(o->known->events, event);
    if (found == NULL) {
        if (PyErr_Occurred() == NULL) {
            PyObject *separator = PyUnicode_FromString(", ");
            PyObject *all =
                separator == NULL ? NULL : PyUnicode_Join(separator, o->known->events);
            if (all != NULL)
                PyErr_Format(PyExc_ValueError, "%s receives no event %R, but %U", info->name, event,
                             all);
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

/* ---- what the host is told ----------------------------------------------------------------- */

/* Begin a line of values, which is given to `log` or becomes the reply; label: NULL for that. */
FSM_PY_MAYBE void fsm_py_begin(fsm_object *o, const char *label)
{
    Py_CLEAR(o->parts);
    o->is_reply = label == NULL;
    if (label != NULL && o->log == NULL)
        return;
    PyObject *values = PyList_New(0);
    PyObject *text = label == NULL ? NULL : PyUnicode_FromString(label);
    if (values != NULL && (label == NULL || (text != NULL && PyList_Append(values, text) == 0))) {
        o->parts = PyList_New(0);
        if (o->parts != NULL && PyList_Append(o->parts, values) != 0)
            Py_CLEAR(o->parts);
    }
    Py_XDECREF(text);
    Py_XDECREF(values);
    if (o->parts == NULL)
        fsm_py_break(o);
}

/* Add a value to it, which is taken over. */
FSM_PY_MAYBE void fsm_py_add(fsm_object *o, PyObject *value)
{
    Py_ssize_t depth = PyList_Size(o->parts);
    int failed = value == NULL ? -1 : PyList_Append(PyList_GetItem(o->parts, depth - 1), value);
    Py_XDECREF(value);
    if (failed != 0)
        fsm_py_break(o);
}

FSM_PY_MAYBE void fsm_py_bracket(fsm_object *o, bool opens)
{
    Py_ssize_t depth = PyList_Size(o->parts);
    if (opens) {
        PyObject *inner = PyList_New(0);
        int failed = inner == NULL ? -1 : PyList_Append(o->parts, inner);
        Py_XDECREF(inner);
        if (failed != 0)
            fsm_py_break(o);
    } else {
        PyObject *whole = PyList_AsTuple(PyList_GetItem(o->parts, depth - 1));
        if (whole == NULL || PyList_SetSlice(o->parts, depth - 1, depth, NULL) != 0) {
            Py_XDECREF(whole);
            fsm_py_break(o);
        }
        fsm_py_add(o, whole);
    }
}

/* What a callback returns is dropped; takes its arguments over. */
FSM_PY_MAYBE void fsm_py_tell(fsm_object *o, PyObject *callback, PyObject *arguments)
{
    PyObject *called = NULL;
    if (arguments != NULL) {
        Py_INCREF(callback); /* it may be replaced meanwhile */
        called = PyObject_Call(callback, arguments, NULL);
        Py_DECREF(callback);
        Py_DECREF(arguments);
    }
    if (called == NULL)
        fsm_py_break(o);
    Py_XDECREF(called);
}

FSM_PY_MAYBE void fsm_py_finish(fsm_object *o)
{
    if (o->parts == NULL)
        return;
    PyObject *values = PyList_AsTuple(PyList_GetItem(o->parts, 0));
    Py_CLEAR(o->parts);
    if (values == NULL)
        fsm_py_break(o);
    if (!o->is_reply) {
        if (o->log == NULL)
            Py_XDECREF(values);
        else
            fsm_py_tell(o, o->log, values);
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
    if (o->trace == NULL)
        return;
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
    if (arguments == NULL)
        Py_XDECREF(line);
    else
        (void)PyTuple_SetItem(arguments, 0, line);
    fsm_py_tell(o, o->trace, arguments);
}

/* What every line begins with: what caused it, if that is still to be told, and the slots. */
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
    if (!o->after_bracket)
        fsm_py_write(o, " ");
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
    if (is_quoted)
        fsm_py_write(o, "\"");
    fsm_py_write(o, PyBytes_AsString(bytes));
    if (is_quoted)
        fsm_py_write(o, "\"");
    Py_DECREF(bytes);
}

FSM_PY_MAYBE void fsm_py_show_bracket(fsm_object *o, bool opens)
{
    if (opens)
        fsm_py_space(o);
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
        if (type->kind == FSM_SYMBOL)
            fsm_py_show_string(o, (uint16_t)bits, true);
        else
            fsm_py_show_integer(o, type->kind == FSM_SIGNED && (int64_t)bits < 0, bits);
    }
}

FSM_PY_MAYBE void fsm_py_show_event(fsm_object *o, const fsm_machine_info *info, const void *e)
{
    const fsm_event_info *event = &info->events[fsm_event_of(info, e) - 1u];
    fsm_py_write(o, event->name);
    for (uint16_t i = 0u; i < event->field_count; i++)
        fsm_py_show(o, event->fields[i].type, fsm_at(e, event->fields[i].offset));
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
        if (fsm_is_running(slot->info, fsm_at(m, slot->offset)))
            fsm_py_dump(o, slot->info, fsm_at(m, slot->offset), &inner);
    }
}

/* ---- calling the host ------------------------------------------------------------------------ */

/* Call a method of the host; where it raises, or returns what it should not, the step is left. */
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
        if (i < count)
            value = fsm_py_give(o, fields[i].type, given[i]);
        else
            value = o->peer == 0u ? fsm_py_or_none(NULL) : fsm_py_string(o, o->peer);
        is_fine = value != NULL;
        if (passed <= FEW)
            few[i] = value;
        else
            is_fine = fsm_py_put(&many, i, value);
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
    for (Py_ssize_t i = 0; i < passed && passed <= FEW; i++)
        Py_XDECREF(few[i]);
    Py_XDECREF(many);
    is_fine = answer != NULL && (type == NULL || fsm_py_take(o, type, answer, call->said, result));
    Py_XDECREF(answer);
    if (!is_fine)
        fsm_py_break(o);
}

FSM_PY_MAYBE void fsm_py_operate(
    fsm_object *o, const fsm_machine_info *info, const fsm_py_call *calls, const char *path,
    uint32_t number, const void *const *given, void *result)
{
    const fsm_operation_info *of = &info->operations[number];
    if (of->result != NULL)
        memset(result, 0, of->result->size);
    if (calls[number].number < 0)
        return;
    fsm_py_ask(o, &calls[number], of->parameters, of->parameter_count, given, of->result, result);
    if (o->trace == NULL)
        return;
    fsm_py_begun(o, path);
    fsm_py_write(o, "op ");
    fsm_py_write(o, of->name);
    for (uint16_t i = 0u; i < of->parameter_count; i++)
        fsm_py_show(o, of->parameters[i].type, given[i]);
    if (of->result != NULL) {
        fsm_py_write(o, " =");
        fsm_py_show(o, of->result, result);
    }
    fsm_py_line(o);
}

FSM_PY_MAYBE void fsm_py_emit(
    fsm_object *o, const fsm_machine_info *info, const fsm_py_call *calls, uint32_t number,
    const void *const *given)
{
    const fsm_event_info *event = &info->events[number];
    if (calls[number].number >= 0)
        fsm_py_ask(o, &calls[number], event->fields, event->field_count, given, NULL, NULL);
}

/* ---- objects ------------------------------------------------------------------------------- */

/* A machine of a type or of one derived from it, with the module that the type came from. */
FSM_PY_MAYBE fsm_object *fsm_py_new(PyTypeObject *type, struct PyModuleDef *definition)
{
    PyObject *module = NULL;
    for (PyTypeObject *base = type; base != NULL && module == NULL;) {
        PyObject *found = PyType_GetModule(base);
        if (found != NULL && PyModule_GetDef(found) == definition)
            module = found;
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
    }
    return o;
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

/* The module stays: its strings may still be asked for. */
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
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    release(self);
    Py_DECREF(type);
}

/* Whether the host has all that a machine calls; the names of what it has not. */
FSM_PY_MAYBE bool fsm_py_provides(
    fsm_object *o, PyObject *host, const char *name, Py_ssize_t first, Py_ssize_t after)
{
    PyObject *missing = PyList_New(0);
    bool is_fine = missing != NULL;
    for (Py_ssize_t i = first; i < after && is_fine; i++) {
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
        if (type != NULL && all != NULL)
            PyErr_Format(PyExc_TypeError, "%U lacks what %s calls: %U", type, name, all);
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
    if (value == NULL)
        PyErr_SetString(PyExc_AttributeError, "a part of a machine cannot be deleted");
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

FSM_PY_ATTRIBUTE(log)
FSM_PY_ATTRIBUTE(reply)
FSM_PY_ATTRIBUTE(trace)

/* ---- modules ------------------------------------------------------------------------------- */

FSM_PY_MAYBE PyObject *fsm_py_texts(const char *const *texts, Py_ssize_t count)
{
    PyObject *all = PyTuple_New(count);
    for (Py_ssize_t i = 0; i < count; i++)
        if (!fsm_py_put(&all, i, PyUnicode_InternFromString(texts[i])))
            return NULL;
    return all;
}

/* A dictionary of places by name; of several of one name the place that is in `at`, if given. */
FSM_PY_MAYBE PyObject *fsm_py_places(PyObject *names, const Py_ssize_t *at)
{
    PyObject *all = PyDict_New();
    for (Py_ssize_t i = 0; all != NULL && i < PyTuple_Size(names); i++) {
        PyObject *place = PyLong_FromSsize_t(at == NULL ? i : at[i]);
        if (place == NULL || PyDict_SetItem(all, PyTuple_GetItem(names, i), place) != 0)
            Py_CLEAR(all);
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

/* Only at the end: machines keep their module, and ask it for strings until they are gone. */
FSM_PY_MAYBE void fsm_py_module_free(void *module)
{
    fsm_py_module *known = (fsm_py_module *)PyModule_GetState((PyObject *)module);
    if (known == NULL)
        return;
    Py_CLEAR(known->symbols);
    Py_CLEAR(known->numbers);
    Py_CLEAR(known->states);
    Py_CLEAR(known->events);
    Py_CLEAR(known->names);
    Py_CLEAR(known->calls);
}

#endif
