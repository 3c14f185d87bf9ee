"""The methods of the class that do not depend on names of the chart, as C.

``@`` is the prefix of the wrapper, ``$P`` that of the machine; see `tracing.fill`.
"""

OBJECT = """
typedef struct {
    fsm_object o;
    $P m;
[calls]    $P saved; /* as it was before the step at hand */
} @_object;

static inline fsm_object *@_of_$P($P *m)
{
    return (fsm_object *)(void *)((char *)m - offsetof(@_object, m));
}
"""

WITHIN = """
static inline fsm_object *@_of_$P($P *m)
{
    return @_of_$HOLDER(($HOLDER *)(void *)((char *)m - offsetof($HOLDER, $SLOT)));
}
"""

METHODS = """
static bool @_runs(const $P *m)
{
    return $RUNNING;
}

[calls]/* What may be left in its midst: the host is called. */
[calls]typedef struct {
[calls]    @_object *self;
[calls]    const $P_event *e;
[calls]    uint32_t now;
[calls]    fsm_result result;
[calls]} @_job;

[calls]static bool @_attempt(@_job *job, void (*work)(void *))
[calls]{
[calls]    @_object *self = job->self;
[calls]    const char *fault = self->o.fault;
[calls]    self->saved = self->m;
[calls]    if (fsm_py_guarded(&self->o, work, job))
[calls]        return true;
[calls]    self->m = self->saved;
[calls]    self->o.fault = fault;
[calls]    return false;
[calls]}

[calls]static void @_do_start(void *job)
[calls]{
[calls]    $P_start(&((@_job *)job)->self->m, ((@_job *)job)->now);
[calls]}

[calls]static void @_do_run(void *job)
[calls]{
[calls]    $P_run(&((@_job *)job)->self->m, ((@_job *)job)->now);
[calls]}

[calls]static void @_do_dispatch(void *job)
[calls]{
[calls]    @_job *given = (@_job *)job;
[calls]    given->result = $P_dispatch(&given->self->m, given->e, given->now);
[calls]}

static PyObject *@_take(@_object *self, const $P_event *e, Py_ssize_t index)
{
    fsm_result result = FSM_STOPPED;
    (void)index;
[calls]    if (!fsm_py_is_free(&self->o, $NAME))
[calls]        return NULL;
[replies]    fsm_py_set(&self->o.reply, Py_None);
[calls]    if (@_runs(&self->m)) {
[calls]        @_job job = {self, e, self->o.now, FSM_STOPPED};
[calls]        if (!@_attempt(&job, @_do_dispatch))
[calls]            return NULL;
[calls]        result = job.result;
[calls]    }
[plain]    result = $P_dispatch(&self->m, e, self->o.now);
[replies]    const fsm_type *reply = $P_info.events[index].reply;
[replies]    if (reply != NULL && reply->kind == FSM_BOOL && self->o.reply != NULL)
[replies]        fsm_py_set(&self->o.reply, PyObject_IsTrue(self->o.reply) ? Py_True : Py_False);
    return fsm_py_bool_of(result == FSM_HANDLED);
}

static PyObject *@_put(@_object *self, const $P_event *e)
{
    return fsm_py_bool_of($P_post(&self->m, e));
}

static PyObject *@_start(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    @_object *self = (@_object *)object;
    PyObject *values[1];
    uint32_t now = 0u;
    if (!fsm_py_arguments("start", names, 1, given, count, keywords, values)
        || (values[0] != NULL && !fsm_py_time(values[0], &now)))
        return NULL;
[calls]    if (!fsm_py_is_free(&self->o, $NAME))
[calls]        return NULL;
    self->o.now = now;
[calls]    @_job job = {self, NULL, now, FSM_STOPPED};
[calls]    if (!@_attempt(&job, @_do_start))
[calls]        return NULL;
[plain]    $P_start(&self->m, now);
    return fsm_py_or_none(NULL);
}

static PyObject *@_run(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    @_object *self = (@_object *)object;
    PyObject *values[1];
    uint32_t now = 0u;
    if (!fsm_py_arguments("run", names, 1, given, count, keywords, values)
        || !fsm_py_all("run", names, 1, values) || !fsm_py_time(values[0], &now))
        return NULL;
[calls]    if (!fsm_py_is_free(&self->o, $NAME))
[calls]        return NULL;
    if (@_runs(&self->m)) {
        self->o.now = now;
[calls]        @_job job = {self, NULL, now, FSM_STOPPED};
[calls]        if (!@_attempt(&job, @_do_run))
[calls]            return NULL;
[plain]        $P_run(&self->m, now);
    }
    return fsm_py_bool_of(@_runs(&self->m));
}

/* An event by its name, with its payload by position. */
static bool @_read(@_object *self, PyObject *const *given, Py_ssize_t count, $P_event *e,
                   const char *method, Py_ssize_t *index)
{
    if (count < 1) {
        PyErr_Format(PyExc_TypeError, "%s() lacks the argument 'event'", method);
        return false;
    }
    *index = fsm_py_named(&self->o, &$P_info, given[0], count - 1);
    return *index >= 0 && fsm_py_fill(&self->o, &$P_info, @_events, *index, e, given + 1);
}

static PyObject *@_post(PyObject *object, PyObject *const *given, Py_ssize_t count)
{
    @_object *self = (@_object *)object;
    $P_event e = $UPPER_NO_EVENT;
    Py_ssize_t index = 0;
    return @_read(self, given, count, &e, "post", &index) ? @_put(self, &e) : NULL;
}

static PyObject *@_dispatch(
    PyObject *object, PyObject *const *given, Py_ssize_t count, PyObject *keywords)
{
    static const char *const names[] = {"now"};
    @_object *self = (@_object *)object;
    $P_event e = $UPPER_NO_EVENT;
    PyObject *values[1];
    uint32_t now = 0u;
    Py_ssize_t index = 0;
    if (!fsm_py_arguments("dispatch", names, 1, given + count, 0, keywords, values)
        || !@_read(self, given, count, &e, "dispatch", &index))
        return NULL;
    bool is_given = values[0] != NULL && values[0] != Py_None;
    if (is_given && !fsm_py_time(values[0], &now))
        return NULL;
[calls]    if (!fsm_py_is_free(&self->o, $NAME))
[calls]        return NULL;
    if (is_given && @_runs(&self->m))
        self->o.now = now;
    return @_take(self, &e, index);
}

static PyObject *@_next_deadline(PyObject *object, PyObject *unused)
{
    uint32_t due = 0u;
    (void)unused;
    if (!$P_next_deadline(&((@_object *)object)->m, &due))
        return fsm_py_or_none(NULL);
    return PyLong_FromUnsignedLong(due);
}

static PyObject *@_is_in(PyObject *object, PyObject *state)
{
    @_object *self = (@_object *)object;
    PyObject *found = PyDict_GetItemWithError(self->o.known->states, state);
    if (found != NULL)
        return fsm_py_bool_of($P_in(&self->m, ($P_state)PyLong_AsLong(found)));
    if (PyErr_Occurred() == NULL)
        PyErr_Format(PyExc_ValueError, "%s has no state %R", $NAME, state);
    return NULL;
}

static PyObject *@_active(PyObject *object, PyObject *unused)
{
    @_object *self = (@_object *)object;
    $P_state states[$LEAVES];
    uint16_t count = $P_active(&self->m, states, $LEAVES);
    PyObject *names = PyTuple_New(count);
    (void)unused;
    for (uint16_t i = 0u; i < count; i++) {
        PyObject *name = PyTuple_GetItem(self->o.known->names, states[i]);
        if (!fsm_py_put(&names, i, fsm_py_or_none(name)))
            return NULL;
    }
    return names;
}

[traced]static void @_do_dump(void *job)
[traced]{
[traced]    @_object *self = ((@_job *)job)->self;
[traced]    const fsm_py_path outermost = {NULL, NULL};
[traced]    fsm_py_dump(&self->o, &$P_info, &self->m, &outermost);
[traced]}

[traced]/* For tests: all data as lines of the trace. */
[traced]static PyObject *@_dump(PyObject *object, PyObject *unused)
[traced]{
[traced]    @_job job = {(@_object *)object, NULL, 0u, FSM_STOPPED};
[traced]    (void)unused;
[traced]    if (!fsm_py_is_free(&job.self->o, $NAME) || !@_attempt(&job, @_do_dump))
[traced]        return NULL;
[traced]    return fsm_py_or_none(NULL);
[traced]}

static PyObject *@_get_running(PyObject *object, void *unused)
{
    (void)unused;
    return fsm_py_bool_of(@_runs(&((@_object *)object)->m));
}

static PyObject *@_get_finished(PyObject *object, void *unused)
{
    (void)unused;
    return fsm_py_bool_of($P_finished(&((@_object *)object)->m));
}

static PyObject *@_get_fault(PyObject *object, void *unused)
{
    @_object *self = (@_object *)object;
    (void)unused;
    if ($P_fault(&self->m) == FSM_NO_FAULT || self->o.fault == NULL)
        return fsm_py_or_none(NULL);
    return PyUnicode_FromString(self->o.fault);
}
"""

VARIABLES = """
static PyObject *@_get(PyObject *object, void *number)
{
    @_object *self = (@_object *)object;
    const fsm_field *of = &$P_info.variables[(uintptr_t)number];
    return fsm_py_give(&self->o, of->type, fsm_at(&self->m, of->offset));
}

static int @_set(PyObject *object, PyObject *value, void *number)
{
    @_object *self = (@_object *)object;
    const fsm_field *of = &$P_info.variables[(uintptr_t)number];
    const char *what = @_variables[(uintptr_t)number];
    if (!fsm_py_given(value))
        return -1;
    return fsm_py_assign(&self->o, of->type, value, what, fsm_place_at(&self->m, of->offset));
}
"""

MAKING = """
static struct PyModuleDef @_module;

static PyObject *@_new(PyTypeObject *type, PyObject *given, PyObject *keywords)
{
    fsm_object *o = fsm_py_new(type, &@_module);
    (void)given;
    (void)keywords;
    if (o != NULL)
        $P_init(&((@_object *)(void *)o)->m);
    return (PyObject *)o;
}

static int @_init(PyObject *object, PyObject *given, PyObject *keywords)
{
    static char first[] = "operations";
    static char *names[] = {first, NULL};
    @_object *self = (@_object *)object;
    PyObject *host = Py_None;
    if (!PyArg_ParseTupleAndKeywords(given, keywords, "|O:$CLASS", names, &host)
        || !fsm_py_is_free(&self->o, $NAME))
        return -1;
    PyObject *provider = host == Py_None ? object : host;
$CHECKS
    fsm_py_set(&self->o.host, host == object ? Py_None : host);
    fsm_py_set(&self->o.log, Py_None);
    fsm_py_set(&self->o.reply, Py_None);
    fsm_py_set(&self->o.trace, Py_None);
    self->o.now = 0u;
    self->o.fault = NULL;
    $P_init(&self->m);
    return 0;
}
"""

LOADING = """
static int @_execute(PyObject *module)
{
    fsm_py_module *known = (fsm_py_module *)PyModule_GetState(module);
    known->names = fsm_py_texts(@_states, $STATES);
    PyObject *events = fsm_py_texts(@_names, $EVENTS);
    known->calls = fsm_py_texts(@_calls, $CALLS);
    known->symbols = PyList_New(0);
    known->numbers = PyDict_New();
    if (known->names == NULL || events == NULL || known->calls == NULL || known->symbols == NULL
        || known->numbers == NULL) {
        Py_XDECREF(events);
        return -1;
    }
    known->states = fsm_py_places(known->names, NULL);
    known->events = fsm_py_places(events, @_places);
    bool is_fine = known->states != NULL && known->events != NULL;
    for (uint32_t i = 0u; is_fine && i < $SYMBOLSu; i++) {
        PyObject *text = PyUnicode_FromString($P_symbol(i));
        PyObject *number = PyLong_FromUnsignedLong(i);
        is_fine = text != NULL && number != NULL && PyList_Append(known->symbols, text) == 0
            && PyDict_SetItem(known->numbers, text, number) == 0;
        Py_XDECREF(text);
        Py_XDECREF(number);
    }
    is_fine = is_fine && fsm_py_define(module, @_python, "$FILE");
    PyObject *type = is_fine ? PyType_FromModuleAndSpec(module, &@_type, NULL) : NULL;
    is_fine = type != NULL
        && fsm_py_attribute(type, "__module__", PyModule_GetNameObject(module))
        && fsm_py_attribute(type, "NAME", PyUnicode_FromString($NAME))
        && fsm_py_attribute(type, "STATES", fsm_py_or_none(known->names))
        && fsm_py_attribute(type, "EVENTS", fsm_py_or_none(events))
        && fsm_py_attribute(type, "OPERATIONS",
                            PyTuple_GetSlice(known->calls, $FIRST, $CALLS))
        && PyModule_AddObjectRef(module, "$CLASS", type) == 0;
    Py_XDECREF(type);
    Py_XDECREF(events);
    return is_fine ? 0 : -1;
}

static PyModuleDef_Slot @_slots_of_module[] = {{Py_mod_exec, (void *)@_execute}, {0, NULL}};

static struct PyModuleDef @_module = {
    PyModuleDef_HEAD_INIT, "$MODULE", $DOC, sizeof(fsm_py_module),
    NULL, @_slots_of_module, fsm_py_module_traverse, NULL, fsm_py_module_free,
};

PyMODINIT_FUNC PyInit_$MODULE(void)
{
    return PyModuleDef_Init(&@_module);
}
"""
