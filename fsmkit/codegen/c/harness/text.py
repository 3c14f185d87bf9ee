"""C of the harness in which only the prefix of the machine changes; ``@`` stands for it.

``$PATH`` stands for what every line begins with: the slots in which the machine lies; ``$NOW`` for
its time; ``$STATES`` for the leaves that may be active at most: all its states (65,535 are too many
for a stack).
"""

HOOKS = r"""
#undef FSM_HOOK_BEGIN
#undef FSM_HOOK_END
#undef FSM_HOOK_EXIT
#undef FSM_HOOK_TAKE
#undef FSM_HOOK_ENTER
#undef FSM_HOOK_EVENT
#undef FSM_HOOK_TEXT
#undef FSM_HOOK_VALUE_I
#undef FSM_HOOK_VALUE_F
#undef FSM_HOOK_VALUE_S
#undef FSM_HOOK_LINE
static uint32_t @_now;
static void @_hook_begin(@ *m, int cause, unsigned index);
static void @_hook_end(@ *m);
static void @_hook_event(int what, const @_event *e);
static void @_hook_text(int what, const char *text, unsigned long number);
static void @_hook_symbol(long symbol);
#define FSM_HOOK_BEGIN(m, cause, index) @_hook_begin(m, cause, index)
#define FSM_HOOK_END(m) @_hook_end(m)
#define FSM_HOOK_EXIT(m, state) (@_begun(), printf("- %s\n", @_state_name(state)))
#define FSM_HOOK_TAKE(m, transition) (@_begun(), printf("t %u\n", (unsigned)(transition)))
#define FSM_HOOK_ENTER(m, state) (@_begun(), printf("+ %s\n", @_state_name(state)))
#define FSM_HOOK_EVENT(m, what, e) @_hook_event(what, e)
#define FSM_HOOK_TEXT(m, what, text, number) @_hook_text(what, text, number)
#define FSM_HOOK_VALUE_I(m, value) show_integer((value) < 0, (uint64_t)(value))
#define FSM_HOOK_VALUE_F(m, value) show_float((double)(value))
#define FSM_HOOK_VALUE_S(m, value) @_hook_symbol(value)
#define FSM_HOOK_LINE(m) printf("\n")
static const char *@_symbol_text(long symbol);
static void @_begun(void)
{
    if (pending[0] != 0) {
        fputs(pending, stdout);
        pending[0] = 0;
    }
    fputs($PATH, stdout);
}
static void @_hook_begin(@ *m, int cause, unsigned index)
{
    (void)m;
    if (cause != FSM_EVENTLESS)
        @_begun();
    if (cause == FSM_START)
        printf("\100%u > start\n", (unsigned)$NOW);
    else if (cause == FSM_EVENT) {
        printf("\100%u > event ", (unsigned)$NOW);
    } else if (cause == FSM_TIMEOUT)
        printf("\100%u > timeout %u\n", (unsigned)$NOW, index);
    else
        sprintf(pending, "\100%u > eventless\n", (unsigned)$NOW);
}
static void @_hook_end(@ *m)
{
    uint16_t count = 0;
    static @_state states[$STATES];
    if (pending[0] != 0) {
        pending[0] = 0;
        return;
    }
    count = @_active(m, states, $STATES);
    @_begun();
    printf("=");
    for (uint16_t i = 0; i < count; i++)
        printf(" %s", @_state_name(states[i]));
    printf("%s\n", @_finished(m) ? " finished" : "");
}
static int @_delayed_line;
static void @_hook_event(int what, const @_event *e)
{
    static const char *const verbs[] = {"raise", "send", "delay", "out", "unhandled"};
    if (what == FSM_TAKEN) { /* goes on with the line of its macrostep */
        @_show_event(e);
        printf("\n");
        return;
    }
    @_begun();
    printf("%s ", verbs[what]);
    if (what == FSM_UNHANDLED)
        printf("%s", @_event_text((uint32_t)e->event));
    else
        @_show_event(e);
    @_delayed_line = what == FSM_DELAYED || what == FSM_LEFT;
    if (!@_delayed_line)
        printf("\n");
}
static void @_hook_text(int what, const char *text, unsigned long number)
{
    if (what != FSM_DELAYED && what != FSM_LEFT) /* these go on with a line */
        @_begun();
    switch (what) {
    case FSM_DELAYED: printf(" in %lu\n", number); break;
    case FSM_LEFT:
        if (number != 0)
            printf(" to %s", @_symbol_text((long)number));
        printf("\n");
        break;
    case FSM_ERROR: printf("error %s\n", text); break;
    case FSM_FULL: printf("full %s\n", text); break;
    case FSM_FAULT: printf("fault %s\n", text); break;
    case FSM_CANCELLED: printf("cancel %s\n", text); break;
    case FSM_LOG: printf("log %s", text); break;
    case FSM_REPLY: printf("reply"); break;
    default: break;
    }
}
static void @_hook_symbol(long symbol)
{
    if (symbol < 0)
        show_bracket(symbol == -1);
    else
        show_text(@_symbol_text(symbol));
}
"""

VERBS = """
if (strcmp(verb, "start") == 0) {
    @_now = (uint32_t)read_integer();
    @_start(&@_machine, @_now);
} else if (strcmp(verb, "run") == 0) {
    @_now = (uint32_t)read_integer();
    @_run(&@_machine, @_now);
} else if (strcmp(verb, "post") == 0) {
    @_event e = @_read_event();
    if (!@_post(&@_machine, &e))
        printf("full queue\\n");
} else if (strcmp(verb, "dispatch") == 0) {
    @_event e = @_read_event();
    (void)@_dispatch(&@_machine, &e, @_now);
} else if (strcmp(verb, "ask") == 0) {
    @_event e = @_read_event();
    static const char *const answers[] = {"ignored", "handled", "busy", "stopped"};
    fsm_result result = @_dispatch(&@_machine, &e, @_now);
    printf("answer %s", answers[result]);
    if (result == FSM_IGNORED || result == FSM_HANDLED)
        @_show_reply(&@_machine, &e);
    printf("\\n");
} else if (strcmp(verb, "save") == 0) {
    if (!@_save(&@_machine, @_now, @_saved))
        printf("not saved\\n");
    printf("saved ");
    for (unsigned i = 0; i < sizeof @_saved; i++)
        printf("%02x", @_saved[i]);
    printf("\\n");
} else if (strcmp(verb, "restore") == 0) {
    @_now = (uint32_t)read_integer();
    memset(&@_machine, 0xA5, sizeof @_machine);
    @_init(&@_machine);
    if (@_restore(&@_machine, @_now, @_saved, sizeof @_saved) != FSM_RESTORED)
        printf("not restored\\n");
}
"""
