"""How machines are saved and restored, as C; see `stepping` for its marks."""

LIBRARY = """\
static bool fsm_is_foreign; /* whether a string was saved that the chart does not know */
#define FSM_HOOK_FOREIGN(symbol) (fsm_is_foreign = true)
#include "fsm_save.c"
"""
"""Once in a file, before the machines of all its modules."""

SAVED_METHODS = """
static PyObject *@_save(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    @_object *self = (@_object *)object;
    PyObject *values[1];
    uint8_t bytes[$UPPER_SAVED_BYTES];
    uint32_t now = self->o.now;
    if (!fsm_py_arguments("save", names, 1, given, count, keywords, values)
        || (values[0] != NULL && values[0] != Py_None && !fsm_py_time(values[0], &now))
        || !fsm_py_is_free(&self->o, $NAME))
        return NULL;
    fsm_is_foreign = false;
    if (!$P_save(&self->m, now, bytes) || fsm_is_foreign) {
        PyErr_Format(
            PyExc_ValueError, "%s holds a text that its chart nowhere mentions", $NAME);
        return NULL;
    }
    return PyBytes_FromStringAndSize((const char *)bytes, (Py_ssize_t)sizeof bytes);
}

static PyObject *@_restore(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"saved", "now"};
    static const char *const faults[] = {
        NULL, "microsteps", "internal", "range", "error.*", "invoked",
    };
    @_object *self = (@_object *)object;
    PyObject *values[2];
    char *bytes = NULL;
    Py_ssize_t size = 0;
    uint32_t now = 0u;
    if (!fsm_py_arguments("restore", names, 2, given, count, keywords, values)
        || !fsm_py_all("restore", names, 1, values)
        || (values[1] != NULL && !fsm_py_time(values[1], &now))
        || PyBytes_AsStringAndSize(values[0], &bytes, &size) != 0
        || !fsm_py_is_free(&self->o, $NAME))
        return NULL;
    switch ($P_restore(&self->m, now, (const uint8_t *)bytes, (size_t)size)) {
        case FSM_RESTORED:
            self->o.now = now;
            self->o.fault = faults[$P_fault(&self->m)];
            return fsm_py_or_none(NULL);
        case FSM_FOREIGN:
            PyErr_Format(
                PyExc_ValueError, "this was saved by another chart than %s", $NAME);
            return NULL;
        default:
            PyErr_Format(PyExc_ValueError, "this is no saved %s, or damaged", $NAME);
            return NULL;
    }
}
"""
